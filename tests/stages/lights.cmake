# The light kernels on every SIMD target: probabilities, densities and irradiances against closed forms.
add_executable(light_tests
  light_environment_test.cpp
  light_harness.cpp
  light_sample_test.cpp
  light_tree_test.cpp
  light_triangle_test.cpp)
target_link_libraries(light_tests PRIVATE carpool_lights carpool_simd test_support GTest::gtest_main)
gtest_discover_tests(light_tests PROPERTIES LABELS hard)
