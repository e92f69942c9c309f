// BoxData: the voxels of a padded box, its cells, and what renderers derived from them. One thread at a time uses it. If several renders
// use the same box at the same time, each has a BoxData of its own, and these share the voxels.
#pragma once

#include <concepts>
#include <cstddef>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <tuple>
#include <typeindex>
#include <utility>
#include <vector>

#include "common/classification/classification_table.h"
#include "common/frame/frame_setup.h"
#include "common/mesh/mesh.h"
#include "common/volume/bricks.h"
#include "worker/light/frame_light.h"
#include "worker/renderers/brick_ranges.h"
#include "worker/renderers/padded_voxels.h"
#include "worker/shapes/frame_shapes.h"

namespace slabstream {

// The voxels of a padded box, and its cells. All renders of the box share them. Their values never change, but the way in which they are
// stored may. Any thread may call it.
class BoxVoxels {
 public:
  // Samples, stored in one of four ways; the pointers of the others are null. Whoever holds a Samples may read them.
  struct Samples {
    std::shared_ptr<const VoxelBlock> block;
    std::shared_ptr<const BrickedVoxels> bricks;
    std::shared_ptr<const PaddedVoxels> padded;
    std::shared_ptr<const VoxelBricks> held;  // by somebody else: this keeps them there

    VoxelBricks view() const {
      if (block != nullptr) return *block;
      return bricks != nullptr ? VoxelBricks(*bricks) : padded != nullptr ? padded->bricks() : *held;
    }
  };

  BoxVoxels(VoxelBlock voxels, std::shared_ptr<const Mesh> cells)
      : samples_{std::make_shared<const VoxelBlock>(std::move(voxels)), nullptr, nullptr, nullptr}, cells_(std::move(cells)) {}
  BoxVoxels(BrickedVoxels voxels, std::shared_ptr<const Mesh> cells)
      : samples_{nullptr, std::make_shared<const BrickedVoxels>(std::move(voxels)), nullptr, nullptr}, cells_(std::move(cells)) {}
  BoxVoxels(PaddedVoxels voxels, std::shared_ptr<const Mesh> cells)
      : samples_{nullptr, nullptr, std::make_shared<const PaddedVoxels>(std::move(voxels)), nullptr}, cells_(std::move(cells)) {}
  // `owner` keeps the voxels.
  BoxVoxels(const VoxelBricks& voxels, std::shared_ptr<const void> owner, std::shared_ptr<const Mesh> cells)
      : samples_{nullptr, nullptr, nullptr, KeptBy(std::move(owner), voxels)}, cells_(std::move(cells)) {}

  Samples samples() const {
    const std::lock_guard lock(mutex_);
    return samples_;
  }
  // As one block. The first call turns samples into one that are stored in another way.
  Samples Block();
  // Those of an unstructured grid that touch the box, and perhaps others, in the order of the whole grid. Null: it is none.
  const std::shared_ptr<const Mesh>& cells() const { return cells_; }
  std::size_t bytes() const;  // memory, without that of others

 private:
  static std::shared_ptr<const VoxelBricks> KeptBy(std::shared_ptr<const void> owner, const VoxelBricks& voxels) {
    const auto kept = std::make_shared<std::pair<std::shared_ptr<const void>, VoxelBricks>>(std::move(owner), voxels);
    return {kept, &kept->second};
  }

  mutable std::mutex mutex_;  // guards samples_
  Samples samples_;
  const std::shared_ptr<const Mesh> cells_;
};

// Data that one renderer keeps of a padded box between frames. Each renderer has its own class.
class BoxCache {
 public:
  virtual ~BoxCache() = default;
  virtual std::size_t bytes() const = 0;  // memory
};

class BoxData {
 public:
  explicit BoxData(std::shared_ptr<BoxVoxels> voxels) : voxels_(std::move(voxels)), samples_(voxels_->samples()) {}
  explicit BoxData(VoxelBlock voxels, std::shared_ptr<const Mesh> cells = nullptr)
      : BoxData(std::make_shared<BoxVoxels>(std::move(voxels), std::move(cells))) {}
  explicit BoxData(BrickedVoxels voxels, std::shared_ptr<const Mesh> cells = nullptr)
      : BoxData(std::make_shared<BoxVoxels>(std::move(voxels), std::move(cells))) {}
  BoxData(const BoxData&) = delete;
  BoxData& operator=(const BoxData&) = delete;

  // All voxels as one block. The first call turns them into one if they are stored in another way; after that any thread may call.
  const VoxelBlock& voxels() const;
  VoxelBricks bricks() const { return samples_.view(); }
  const PaddedVoxels* padded() const { return samples_.padded.get(); }  // null: they are stored in another way
  // Between renders it lets go of the voxels, so that another BoxData may have them stored in the other way.
  void TakeVoxels() { samples_ = voxels_->samples(); }
  void LeaveVoxels() { samples_ = {}; }

  // Shadows and ambient occlusion of the frame that is rendered; null: it has none.
  void SetLight(std::shared_ptr<const FrameLight> light) { light_ = std::move(light); }
  const FrameLight* light() const { return light_.get(); }

  // The shapes of the frame that is rendered; null: it has none.
  void SetShapes(std::shared_ptr<const FrameShapes> shapes) { shapes_ = std::move(shapes); }
  const FrameShapes* shapes() const { return shapes_.get(); }

  // The other fields that the frame shows, in the order of FrameSetup::fields: their voxels around the box (PaddedBox). Null: the field
  // does not reach there. They must stay until the render ends.
  void SetFields(std::vector<BoxData*> fields) { fields_ = std::move(fields); }
  std::span<BoxData* const> fields() const { return fields_; }

  const std::shared_ptr<const Mesh>& cells() const { return voxels_->cells(); }

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

  // Memory of everything derived from the voxels.
  std::size_t derived_bytes() const;

 private:
  const std::shared_ptr<BoxVoxels> voxels_;
  mutable BoxVoxels::Samples samples_;  // the samples of voxels_; empty between renders
  std::optional<BrickRanges> ranges_;
  std::optional<std::tuple<const RendererKind*, TransferFunction, ValueRange>> classified_;  // table_ was made from these
  ClassificationTable table_;
  std::map<std::type_index, std::unique_ptr<BoxCache>> caches_;
  std::shared_ptr<const FrameLight> light_;
  std::shared_ptr<const FrameShapes> shapes_;
  std::vector<BoxData*> fields_;
};

}  // namespace slabstream
