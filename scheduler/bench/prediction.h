// How a run scales to machines nobody has at hand, from costs recorded on this one.
#pragma once

#include "rows.h"

namespace bench {

// predict records the costs of a run on one thread, and what publishing, stealing, waking and
// memory take; plays the run in simulation with 1 to 4096 workers; and compares the prediction for
// two threads with the time that two threads really take. Caches that cores share are not in the
// simulation.
void predict(Rows& rows, bool quick);

}  // namespace bench
