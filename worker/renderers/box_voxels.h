// BoxVoxels: the voxels of a padded box, and its cells. All renders of the box share them. Their values never change, but the way in which
// they are stored may. Any thread may call it.
#pragma once

#include <cstddef>
#include <memory>
#include <mutex>
#include <utility>

#include "common/mesh/mesh.h"
#include "common/volume/bricks.h"
#include "worker/renderers/padded_voxels.h"

namespace slabstream {

class BoxVoxels {
 public:
  // Samples, stored in one of three ways; the pointers of the others are null. Whoever holds a Samples may read them.
  struct Samples {
    std::shared_ptr<const VoxelBlock> block;
    std::shared_ptr<const BrickedVoxels> bricks;
    std::shared_ptr<const PaddedVoxels> padded;

    VoxelBricks view() const {
      return block != nullptr ? VoxelBricks(*block) : bricks != nullptr ? VoxelBricks(*bricks) : padded->bricks();
    }
  };

  BoxVoxels(VoxelBlock voxels, std::shared_ptr<const Mesh> cells)
      : samples_{std::make_shared<const VoxelBlock>(std::move(voxels)), nullptr, nullptr}, cells_(std::move(cells)) {}
  BoxVoxels(BrickedVoxels voxels, std::shared_ptr<const Mesh> cells)
      : samples_{nullptr, std::make_shared<const BrickedVoxels>(std::move(voxels)), nullptr}, cells_(std::move(cells)) {}
  BoxVoxels(PaddedVoxels voxels, std::shared_ptr<const Mesh> cells)
      : samples_{nullptr, nullptr, std::make_shared<const PaddedVoxels>(std::move(voxels))}, cells_(std::move(cells)) {}

  Samples samples() const {
    const std::lock_guard lock(mutex_);
    return samples_;
  }
  // As one block. The first call turns samples into one that are stored in another way.
  Samples Block();
  // Those of an unstructured grid that touch the box, and perhaps others, in the order of the whole grid. Null: it is none.
  const std::shared_ptr<const Mesh>& cells() const { return cells_; }
  std::size_t bytes() const;  // memory

 private:
  mutable std::mutex mutex_;  // guards samples_
  Samples samples_;
  const std::shared_ptr<const Mesh> cells_;
};

}  // namespace slabstream
