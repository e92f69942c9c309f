#include "worker/renderers/splat/splat_pass.h"

namespace slabstream {

SplatPass::SplatPass(const OccupiedVoxels& occupied_voxels, const ClassificationTable& table, const FrameSetup& frame_setup,
                     const Box& own_box, const OcclusionMask& hidden_tiles, const FrameLight* frame_light, const FrameShapes* frame_shapes)
    : cells(occupied_voxels),
      setup(frame_setup),
      box(own_box),
      shapes(frame_shapes),
      hidden(hidden_tiles),
      clip(frame_setup),
      opacity(frame_setup),
      tables(opacity.Tables(table)) {
  if (frame_light != nullptr) light.emplace(setup.shading, setup.camera.view_direction, *frame_light);
  const auto [c, u, v] = cells.axes;
  const Box& occupied = cells.occupied;
  for (std::int32_t k = occupied.begin[c]; k < occupied.end[c]; ++k) {
    slices.push_back(SampleSlice(setup, box, occupied, k, footprints));
    if (!slices.back().owned.empty()) bounds = Union(bounds, slices.back().owned);
  }
  if (shapes != nullptr) {
    const Box everywhere = {Uniform(-kMaxVolumeSide), Uniform(2 * kMaxVolumeSide)};
    for (std::int32_t k = box.begin[c]; k < box.end[c]; ++k) {
      own.push_back(SampleSlice(setup, box, everywhere, k, footprints).owned);
      bounds = Union(bounds, Intersection(own.back(), shapes->bounds()));
    }
  }
  if (bounds.empty()) return;
  bounds.x_begin = bounds.x_begin / kSegment * kSegment;
  bounds.x_end = (bounds.x_end + kSegment - 1) / kSegment * kSegment;

  first_octet = occupied.begin[u] / kCellVoxels * kCellOctets;
  octet_count = ((occupied.end[u] - 1) / kCellVoxels + 1) * kCellOctets - first_octet;
  reached.resize(slices.size() * std::size_t(octet_count));
  SegmentSpan* span = reached.data();
  constexpr std::int64_t kOctetStride = std::int64_t{kOctet} << 32;
  for (const SliceSamples& slice : slices) {
    const PixelBounds& owned = slice.owned;
    // For each octet: the first pixel with a tap in it, and the first one beyond it.
    FirstSamples first(slice.columns, std::int64_t{first_octet * kOctet - slice.along_u->taps + 1} << 32, kOctetStride);
    FirstSamples last(slice.columns, std::int64_t{(first_octet + 1) * kOctet} << 32, kOctetStride);
    for (std::int32_t octet = 0; octet < octet_count; ++octet, ++span, first.Next(), last.Next()) {
      if (owned.empty()) continue;
      const std::int32_t begin = first.In(owned.x_begin, owned.x_end) - bounds.x_begin;
      const std::int32_t end = last.In(owned.x_begin, owned.x_end) - bounds.x_begin;
      if (begin < end) *span = MakeSpan(begin / kSegment, (end + kSegment - 1) / kSegment);
    }
  }
}

}  // namespace slabstream
