# The texture kernel against a scalar reference in double, on every SIMD target.
add_executable(texture_tests texture_test.cpp texture_reference.cpp)
target_link_libraries(texture_tests PRIVATE carpool_simd GTest::gtest_main)
gtest_discover_tests(texture_tests PROPERTIES LABELS hard)
