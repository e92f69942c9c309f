// The volumes of an experiment, kept between its trials.
#pragma once

#include <list>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "common/volume/occupancy_grid.h"
#include "common/volume/summary.h"
#include "common/volume/volume.h"
#include "laboratory/bench/bench_cases.h"
#include "laboratory/experiments/failure.h"

namespace slabstream {

struct VolumeInUse {
  std::shared_ptr<const Volume> volume;
  std::shared_ptr<const VolumeSummary> summary;
};

// Keeps the most recently used volumes within a budget, since trials come in random order. One thread at a time.
class VolumeCache {
 public:
  explicit VolumeCache(std::size_t budget_bytes = std::size_t{1} << 30) : budget_bytes_(budget_bytes) {}
  // Makes or reads the volume if it is not held. Cases of one dataset share their volume.
  VolumeInUse Get(const BenchCase& volume);
  // The voxels that its renderer draws under its transfer function.
  std::shared_ptr<const OccupancyGrid> Occupied(const BenchCase& volume);

 private:
  struct Held {
    std::string dataset;
    VolumeInUse volume;
  };
  std::size_t budget_bytes_;
  std::list<Held> held_;                                                                                  // most recently used first
  std::map<std::pair<std::string, const RendererKind*>, std::shared_ptr<const OccupancyGrid>> occupied_;  // by name of the case
};

// The name in reports: "class I, N = 300, 5 % occupied"; a file by its dataset's name.
std::string TitleOf(const BenchCase& volume);

// The volumes that the user named, or the installed real volumes, such as the brain, beside the spheres. Errors of ParseBenchCase.
std::vector<BenchCase> RealVolumes(const std::vector<std::string>& named);

}  // namespace slabstream
