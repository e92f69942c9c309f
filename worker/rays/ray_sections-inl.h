// Sections of the rays of a packet, in an even grid, with bounds of their samples. Included once for each instruction set, hence the
// unusual include guard.
#include <algorithm>
#include <cmath>
#include <limits>
#include <type_traits>

#include "worker/rays/project.h"
#include "worker/rays/ray_packet-inl.h"

#if defined(SLABSTREAM_WORKER_RAYS_RAY_SECTIONS_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef SLABSTREAM_WORKER_RAYS_RAY_SECTIONS_INL_H_
#undef SLABSTREAM_WORKER_RAYS_RAY_SECTIONS_INL_H_
#else
#define SLABSTREAM_WORKER_RAYS_RAY_SECTIONS_INL_H_
#endif

HWY_BEFORE_NAMESPACE();
namespace slabstream::HWY_NAMESPACE {

HWY_INLINE float LeastOf(Floats v) { return hn::GetLane(hn::MinOfLanes(FloatTag(), v)); }
HWY_INLINE float LargestOf(Floats v) { return hn::GetLane(hn::MaxOfLanes(FloatTag(), v)); }

// Sections of the rays of a packet, one after the other, and bounds of what any of the rays finds there.
struct Sections {
  static constexpr int kMost = 256;

  float length = 1;  // of each, in samples
  int count = 0;
  int first = 0;  // the section with the largest bound
  HWY_ALIGN float bounds[kMost];
};

// The box around a packet's samples from a common one on: its corners there, and how far they move with each sample.
struct PacketExtent {
  float low[3], high[3], low_move[3], high_move[3];
};
HWY_INLINE PacketExtent ExtentOf(const RayPacket& packet, float k, float margin) {
  PacketExtent extent;
  for (std::size_t i = 0; i < 3; ++i) {
    const auto at = PositionOf(packet, i, Set(k));
    extent.low[i] = LeastOf(at) - margin;
    extent.high[i] = LargestOf(at) + margin;
    extent.low_move[i] = LeastOf(packet.move[i]);
    extent.high_move[i] = LargestOf(packet.move[i]);
  }
  return extent;
}

// How many samples of a packet with `samples` lie in a cube of `side` voxels, wherever it begins; less than 1: it is too wide.
HWY_INLINE float SamplesWithin(const PacketExtent& extent, float samples, float side) {
  float within = samples;
  for (std::size_t i = 0; i < 3; ++i) {
    const float width = extent.high[i] - extent.low[i] + samples * (extent.high_move[i] - extent.low_move[i]);
    const float move = std::max({-extent.low_move[i], extent.high_move[i], 1e-9F});
    within = std::min(within, (side - width) / move + 1);
  }
  return std::floor(within);
}

// Divides the samples [begin, end) of a packet, or the first of them, into sections. Each is bounded by a window of cells or of blocks that
// holds all its samples, or by the bound for all samples.
HWY_INLINE void FindSections(const ProjectWork& work, const RayPacket& packet, float begin, float end, Sections& sections) {
  constexpr float kFew = 2;  // samples: sections of cells that are so short are not worth their bounds
  const FloatTag df;
  const IntTag di;
  const RayBox& box = *work.box;
  const SampleBounds& bounds = *work.bounds;
  const PacketExtent extent = ExtentOf(packet, begin, kPlaceMargin);
  sections.length = SamplesWithin(extent, end - begin, kWindowStep * kCellSide);
  if (sections.length < kFew) sections.length = std::max(SamplesWithin(extent, end - begin, kWindowStep * kBlockSide), kFew);
  sections.count = int(std::min(std::ceil((end - begin) / sections.length), float(Sections::kMost)));
  // One section a lane: the places of its corners.
  RayPacket low, high;
  for (std::size_t i = 0; i < 3; ++i) {
    const float ahead = sections.length - 1;
    low.first[i] = Set(extent.low[i] + ahead * std::min(extent.low_move[i], 0.0F));
    low.move[i] = Set(extent.low_move[i]);
    high.first[i] = Set(extent.high[i] + ahead * std::max(extent.high_move[i], 0.0F));
    high.move[i] = Set(extent.high_move[i]);
  }
  auto most = Set(std::numeric_limits<float>::lowest()), first = hn::Zero(df);
  for (int number = 0; number < sections.count; number += int(kLanes)) {
    const auto section = hn::ConvertTo(df, hn::Iota(di, number));
    const auto from = hn::Mul(section, Set(sections.length));
    SamplePlace least = PlaceSample(low, box, from), last = PlaceSample(high, box, from);
    for (std::size_t i = 0; i < 3; ++i) {
      const auto end_of_cells = SetInt(box.cells[int(i)] * kCellSide - 1);
      least.voxel[i] = hn::Min(hn::Max(least.voxel[i], hn::Zero(di)), end_of_cells);
      last.voxel[i] = hn::Min(hn::Max(last.voxel[i], hn::Zero(di)), end_of_cells);
    }
    const auto in_window_of = [&](auto shift) HWY_ATTR {
      auto farthest = hn::Zero(di);
      for (std::size_t i = 0; i < 3; ++i) {
        farthest = hn::Max(farthest, hn::Sub(hn::ShiftRight<shift()>(last.voxel[i]), hn::ShiftRight<shift()>(least.voxel[i])));
      }
      return hn::RebindMask(df, hn::Lt(farthest, SetInt(kWindowStep + 1)));
    };
    const auto in_cells = in_window_of(std::integral_constant<int, kCellShift>());
    auto bound = hn::GatherIndex(df, bounds.cell_windows.data(), CellOf<kCellShift>(least, box.cells, in_cells));
    if (!hn::AllTrue(df, in_cells)) {
      const auto in_blocks = in_window_of(std::integral_constant<int, kBlockShift>());
      const auto of_blocks = hn::GatherIndex(df, bounds.block_windows.data(), CellOf<kBlockShift>(least, bounds.block_counts, in_blocks));
      bound = hn::IfThenElse(in_cells, bound, hn::IfThenElse(in_blocks, of_blocks, Set(bounds.most)));
    }
    hn::Store(bound, df, sections.bounds + number);
    const auto larger = hn::And(hn::Gt(bound, most), hn::Lt(section, Set(float(sections.count))));
    most = hn::IfThenElse(larger, bound, most);
    first = hn::IfThenElse(larger, section, first);
  }
  sections.first = int(LeastOf(hn::IfThenElse(hn::Eq(most, hn::MaxOfLanes(df, most)), first, Set(float(sections.count)))));
}

}  // namespace slabstream::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
