// Lets oneTBB start more threads than the machine has cores, which is where races show.
#include <gtest/gtest.h>

#include <tbb/global_control.h>

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  const tbb::global_control many(tbb::global_control::max_allowed_parallelism, 32);
  return RUN_ALL_TESTS();
}
