// BoxData: the voxels of a padded box, its layers, and what renderers derived from them. One thread at a time uses it.
#pragma once

#include <concepts>
#include <cstddef>
#include <map>
#include <memory>
#include <optional>
#include <tuple>
#include <typeindex>
#include <utility>

#include "common/classification/classification_table.h"
#include "common/frame/frame_setup.h"
#include "common/mesh/mesh.h"
#include "common/volume/bricks.h"
#include "worker/renderers/brick_ranges.h"

namespace slabstream {

// Data that one renderer keeps of a padded box between frames. Each renderer has its own class.
class BoxCache {
 public:
  virtual ~BoxCache() = default;
  virtual std::size_t bytes() const = 0;  // memory
};

// nullopt, null: the dataset has no such layer.
struct BoxLayers {
  std::optional<BrickedVoxels> labels, overlay;
  std::shared_ptr<const Mesh> cells;  // those that touch the box, in the order of the whole grid; perhaps others
};

class BoxData {
 public:
  explicit BoxData(VoxelBlock voxels, BoxLayers layers = {}) : block_(std::move(voxels)), layers_(std::move(layers)) {}
  explicit BoxData(BrickedVoxels voxels, BoxLayers layers = {}) : bricks_(std::move(voxels)), layers_(std::move(layers)) {}
  BoxData(const BoxData&) = delete;
  BoxData& operator=(const BoxData&) = delete;

  // All voxels as one block. If there are only bricks, the first call turns them into a block; after that any thread may call.
  const VoxelBlock& voxels() const;
  VoxelBricks bricks() const { return bricks_ ? VoxelBricks(*bricks_) : VoxelBricks(block_); }

  const BoxLayers& layers() const { return layers_; }
  // Of volume and layers, the type whose samples take most.
  ScalarType widest_type() const;

  // The range of samples of each brick.
  const BrickRanges& ranges();

  // The table of this frame's renderer and transfer function (RendererKind::Table). Valid until the next call.
  const ClassificationTable& Classification(const FrameSetup& setup);

  // The renderer's cache. The first call creates it.
  template <std::derived_from<BoxCache> Cache>
  Cache& CacheOf() {
    std::unique_ptr<BoxCache>& cache = caches_[typeid(Cache)];
    if (cache == nullptr) cache = std::make_unique<Cache>();
    return static_cast<Cache&>(*cache);
  }

  // Memory of voxels and of everything derived from them.
  std::size_t bytes() const;

 private:
  // The same samples, stored in one of two ways.
  mutable VoxelBlock block_;
  mutable std::optional<BrickedVoxels> bricks_;  // then block_ is empty

  BoxLayers layers_;
  std::optional<BrickRanges> ranges_;
  std::optional<std::tuple<const RendererKind*, TransferFunction, ValueRange>> classified_;  // table_ was made from these
  ClassificationTable table_;
  std::map<std::type_index, std::unique_ptr<BoxCache>> caches_;
};

}  // namespace slabstream
