# The parts of a session that need no renderer: settings and progress.
add_library(carpool_settings STATIC ${CMAKE_CURRENT_LIST_DIR}/settings.cpp)
target_link_libraries(carpool_settings PUBLIC carpool_base)

add_library(carpool_progress STATIC ${CMAKE_CURRENT_LIST_DIR}/progress.cpp)
target_link_libraries(carpool_progress PUBLIC carpool_base Threads::Threads)
