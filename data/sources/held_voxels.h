// HeldVoxels: the voxels that a coordinator holds, for the workers of its own process (`--local`). They read them where they lie: a copy
// would take as much memory again, and more time than to read the file.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <utility>
#include <variant>

#include "common/volume/bricks.h"
#include "common/volume/volume.h"
#include "data/sources/volume_source.h"

namespace slabstream {

// A volume that is made when it is first asked for. Any thread may call it.
class LazyVolume {
 public:
  explicit LazyVolume(std::function<Volume()> make) : make_(std::move(make)) {}

  // If making it throws, the next call tries again.
  const Volume& Get() const {
    const std::lock_guard lock(mutex_);
    if (make_) {
      volume_ = make_();
      make_ = nullptr;  // and what it keeps
    }
    return volume_;
  }

 private:
  mutable std::mutex mutex_;              // guards what follows
  mutable std::function<Volume()> make_;  // null: it is made
  mutable Volume volume_;
};

struct HeldVoxels {
  std::variant<std::shared_ptr<const Volume>, std::shared_ptr<const BrickedVoxels>, std::shared_ptr<const LazyVolume>> voxels;
  std::shared_ptr<VolumeSource> read_from = nullptr;  // tells how much was read of it (TakeStoredBytes); null: nothing does

  VoxelBricks view() const {
    if (const auto* const volume = std::get_if<std::shared_ptr<const Volume>>(&voxels)) return (*volume)->block;
    if (const auto* const lazy = std::get_if<std::shared_ptr<const LazyVolume>>(&voxels)) return (*lazy)->Get().block;
    return *std::get<std::shared_ptr<const BrickedVoxels>>(voxels);
  }
};

// Finds the held voxels of a dataset (DatasetId). Null: nobody holds them.
using FindHeldVoxels = std::function<std::shared_ptr<const HeldVoxels>(std::uint64_t dataset)>;

}  // namespace slabstream
