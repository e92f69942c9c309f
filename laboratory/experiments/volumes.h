// The volumes of an experiment, kept between its trials.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "common/base/lru_map.h"
#include "common/volume/occupancy_grid.h"
#include "common/volume/summary.h"
#include "common/volume/volume.h"
#include "laboratory/bench/bench_cases.h"
#include "laboratory/experiments/failure.h"
#include "laboratory/experiments/request_json.h"

namespace slabstream {

struct VolumeInUse {
  std::shared_ptr<const Volume> volume;
  std::shared_ptr<const VolumeSummary> summary;
};

// Keeps the most recently used volumes within a budget, since trials come in random order. One thread at a time.
class VolumeCache {
 public:
  explicit VolumeCache(std::size_t budget_bytes = std::size_t{1} << 30) : budget_bytes_(budget_bytes) {}
  // Makes or reads the volume if it is not held. Cases of one sphere or one file share their volume. InvalidArgument: the file was read
  // before and has changed since; errors of LoadBenchVolume.
  VolumeInUse Get(const BenchCase& volume);
  // What the volume holds, independent of its name. A sphere: class, size and occupancy. A file: its path, its description and a digest of
  // its voxels, as they were when it was first read; so a header stands for its detached data, too. Errors of Get.
  Json Identity(const BenchCase& volume);
  // The voxels that its renderer draws under its transfer function.
  std::shared_ptr<const OccupancyGrid> Occupied(const BenchCase& volume);

 private:
  std::size_t budget_bytes_;
  LruMap<std::string, VolumeInUse> held_;  // by source
  std::map<std::string, Json> read_;       // identities of files by canonical path
  std::map<std::pair<std::string, const RendererKind*>, std::shared_ptr<const OccupancyGrid>> occupied_;  // by identity and transfer
};

// The columns of results that a volume fills: volume; n and occupancy of spheres.
Json ColumnsOf(const BenchCase& volume);

// The volumes that a user named after `option`; `at_service`: datasets. Errors of ParseBenchCase. Their datasets differ, because tables and
// figures are called after them: of two files v.nrrd the second is "v-2".
std::vector<BenchCase> NamedVolumes(const std::string& option, const std::vector<std::string>& named, bool at_service = false);

// NamedVolumes, or if there are none the installed real volumes, such as the brain, beside the spheres.
std::vector<BenchCase> RealVolumes(const std::vector<std::string>& named);

}  // namespace slabstream
