# The BSDF: tables, energy, sampling against densities, values, on every SIMD target.
add_executable(test-bsdf
  ${CMAKE_CURRENT_LIST_DIR}/sampling_kernels.cpp
  ${CMAKE_CURRENT_LIST_DIR}/bsdf_departures_test.cpp
  ${CMAKE_CURRENT_LIST_DIR}/bsdf_energy_test.cpp
  ${CMAKE_CURRENT_LIST_DIR}/bsdf_kernels.cpp
  ${CMAKE_CURRENT_LIST_DIR}/bsdf_lobes_test.cpp
  ${CMAKE_CURRENT_LIST_DIR}/bsdf_sampling_test.cpp
  ${CMAKE_CURRENT_LIST_DIR}/bsdf_tables_test.cpp
  ${CMAKE_CURRENT_LIST_DIR}/bsdf_value_test.cpp)
target_link_libraries(test-bsdf PRIVATE carpool_stages carpool_simd test_support GTest::gtest_main)
gtest_discover_tests(test-bsdf DISCOVERY_TIMEOUT 60 PROPERTIES LABELS hard)

# The benchmark stands beside what it measures; the tests' list is where this part declares programs.
include(${CMAKE_CURRENT_LIST_DIR}/../../stages/bench/bench_kernels.cmake)
