# The guarded helpers of stages/simd, against double.
add_executable(test-numerics
  ${CMAKE_CURRENT_LIST_DIR}/sampling_kernels.cpp
  ${CMAKE_CURRENT_LIST_DIR}/numerics_test.cpp)
target_link_libraries(test-numerics PRIVATE carpool_stages carpool_simd GTest::gtest_main)
gtest_discover_tests(test-numerics DISCOVERY_TIMEOUT 60 PROPERTIES LABELS hard)
