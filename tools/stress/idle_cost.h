// What the process costs while nobody in it should be at work.
#pragma once

#include <string>

namespace carpool_stress {

// The processor time that this process takes, as a share of one core: the least of many short
// looks. Threads of oneTBB look around for a while before they sleep, longer where other programs
// want the cores; one that spins on and on would show in all of them. Takes a few milliseconds
// where the process is quiet, two seconds where it stays above `limit`.
double least_cpu_share(double limit);

// Which threads use the processor, over a tenth of a second: "thread 1234 (R) 99 %, ...".
std::string busy_threads();

}  // namespace carpool_stress
