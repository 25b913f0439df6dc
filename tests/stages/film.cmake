add_executable(film_tests
  ${CMAKE_CURRENT_LIST_DIR}/executor_parts_test.cpp
  ${CMAKE_CURRENT_LIST_DIR}/fastest_test.cpp
  ${CMAKE_CURRENT_LIST_DIR}/film_test.cpp)
target_link_libraries(film_tests PRIVATE carpool_stages carpool_film GTest::gtest_main)
gtest_discover_tests(film_tests DISCOVERY_MODE PRE_TEST PROPERTIES LABELS hard)
