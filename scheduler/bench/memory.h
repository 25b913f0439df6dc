// Peak memory of a piece of work, as the system sees it.
#pragma once

#include <cstddef>
#include <functional>

namespace bench {

// peak_bytes runs the work in a process of its own and returns by how much its resident memory
// rose. Call it while the program has one thread: others do not survive in the new process.
std::size_t peak_bytes(const std::function<void()>& work);

}  // namespace bench
