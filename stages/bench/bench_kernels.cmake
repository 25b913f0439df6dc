# bench-kernels: one lane against plain scalar code, full width against one lane.
add_executable(bench-kernels ${CMAKE_CURRENT_LIST_DIR}/bench_kernels.cpp)
target_link_libraries(bench-kernels PRIVATE carpool_stages carpool_simd)
# The plain code stands for a program that follows one path at a time: its loop over items is no such
# program's, and must not be vectorised for it.
target_compile_options(bench-kernels PRIVATE
  $<IF:$<CXX_COMPILER_ID:Clang>,-fno-vectorize,-fno-tree-loop-vectorize>)
