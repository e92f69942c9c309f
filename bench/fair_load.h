// Measures two clients at the same time: one asks for small pictures, the other one for large ones, of another dataset or of the same. Says
// how long the small pictures take, and what the large ones lose.
#pragma once

#include "bench/service_processes.h"
#include "common/base/status.h"

namespace slabstream {

struct FairLoadOptions {
  ServiceSize service;  // with the large requests' sphere
  int size = 1024;      // pixels a side of their pictures
  int samples = 16;     // in each voxel length, of the intensity projection
};

// Large requests of three kinds (intensity projections of many samples; kd-trees; open policies) run alone. Then they run beside an endless
// loop of frames of 64 x 64 pixels of another dataset. The first kind also runs beside such frames of its own dataset. Prints the times
// alone and beside each other. Unavailable, if one of these holds:
// - The median latency of the small frames is more than three times their median latency alone, plus 50 ms.
// - The workers are less than 0.9 times as busy as with the large requests alone.
// - The small frames take more than 0.6 of the workers' time: half, and a tenth more.
// Call before this process has threads.
Status MeasureFairLoad(const FairLoadOptions& options);

}  // namespace slabstream
