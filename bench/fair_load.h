// What a client that looks at small pictures gets beside another client's large requests, of another dataset or of the same; and what these
// lose.
#pragma once

#include "common/base/status.h"

namespace slabstream {

struct FairLoadOptions {
  int volume = 512;              // voxels a side of the large requests' sphere
  int size = 1024;               // pixels a side of their pictures
  int workers = 2, threads = 1;  // threads: of each worker
  int samples = 16;              // in each voxel length, of the intensity projection
};

// Large requests of three kinds (intensity projections of many samples; kd-trees; open policies) run alone, and then beside an endless loop
// of frames of 64 x 64 pixels of another dataset; the first kind beside frames of its own dataset, too. Prints both. Unavailable: the small
// frames take, in the median, more than three times their latency alone and 50 ms; or the workers are less than 0.9 as busy as with the
// large request alone; or the small frames take more than half of the workers' time, and a tenth. Call before this process has threads.
Status MeasureFairLoad(const FairLoadOptions& options);

}  // namespace slabstream
