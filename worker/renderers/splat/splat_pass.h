// SplatPass: data that the bands of one Render share, made once a frame: sample positions of slices, shading tables, and the image's
// bounds.
#pragma once

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

struct SplatPass {
  // `frame_light`, `frame_shapes`: null: there are none.
  SplatPass(const OccupiedVoxels& occupied_voxels, const ClassificationTable& table, const FrameSetup& frame_setup, const Box& own_box,
            const OcclusionMask& hidden_tiles, const FrameLight* frame_light = nullptr, const FrameShapes* frame_shapes = nullptr);

  const SliceSamples& Slice(std::int32_t k) const { return slices[std::size_t(k - cells.occupied.begin[cells.axes.c])]; }
  // By octet of a beam, from first_octet on: the segments that its voxels reach and the box owns, counted from the image's left border.
  const SegmentSpan* Reached(std::int32_t k) const {
    return &reached[std::size_t(k - cells.occupied.begin[cells.axes.c]) * std::size_t(octet_count)];
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
  std::vector<SegmentSpan> reached;               // [slice][octet]
};

}  // namespace slabstream
