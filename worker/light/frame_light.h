// FrameLight: what shadows and ambient occlusion leave of the light at each point of a frame's volume. All renderers read it
// (light_at-inl.h). It depends on the fields, the shapes, their looks, clipping and lights alone, so it is the same for every box and
// worker.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>

#include "common/memory/pooled_vector.h"
#include "common/volume/grid_map.h"
#include "worker/light/extinction.h"

namespace slabstream {

// Two shares in 1/255 for each voxel of the light volume and each light: of the ambient light, and all light that surfaces scatter
// (openness); and of this light (transmittance). There is one more voxel than the light volume has along each axis, like the one before.
struct FrameLight {
  Index3 size;  // the size of the light volume
  int lights = 0;
  // p, in voxels of the frame's volume, lies at scale * p + offset, clamped to [0, size - 1].
  std::array<float, 3> scale{}, offset{};
  // Neighbours along this axis lie next to each other: y if splatting visits slices along x, so that its beams run along y; else x.
  int fast = 0;
  std::array<std::int32_t, 3> stride{};  // bytes from voxel to voxel, by axis; 2 along the fast one
  std::int32_t light = 0;                // bytes from light to light
  UnwrittenVector<std::uint8_t> shares;  // and kSharesPadding more
  static constexpr std::size_t kSharesPadding = 16;

  // Its place among positions of another grid: p lies at scale * p + offset.
  struct View {
    const std::uint8_t* shares = nullptr;
    int lights = 0;
    int fast = 0;
    std::array<std::int32_t, 3> stride{};
    std::int32_t light = 0;
    std::array<float, 3> scale{}, offset{}, last{};
  };
  // `map`: from voxels of the frame's volume to those whose positions are looked up.
  View Seen(const GridMap& map = {}) const;

  struct Shares {
    float open = 1;
    std::array<float, std::size_t{kMaxLights}> reached{};  // by light
  };
  // The definition: linear interpolation with weights in 1/256 along the two other axes, then along the fast one.
  Shares At(const Vec3& p) const;
};

// `values` is called for what is not known. `shapes`: as for AddShapes (shape_extinction.h). What setups have in common is computed once
// and kept for some time, in the whole process: workers of a process share it. Any thread, within its task arena; setup.light is there.
// Never null.
std::shared_ptr<const FrameLight> MakeFrameLight(const LightValues& values, const FrameSetup& setup,
                                                 std::span<const std::shared_ptr<const VoxelBlock>> shapes = {});

}  // namespace slabstream
