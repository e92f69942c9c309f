// SplatPass: data that the bands of one Render share, made once a frame: sample positions of slices, shading tables, and the image's
// bounds.
#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <optional>
#include <vector>

#include "common/image/occlusion_mask.h"
#include "worker/kernels/segment_set.h"
#include "worker/renderers/splat/light_octets.h"
#include "worker/renderers/splat/occupied_voxels.h"
#include "worker/renderers/splat/sheet_opacity.h"
#include "worker/renderers/splat/slice_clip.h"
#include "worker/renderers/splat/slice_samples.h"
#include "worker/shapes/frame_shapes.h"

namespace slabstream {

// The segments that an octet of a beam reaches and the box owns, counted from the image's left border.
struct OctetReach {
  SegmentSpan whole;  // if all of its voxels are occupied; empty: none
  // By pair of its voxels. Those of a part of the octet: from `begin` of its first pair to `end` of its last one.
  std::array<std::uint16_t, std::size_t{kOctet / 2}> begin{}, end{};

  // `occupied`: bit i: voxel i; not 0.
  SegmentSpan Of(std::uint32_t occupied) const {
    const std::int32_t from = begin[std::size_t(std::countr_zero(occupied) / 2)], to = end[std::size_t((std::bit_width(occupied) - 1) / 2)];
    return from < to ? MakeSpan(from, to) : SegmentSpan{};
  }
};

struct SplatPass {
  // `frame_light`, `frame_shapes`: null: there are none.
  SplatPass(const OccupiedVoxels& occupied_voxels, const ClassificationTable& table, const FrameSetup& frame_setup, const Box& own_box,
            const OcclusionMask& hidden_tiles, const FrameLight* frame_light = nullptr, const FrameShapes* frame_shapes = nullptr);

  const SliceSamples& Slice(std::int32_t k) const { return slices[std::size_t(k - cells.occupied.begin[cells.axes.c])]; }
  // By octet of a beam, from first_octet on.
  const OctetReach* Reached(std::int32_t k) const {
    return &reached[std::size_t(k - cells.occupied.begin[cells.axes.c]) * std::size_t(octet_count)];
  }

  // The segments that each cell of a beam reaches. Null for every slice if some cell reaches more than kWordSegments.
  const SegmentSpan* ReachedByCells(std::int32_t k) const {
    if (cells_reached.empty()) return nullptr;
    return &cells_reached[std::size_t(k - cells.occupied.begin[cells.axes.c]) * std::size_t(octet_count / kCellOctets)];
  }

  const OccupiedVoxels& cells;
  const FrameSetup& setup;
  const Box box;
  const FrameShapes* shapes;
  std::vector<PixelBounds> own;  // if there are shapes: of each slice of the box, the samples that it owns
  const OcclusionMask& hidden;
  SliceClip clip;
  SheetOpacity opacity;
  ShadeTables tables;
  std::optional<OctetLight> light;
  Footprints footprints;
  std::vector<SliceSamples> slices;               // the samples of the occupied slices
  PixelBounds bounds;                             // the image's pixels, in whole segments; empty if nothing shows
  std::int32_t first_octet = 0, octet_count = 0;  // octets of whole cells
  std::vector<OctetReach> reached;                // [slice][octet]
  std::vector<SegmentSpan> cells_reached;         // [slice][cell]

 private:
  void FindReachOfCells();
};

}  // namespace slabstream
