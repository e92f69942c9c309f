// BoxVoxels: the voxels of a padded box and its layers. All renders of the box share them. Their values never change, but the way in which
// they are stored may. Any thread may call it.
#pragma once

#include <cstddef>
#include <memory>
#include <mutex>
#include <optional>
#include <utility>

#include "common/mesh/mesh.h"
#include "common/volume/bricks.h"

namespace slabstream {

// nullopt, null: the dataset has no such layer.
struct BoxLayers {
  std::optional<BrickedVoxels> labels, overlay;
  std::shared_ptr<const Mesh> cells;  // those that touch the box, and perhaps others, in the order of the whole grid
};

class BoxVoxels {
 public:
  // Samples, stored in one of two ways; the pointer of the other way is null. Whoever holds a Samples may read them.
  struct Samples {
    std::shared_ptr<const VoxelBlock> block;
    std::shared_ptr<const BrickedVoxels> bricks;

    VoxelBricks view() const { return block != nullptr ? VoxelBricks(*block) : VoxelBricks(*bricks); }
  };

  BoxVoxels(VoxelBlock voxels, BoxLayers layers)
      : samples_{std::make_shared<const VoxelBlock>(std::move(voxels)), nullptr}, layers_(std::move(layers)) {}
  BoxVoxels(BrickedVoxels voxels, BoxLayers layers)
      : samples_{nullptr, std::make_shared<const BrickedVoxels>(std::move(voxels))}, layers_(std::move(layers)) {}

  Samples samples() const {
    const std::lock_guard lock(mutex_);
    return samples_;
  }
  // As one block. If there are only bricks, the first call turns them into a block.
  Samples Block();
  const BoxLayers& layers() const { return layers_; }
  std::size_t bytes() const;  // memory

 private:
  mutable std::mutex mutex_;  // guards samples_
  Samples samples_;
  const BoxLayers layers_;
};

}  // namespace slabstream
