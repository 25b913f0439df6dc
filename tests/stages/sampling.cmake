# The sampler, its warps and the pixel filter, on every SIMD target.
add_executable(test-sampling
  ${CMAKE_CURRENT_LIST_DIR}/sampling_kernels.cpp
  ${CMAKE_CURRENT_LIST_DIR}/sampling_test.cpp
  ${CMAKE_CURRENT_LIST_DIR}/sampling_warp_test.cpp)
target_link_libraries(test-sampling PRIVATE carpool_stages carpool_simd test_support GTest::gtest_main)
gtest_discover_tests(test-sampling DISCOVERY_TIMEOUT 60 PROPERTIES LABELS hard)
