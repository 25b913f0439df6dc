# The parts of a session that need no renderer: settings and progress.
find_package(Threads REQUIRED)
add_library(carpool_settings STATIC ${CMAKE_CURRENT_LIST_DIR}/settings.cpp)
target_link_libraries(carpool_settings PUBLIC carpool_base)
