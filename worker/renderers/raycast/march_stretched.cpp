#include "worker/renderers/raycast/march_stretched.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "worker/renderers/raycast/march_stretched.cpp"
#include <hwy/foreach_target.h>
// Highway wants this order.
#include <hwy/highway.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <type_traits>

#include "worker/light/exponential-inl.h"
#include "worker/rays/ray_sums-inl.h"
#include "worker/rays/stretched_place-inl.h"
#include "worker/renderers/raycast/gradient_bricks-inl.h"
#include "worker/renderers/raycast/surface_walk-inl.h"

HWY_BEFORE_NAMESPACE();
namespace slabstream::HWY_NAMESPACE {

// Units at which the rays enter and leave low <= p < high.
struct Passage {
  Floats enter, leave;
};
HWY_INLINE Passage PassageThrough(const RayPacket& packet, const LeapScales& scales, const Float3& low, const Float3& high) {
  Passage passage = {Set(-kRayEnd), Set(kRayEnd)};
  for (std::size_t i = 0; i < 3; ++i) {
    const auto a = hn::Mul(hn::Sub(Set(low[i]), packet.first[i]), scales.inverse[i]);
    const auto b = hn::Mul(hn::Sub(Set(high[i]), packet.first[i]), scales.inverse[i]);
    passage.enter = hn::Max(passage.enter, hn::Min(a, b));
    passage.leave = hn::Min(passage.leave, hn::Max(a, b));
  }
  return passage;
}

// The length of the blocks that begin there.
HWY_INLINE Floats LengthOfBlocks(const StretchedSteps& steps, const RayPacket& packet, const LeapScales& scales, Floats begin) {
  const FloatTag df;
  const IntTag di;
  auto longest = Set(steps.most);
  for (std::size_t i = 0; i < 3; ++i) {
    const StretchTable& table = steps.tables.axes[i];
    auto stride = Set(1);
    if (!table.even()) stride = hn::GatherIndex(df, table.strides.data(), BinAt(table, PositionOf(packet, i, begin)));
    const auto units = hn::Mul(hn::Abs(scales.inverse[i]), Set(1 / steps.samples_per_voxel));
    longest = hn::Min(longest, hn::Mul(stride, units));
  }
  const auto power = hn::BitCast(df, hn::And(hn::BitCast(di, longest), SetInt(0x7F800000)));  // without its mantissa
  const auto whole = Truncated(begin);
  const auto alignment = hn::ConvertTo(df, hn::And(whole, hn::Sub(hn::Zero(di), whole)));
  const auto aligned = hn::IfThenElse(hn::Eq(begin, hn::Zero(df)), Set(steps.most), alignment);
  return hn::Min(hn::Max(power, Set(2)), aligned);
}

// The scale of GradientAt.
struct StretchedDifferences {
  Floats factors[3][2];

  HWY_INLINE Floats operator()(std::size_t axis, std::size_t side, Floats difference) const {
    return hn::Mul(difference, factors[axis][side]);
  }
};
HWY_INLINE StretchedDifferences DifferencesAt(const RayBox& box, const SamplePlace& place) {
  const FloatTag df;
  StretchedDifferences differences;
  for (std::size_t i = 0; i < 3; ++i) {
    auto& [lower, upper] = differences.factors[i];
    lower = upper = Set(1);
    const StretchTable& table = box.stretch->axes[i];
    if (table.even()) continue;
    const auto knot = hn::Add(place.voxel[i], SetInt(box.origin[int(i)] + 1));
    lower = hn::GatherIndex(df, table.slopes.data(), knot);
    upper = hn::GatherIndex(df, table.slopes.data() + 1, knot);
  }
  return differences;
}

// Adds samples of the box, each of which stands for `length` least steps; `k`: in units.
template <class T>
HWY_INLINE std::uint64_t AddSamples(const MarchWork& work, const PacketPart& part, const SamplePlace& place, Floats k, Floats length,
                                    Mask sampled, Sums& sums) {
  const FloatTag df;
  const RayLook& look = *work.look;
  const Neighbours<T> neighbours = LoadNeighbours<T>(*work.box, place, sampled);
  const auto value = Interpolate(neighbours, place);
  LaneNumbers entry;
  if constexpr (std::is_same_v<T, float>) {
    const auto finite = hn::Le(hn::Abs(value), Set(std::numeric_limits<float>::max()));
    sampled = hn::And(sampled, finite);
    entry.Set(EntryOf(look, value, finite));
  } else {
    entry.Set(EntryOf(look, value));
  }
  Entries entries = EntriesAt(look.entries.data(), entry);
  auto visible = hn::And(sampled, hn::Gt(entries.of[3], hn::Zero(df)));
  if (hn::AllFalse(df, visible)) return 0;
  Gradient gradient = {Set(0), Set(0), Set(0)};
  const auto differences = [&]() HWY_ATTR { return DifferencesAt(*work.box, place); };
  if (look.by_gradient() || (look.phong && !work.smooth)) gradient = GradientAmong<false>(neighbours, place, differences());
  if (look.regions != nullptr) {
    LaneNumbers region;
    region.Set(RegionOf(look, hn::IfThenElseZero(sampled, value), gradient));
    entries = EntriesAt(look.regions->entries.data(), region);
  }
  const auto opacity = look.gradient_factors.empty()
                           ? hn::Sub(Set(1), ExpOfMinus(hn::Mul(entries.of[3], length)))
                           : OpacityByGradient(look, entries.of[3], gradient, hn::Mul(Set(look.step_exponent), length));
  visible = hn::And(visible, hn::Gt(opacity, hn::Zero(df)));
  Light light = {Set(1), hn::Zero(df)};
  if (look.phong) {
    if (work.smooth) gradient = SmoothGradientAt<T>(*work.box, place, sampled, differences());
    light = LightOf(look, Choose(hn::Lt(k, part.face_end), {part.face[0], part.face[1], part.face[2]}, gradient));
  }
  sums.AddChannels(visible, opacity, [&](std::size_t channel) HWY_ATTR { return Sums::Lit(entries.of[channel], light); });
  return hn::CountTrue(df, visible);
}

// Adds the crossings of rays with isosurfaces up to `before`, in units. Returns how many.
template <class T>
HWY_NOINLINE std::uint64_t AddSurfaces(const MarchWork& work, const StretchedSteps& steps, Floats before, SurfaceWalk<T, true>& walk,
                                       Sums& sums) {
  const RayLook& look = *work.look;
  return AddCrossingsUpTo(before, 16 * steps.most, work.termination, walk, sums, [&](Mask rays, const Crossing& crossing) HWY_ATTR {
    const FloatTag df;
    const SamplePlace place = crossing.Place(work.box->origin);
    Light light = {Set(1), hn::Zero(df)};
    if (look.phong) {
      light = LightOf(look, GradientAt<T>(*work.box, place, rays, work.smooth, DifferencesAt(*work.box, place)));
    }
    const auto entry = hn::ShiftLeft<2>(hn::ConvertTo(IntTag(), crossing.surface));
    const float* const colors = look.surface_looks.data();
    sums.Add(rays, hn::GatherIndex(df, colors + 3, entry), colors, entry, light);
  });
}

// The samples of a part of the rays. Returns how many were shaded.
template <class T>
HWY_NOINLINE std::uint64_t MarchPart(const MarchWork& work, const StretchedSteps& steps, const RayPacket& packet, const PacketPart& part,
                                     Sums& gathered) {
  const FloatTag df;
  const RayBox& box = *work.box;
  const auto zero = hn::Zero(df), one = Set(1), most = Set(steps.most);
  const auto opaque = Set(1 - work.termination);
  const auto block_at = [&](Floats k) HWY_ATTR { return hn::Mul(hn::Floor(hn::Div(k, most)), most); };
  const LeapScales scales = LeapScalesOf(packet);
  const Float3 low = {-0.5F, -0.5F, -0.5F};
  const Passage volume = PassageThrough(packet, scales, low, work.rays->volume_end),
                own = PassageThrough(packet, scales, box.low, box.high);
  const auto enter = hn::Max(hn::Max(volume.enter, part.enter), zero), leave = hn::Min(volume.leave, part.leave);
  // Positions as computed decide whose a sample is. Ends of the box are rounded, so that a unit more is looked at.
  const auto first = hn::Sub(hn::Max(hn::Max(own.enter, enter), Set(float(box.reach.begin))), one);
  const auto end = hn::Add(hn::Min(hn::Min(own.leave, leave), Set(float(box.reach.end))), one);
  auto alive = hn::And(hn::And(packet.valid, hn::Le(first, end)), hn::And(hn::Lt(enter, leave), hn::Lt(gathered.alpha, opaque)));
  auto block = hn::IfThenElseZero(alive, block_at(first));
  const Ints octant_start = OctantStart(*work.to_samples, packet);
  Sums sums = gathered;
  std::uint64_t shaded = 0;
  const bool has_surfaces = work.to_surfaces != nullptr;
  SurfaceWalk<T, true> surfaces(work, packet, has_surfaces ? OctantStart(*work.to_surfaces, packet) : hn::Zero(IntTag()));
  if (has_surfaces) surfaces.Start(part);
  if (!work.look->volume_shows) alive = hn::Lt(one, zero);
  while (!hn::AllFalse(df, alive)) {
    auto next = hn::Add(block, LengthOfBlocks(steps, packet, scales, block));
    const auto begins = hn::Max(block, enter), ends = hn::Min(next, leave);
    // Whole numbers where they can be: they are exact.
    const auto middle = hn::Mul(Set(0.5F), hn::Add(begins, ends)), whole = hn::Round(middle);
    const auto k = hn::IfThenElse(hn::And(hn::Ge(whole, begins), hn::Le(whole, ends)), whole, middle);
    const SamplePlace place = PlaceStretched(packet, box, k);
    auto sampled = hn::And(alive, hn::Lt(begins, ends));
    for (std::size_t i = 0; i < 3; ++i) {
      const auto& p = place.position[i];
      sampled = hn::And(sampled, hn::And(hn::Ge(p, Set(box.low[i])), hn::Lt(p, Set(box.high[i]))));
    }
    if (!hn::AllFalse(df, sampled)) {
      const auto distance = hn::ConvertTo(df, DistanceAt(*work.to_samples, octant_start, CellOf<kCellShift>(place, box.cells, sampled)));
      const auto empty = hn::And(sampled, hn::Gt(distance, zero));
      if (!hn::AllFalse(df, empty)) {
        const auto behind =
            block_at(hn::Add(k, StretchedStepsWithin(box, scales, place, SetInt(kCellSide), hn::Mul(distance, Set(kCellSide)))));
        next = hn::IfThenElse(empty, hn::Max(next, behind), next);
      }
      sampled = hn::AndNot(empty, sampled);
      const auto length = hn::Mul(Set(0.5F), hn::Sub(ends, begins));
      if (!hn::AllFalse(df, sampled)) {
        if (has_surfaces) shaded += AddSurfaces<T>(work, steps, k, surfaces, sums);
        sampled = hn::And(sampled, hn::Lt(sums.alpha, opaque));
        shaded += AddSamples<T>(work, part, place, k, length, sampled, sums);
      }
    }
    block = hn::IfThenElse(alive, next, block);
    alive = hn::And(alive, hn::And(hn::Lt(block, end), hn::Lt(sums.alpha, opaque)));
  }
  if (has_surfaces) shaded += AddSurfaces<T>(work, steps, Set(kRayEnd), surfaces, sums);
  gathered = sums;
  return shaded;
}

template <class T>
HWY_NOINLINE std::uint64_t MarchPackets(const MarchWork& work, const StretchedSteps& steps, const PixelBounds& tile,
                                        float* HWY_RESTRICT rgba, std::size_t floats_a_row) {
  std::uint64_t shaded = 0;
  const bool has_shapes = work.shapes != nullptr && !work.shapes->empty();
  PacketShapes shapes;
  ForEachPacket(*work.rays, tile, rgba, floats_a_row,
                [&](const RayPacket& packet, float* HWY_RESTRICT pixels, std::int32_t x, std::int32_t y) HWY_ATTR {
                  const bool cut = has_shapes && LoadShapes(*work.shapes, *work.order, *work.rays, *work.box, tile, x, y, shapes);
                  const auto zero = hn::Zero(FloatTag());
                  Sums sums = {zero, zero, zero, zero};
                  PacketPart parts[2];
                  PartsOf(work.rays->clip, packet, parts);
                  std::uint64_t found = 0;
                  MarchAmongFragments(cut ? &shapes : nullptr, parts, Set(1 - work.termination), sums,
                                      [&](const PacketPart& part) HWY_ATTR { found += MarchPart<T>(work, steps, packet, part, sums); });
                  shaded += found;
                  if (found == 0 && !(cut && shapes.any_owned)) return false;
                  hn::StoreInterleaved4(sums.red, sums.green, sums.blue, sums.alpha, FloatTag(), pixels);
                  return true;
                });
  return shaded;
}

std::uint64_t MarchStretchedAny(const MarchWork& work, const StretchedSteps& steps, const PixelBounds& tile, float* rgba,
                                std::size_t floats_a_row) {
  switch (work.box->type) {
    case ScalarType::kUint8: return MarchPackets<std::uint8_t>(work, steps, tile, rgba, floats_a_row);
    case ScalarType::kUint16: return MarchPackets<std::uint16_t>(work, steps, tile, rgba, floats_a_row);
    default: break;
  }
  return MarchPackets<float>(work, steps, tile, rgba, floats_a_row);
}

}  // namespace slabstream::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace slabstream {
HWY_EXPORT(MarchStretchedAny);

std::uint64_t MarchStretchedTile(const MarchWork& work, const StretchedSteps& steps, const PixelBounds& tile, float* rgba,
                                 std::size_t floats_a_row) {
  return HWY_DYNAMIC_DISPATCH(MarchStretchedAny)(work, steps, tile, rgba, floats_a_row);
}

StretchedSteps::StretchedSteps(const FrameSetup& setup, double per_voxel)
    : tables(setup.description.geometry.stretch),
      rays(MakeViewRays(setup.camera, setup.description.geometry, per_voxel, setup.clip)),
      samples_per_voxel(float(per_voxel)) {
  // Unit 2 k + 1 is where step k was: in the middle of a block of two units.
  rays.step *= 0.5F;
  rays.start_distance -= rays.step;
  for (std::size_t i = 0; i < 3; ++i) rays.start[i] -= rays.step * rays.forward[i];
  rays.sample_count = 2 * rays.sample_count + 2;
  constexpr double kMost = 1024;
  const auto [x, y, z] = tables.longest * setup.description.geometry.spacing;
  const double longest = std::max({x, y, z}) / per_voxel / double(rays.step);
  most = float(std::exp2(std::floor(std::log2(std::clamp(longest, 2.0, kMost)))));
}

double StretchedSteps::StepsPerVoxel(const VolumeGeometry& geometry, double samples_per_voxel) {
  return Least(geometry.spacing) / StepOf(geometry, samples_per_voxel);
}

void MakeExtinctions(RayLook& look) {
  if (!look.gradient_factors.empty()) return;
  for (std::size_t i = 3; i < look.entries.size(); i += 4) {
    float& entry = look.entries[i];
    entry = float(entry < 1 ? -std::log1p(-double(entry)) : kOpaqueExtinction);
  }
}

}  // namespace slabstream
#endif
