// The contract of a rendering pipeline, and the data that it renders from.
//
// A pipeline turns the voxels of a box (with their halo) into the box's local image: the samples that the box owns, for a frame's camera,
// transfer function and shading. It must give the same samples however the volume is divided (docs/rendering.md): nothing that it computes
// may depend on where the box begins or ends, but for which samples it owns.
#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <optional>

#include "common/base/status.h"
#include "common/image/local_image.h"
#include "common/image/occlusion_mask.h"
#include "common/planning/frame_plan.h"
#include "common/stats/report.h"
#include "common/volume/bricks.h"

namespace slabstream {

// The voxels of one slab with its halo, and what pipelines made from them: classification, normals, occupied voxels by direction. What
// was made is kept as long as it fits the transfer function at hand. Used by one thread at a time.
class SlabData {
 public:
  explicit SlabData(VoxelBlock voxels);
  explicit SlabData(BrickedVoxels voxels);
  ~SlabData();
  SlabData(const SlabData&) = delete;
  SlabData& operator=(const SlabData&) = delete;

  // All voxels as one block. The first call makes it if there are bricks only, which then go; from the next one on any thread may call.
  const VoxelBlock& voxels() const;
  VoxelBricks bricks() const { return bricks_ ? VoxelBricks(*bricks_) : VoxelBricks(block_); }

  // Memory of voxels and everything derived.
  std::size_t bytes() const;

  struct Derived;  // worker/render/derived.h
  Derived& derived() { return *derived_; }

 private:
  // The same samples, in one of two ways.
  mutable VoxelBlock block_;
  mutable std::optional<BrickedVoxels> bricks_;  // then block_ is empty
  std::unique_ptr<Derived> derived_;
};

class Renderer {
 public:
  virtual ~Renderer() = default;

  // Local image of `box`, whose voxels and halo (SlabBox) lie in `slab`. Pixels that `hidden` hides may be left empty. Adds stage times,
  // spans and counts to `report`. If `cancelled` becomes true it stops soon and returns Cancelled. Called within the task arena of the
  // worker's render threads: parallel algorithms of oneTBB use as many threads as the worker has. A stage's time is that of all threads.
  virtual Result<LocalImage> Render(SlabData& slab, const Box& box, const FrameSetup& setup, const OcclusionMask& hidden,
                                    const std::atomic<bool>& cancelled, RankReport& report) = 0;
};

// pipelines.cpp, the only list.
std::unique_ptr<Renderer> MakeRenderer(RendererKind kind);

using RendererFactory = std::function<std::unique_ptr<Renderer>(RendererKind)>;

}  // namespace slabstream
