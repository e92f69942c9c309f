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
  static_assert(kMaxGridSide / kSegment <= UINT16_MAX);
  reached.resize(slices.size() * std::size_t(octet_count));
  OctetReach* reach = reached.data();
  constexpr std::int64_t kPairStride = std::int64_t{2} << 32;
  for (const SliceSamples& slice : slices) {
    const PixelBounds& owned = slice.owned;
    // For each pair of voxels: the first pixel with a tap in it, and the first one beyond it.
    FirstSamples first(slice.columns, std::int64_t{first_octet * kOctet - slice.along_u->taps + 1} << 32, kPairStride);
    FirstSamples last(slice.columns, std::int64_t{first_octet * kOctet + 2} << 32, kPairStride);
    for (std::int32_t octet = 0; octet < octet_count; ++octet, ++reach) {
      if (owned.empty()) continue;
      for (std::size_t pair = 0; pair < reach->begin.size(); ++pair, first.Next(), last.Next()) {
        const std::int32_t begin = first.In(owned.x_begin, owned.x_end), end = last.In(owned.x_begin, owned.x_end);
        // A pair beside the owned pixels ends where it begins, also within a segment that others share.
        reach->begin[pair] = std::uint16_t((begin - bounds.x_begin + (begin < owned.x_end ? 0 : kSegment - 1)) / kSegment);
        reach->end[pair] = std::uint16_t((end - bounds.x_begin + (end > owned.x_begin ? kSegment - 1 : 0)) / kSegment);
      }
      reach->whole = reach->Of(0xFF);
    }
  }
  FindReachOfCells();
}

void SplatPass::FindReachOfCells() {
  cells_reached.resize(reached.size() / kCellOctets);
  for (std::size_t cell = 0; cell < cells_reached.size(); ++cell) {
    const OctetReach* const octets = &reached[cell * kCellOctets];
    const std::int32_t from = octets[0].begin.front(), to = octets[kCellOctets - 1].end.back();
    if (to - from > kWordSegments) return cells_reached.clear();
    if (from < to) cells_reached[cell] = MakeSpan(from, to);
  }
}

}  // namespace slabstream
