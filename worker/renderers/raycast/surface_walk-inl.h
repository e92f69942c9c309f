// SurfaceWalk: where the rays of a packet cross isosurfaces in a box, one crossing after the other along each ray. Included once for each
// instruction set, hence the unusual include guard.
//
// Between eight neighbouring voxel centres (here a cell) the trilinear interpolant along a ray is a cubic polynomial (Parker et al. 1998).
// Its extrema divide the ray's way through the cell into stretches where it is monotonic. A stretch holds one crossing if its ends lie on
// either side of the isovalue (Marmitt et al. 2004), and Newton's method finds it. So no crossing is missed, however close two of them are.
//
// A crossing depends on its ray and on its cell's voxels alone, and belongs to the box that owns its position: boxes agree on crossings.
// Two cells agree on the value at the face between them, bit for bit, so that a surface has no holes there.
//
// In a rectilinear grid (kStretched) fractions are linear along a ray within a cell, too. Cells are numbers of voxels, planes lie where the
// voxels do.
//
// Positions are within 2^-20 times the side of the volume in voxels, or 1e-4 voxel if that is more.
#include <hwy/highway.h>

#include <cmath>
#include <limits>
#include <type_traits>
#include <vector>

#include "worker/rays/stretched_place-inl.h"
#include "worker/renderers/raycast/march.h"

#if defined(SLABSTREAM_WORKER_RENDERERS_RAYCAST_SURFACE_WALK_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef SLABSTREAM_WORKER_RENDERERS_RAYCAST_SURFACE_WALK_INL_H_
#undef SLABSTREAM_WORKER_RENDERERS_RAYCAST_SURFACE_WALK_INL_H_
#else
#define SLABSTREAM_WORKER_RENDERERS_RAYCAST_SURFACE_WALK_INL_H_
#endif

HWY_BEFORE_NAMESPACE();
namespace slabstream {
namespace HWY_NAMESPACE {

// Where the distances of the octants in which the rays move begin.
HWY_INLINE Ints OctantStart(const EmptyDistances& distances, const RayPacket& packet) {
  const IntTag di;
  auto octant = hn::Zero(di);
  for (std::size_t i = 0; i < 3; ++i) {
    const auto down = hn::Lt(packet.move[i], hn::Zero(FloatTag()));
    octant = hn::Add(octant, hn::IfThenElseZero(hn::RebindMask(di, down), SetInt(1 << i)));
  }
  return hn::GatherIndex(di, distances.starts().data(), octant);
}
// EmptyDistances::data() of cells, which lie at `cell` from there.
HWY_INLINE Ints EmptyAt(const EmptyDistances& distances, Ints octant_start, Ints cell) {
  const auto two =
      hn::GatherOffset(IntTag(), reinterpret_cast<const std::int32_t*>(distances.data()), hn::ShiftLeft<1>(hn::Add(octant_start, cell)));
  return hn::And(two, SetInt(0xFFFF));
}
HWY_INLINE Ints DistanceAt(const EmptyDistances& distances, Ints octant_start, Ints cell) {
  return hn::ShiftRight<8>(EmptyAt(distances, octant_start, cell));
}

// f(x) along a ray, x from 0 where it enters a cell to 1 where it leaves.
struct Cubic {
  Floats c0, c1, c2, c3;

  HWY_INLINE Floats At(Floats x) const { return hn::Add(hn::Mul(hn::Add(hn::Mul(hn::Add(hn::Mul(c3, x), c2), x), c1), x), c0); }
  HWY_INLINE Floats SlopeAt(Floats x) const { return hn::Add(hn::Mul(hn::Add(hn::Mul(hn::Mul(Set(3), c3), x), hn::Add(c2, c2)), x), c1); }
};

// Ascending points of [0, 1] between which the polynomial is monotonic; 0 or 1 if there are fewer than two.
struct Extrema {
  Floats first, second;
};
HWY_INLINE Extrema ExtremaOf(const Cubic& f) {
  // Roots of 3 c3 x^2 + 2 c2 x + c1, without cancellation.
  const auto zero = hn::Zero(FloatTag());
  const auto square = hn::Sub(hn::Mul(f.c2, f.c2), hn::Mul(Set(3), hn::Mul(f.c3, f.c1)));
  const auto root = hn::Sqrt(hn::Max(square, zero));
  const auto q = hn::Neg(hn::Add(f.c2, hn::CopySign(root, f.c2)));
  const auto limited = [&](Floats numerator, Floats divisor) HWY_ATTR {
    const auto x = hn::Div(numerator, hn::IfThenElse(hn::Eq(divisor, zero), Set(1), divisor));
    return hn::IfThenElseZero(hn::And(hn::Gt(square, zero), hn::Ne(divisor, zero)), hn::Min(hn::Max(x, zero), Set(1)));
  };
  const auto a = limited(q, hn::Mul(Set(3), f.c3)), b = limited(f.c1, q);
  return {hn::Min(a, b), hn::Max(a, b)};
}

// Where f changes its sign between `low` and `high`, of rays on which it does so once there; `low_side`: f(low) >= 0. Newton's method,
// which halves the interval instead where it would leave it. Each ray ends by itself: what it finds does not depend on the others.
HWY_INLINE Floats RootBetween(const Cubic& f, Mask rays, Mask low_side, Floats low, Floats high) {
  constexpr int kMostSteps = 24;
  constexpr float kNear = 1e-5F;
  const FloatTag df;
  const auto at_low = f.At(low);
  const auto middle = [&]() HWY_ATTR { return hn::Mul(Set(0.5F), hn::Add(low, high)); };
  auto x = hn::Sub(low, hn::Div(hn::Mul(at_low, hn::Sub(high, low)), hn::Sub(f.At(high), at_low)));  // the chord's
  x = hn::IfThenElse(hn::And(hn::Ge(x, low), hn::Le(x, high)), x, middle());
  for (int step = 0; step < kMostSteps; ++step) {
    const auto value = f.At(x);
    const auto behind = hn::Xor(hn::Ge(value, hn::Zero(df)), low_side);
    low = hn::IfThenElse(behind, low, x);
    high = hn::IfThenElse(behind, x, high);
    auto next = hn::Sub(x, hn::Div(value, f.SlopeAt(x)));
    next = hn::IfThenElse(hn::And(hn::Ge(next, low), hn::Le(next, high)), next, middle());
    const auto far = hn::And(rays, hn::Gt(hn::Abs(hn::Sub(next, x)), Set(kNear)));
    x = hn::IfThenElse(rays, next, x);
    rays = far;
    if (hn::AllFalse(df, rays)) break;
  }
  return x;
}

// Crossings of rays with isosurfaces.
struct Crossing {
  Floats at;       // samples; kRayEnd: there is none
  Floats surface;  // number
  Ints voxel[3];   // as SamplePlace has it, and so are
  Floats fraction[3];

  HWY_INLINE void Become(Mask rays, const Crossing& other) {
    at = hn::IfThenElse(rays, other.at, at);
    surface = hn::IfThenElse(rays, other.surface, surface);
    for (std::size_t i = 0; i < 3; ++i) {
      voxel[i] = hn::IfThenElse(hn::RebindMask(IntTag(), rays), other.voxel[i], voxel[i]);
      fraction[i] = hn::IfThenElse(rays, other.fraction[i], fraction[i]);
    }
  }
  // `origin`: RayBox::origin. Positions count voxels.
  HWY_INLINE SamplePlace Place(const Index3& origin) const {
    SamplePlace place;
    for (std::size_t i = 0; i < 3; ++i) {
      place.voxel[i] = voxel[i];
      place.fraction[i] = fraction[i];
      place.position[i] = hn::Add(hn::ConvertTo(FloatTag(), hn::Add(voxel[i], SetInt(origin[int(i)]))), fraction[i]);
    }
    return place;
  }
};

// A crossing of each ray, in memory.
struct KeptCrossing {
  alignas(64) float at[kLanes], surface[kLanes], fraction[3][kLanes];
  alignas(64) std::int32_t voxel[3][kLanes];

  HWY_INLINE Crossing Load() const {
    const FloatTag df;
    const IntTag di;
    return {hn::Load(df, at),
            hn::Load(df, surface),
            {hn::Load(di, voxel[0]), hn::Load(di, voxel[1]), hn::Load(di, voxel[2])},
            {hn::Load(df, fraction[0]), hn::Load(df, fraction[1]), hn::Load(df, fraction[2])}};
  }
  HWY_INLINE void Store(const Crossing& crossing) {
    hn::Store(crossing.at, FloatTag(), at);
    hn::Store(crossing.surface, FloatTag(), surface);
    for (std::size_t i = 0; i < 3; ++i) {
      hn::Store(crossing.voxel[i], IntTag(), voxel[i]);
      hn::Store(crossing.fraction[i], FloatTag(), fraction[i]);
    }
  }
  HWY_INLINE void SetLane(std::size_t lane, const KeptCrossing& other, std::size_t from) {
    at[lane] = other.at[from];
    surface[lane] = other.surface[from];
    for (std::size_t i = 0; i < 3; ++i) {
      voxel[i][lane] = other.voxel[i][from];
      fraction[i][lane] = other.fraction[i][from];
    }
  }
};

// Finds crossings of all rays of a packet together, some ahead of where they are asked for, and keeps them. The rays walk first and list
// the cells that hold a surface. Then the cells are searched, one to a lane, whichever rays they are of: so lanes are full, although few
// rays are in such a cell at a time. Where rays end at their first crossing, most listed cells would lie behind it. There, rays wait in
// such a cell until more of them wait than move.
template <class T, bool kStretched = false>
class SurfaceWalk {
 public:
  // `octant_start`: OctantStart in work.to_surfaces.
  HWY_INLINE SurfaceWalk(const MarchWork& work, const RayPacket& packet, Ints octant_start)
      : work_(work), box_(*work.box), packet_(packet), octant_start_(octant_start) {}

  // Stands where each ray enters `part`, or farther on: there are no crossings before `begin`, in samples.
  HWY_NOINLINE void Start(const PacketPart& part, float begin = 0) {
    const FloatTag df;
    const auto zero = hn::Zero(df), far = Set(kRayEnd);
    from_ = hn::Max(part.enter, Set(begin));
    to_ = part.leave;
    auto enter = hn::Sub(from_, Set(kPlaceMargin)), leave = to_;  // in samples the same margin covers rounding
    for (std::size_t i = 0; i < 3; ++i) {
      const auto low = Set(box_.low[i]), high = Set(box_.high[i]), margin = Set(kPlaceMargin);
      const auto first = packet_.first[i], move = packet_.move[i];
      still_[i] = IsStill(move);
      inverse_[i] = hn::Div(Set(1), hn::IfThenElse(still_[i], Set(1), move));
      const auto a = Passes(i, hn::Sub(low, margin)), b = Passes(i, hn::Add(high, margin));
      const auto beside = hn::Or(hn::Lt(first, low), hn::Ge(first, high));
      enter = hn::Max(enter, hn::IfThenElse(still_[i], hn::IfThenElse(beside, far, hn::Neg(far)), hn::Min(a, b)));
      leave = hn::Min(leave, hn::IfThenElse(still_[i], far, hn::Max(a, b)));
      lowest_[i] = CellAt(i, low);
      highest_[i] = kStretched ? CellAt(i, high) : Set(std::ceil(box_.high[i]) - 1);
    }
    walking_ = hn::And(packet_.valid, hn::Le(enter, leave));
    enter = hn::IfThenElseZero(walking_, enter);
    for (std::size_t i = 0; i < 3; ++i) {
      cell_[i] = hn::Min(hn::Max(CellAt(i, PositionOf(packet_, i, enter)), lowest_[i]), highest_[i]);
    }
    last_ = hn::Neg(far);
    surface_ = zero;
    hn::Store(Set(1), df, transmitted_);
    hn::Store(zero, df, kept_);
    const auto none = hn::Zero(IntTag());
    for (KeptCrossing& crossing : crossings_) crossing.Store({far, zero, {none, none, none}, {zero, zero, zero}});
    waits_ = false;
    const std::size_t surfaces = work_.look->isovalues.size();
    for (std::size_t i = 0; i < surfaces; ++i) waits_ = waits_ || 1 - work_.look->surface_looks[4 * i + 3] <= work_.termination;
    known_to_ = hn::IfThenElse(walking_, hn::Neg(far), far);
  }

  // The nearest crossings that are kept.
  HWY_INLINE Crossing nearest() const {
    Crossing crossing = crossings_[0].Load();
    crossing.at = hn::IfThenElse(hn::Gt(Kept(), hn::Zero(FloatTag())), crossing.at, Set(kRayEnd));
    return crossing;
  }
  // Forgets those of these rays.
  HWY_INLINE void Leave(Mask rays) {
    const auto most = std::size_t(hn::GetLane(hn::MaxOfLanes(FloatTag(), Kept())));
    for (std::size_t i = 1; i < most; ++i) {
      Crossing crossing = crossings_[i - 1].Load();
      crossing.Become(rays, crossings_[i].Load());
      crossings_[i - 1].Store(crossing);
    }
    hn::Store(hn::Sub(Kept(), hn::IfThenElseZero(rays, Set(1))), FloatTag(), kept_);
  }
  // Rays of which no crossing is kept, but one up to `before` may be found.
  HWY_INLINE Mask MayCross(Floats before) const { return hn::And(hn::Eq(Kept(), hn::Zero(FloatTag())), hn::Le(known_to_, before)); }

  // Finds the crossings of `rays` up to `to`, and perhaps some beyond. A ray that has as many as are kept stops there.
  HWY_NOINLINE void Find(Mask rays, Floats to) {
    const FloatTag df;
    const auto going_on = [&]() HWY_ATTR {
      return hn::And(hn::And(rays, walking_), hn::And(hn::Le(known_to_, to), hn::Lt(Kept(), Set(float(kMostKept)))));
    };
    for (auto moving = going_on(); !hn::AllFalse(df, moving); moving = going_on()) {
      if (waits_) {
        auto waiting = hn::Lt(Set(1), hn::Zero(df));
        while (!hn::AllFalse(df, moving) && hn::CountTrue(df, moving) >= hn::CountTrue(df, waiting)) {
          Advance(moving, [&](Mask holds) HWY_ATTR {
            waiting = hn::Or(waiting, holds);
            return hn::AndNot(holds, moving);
          });
          moving = hn::AndNot(waiting, going_on());
        }
        if (!hn::AllFalse(df, waiting)) CrossCells(waiting);
      } else {
        std::size_t count = 0;
        while (!hn::AllFalse(df, moving) && count <= kMostCells - kLanes) {
          Advance(moving, [&](Mask holds) HWY_ATTR {
            if (!hn::AllFalse(df, holds)) count = cells_.Append(count, holds, cell_, last_, surface_);
            return moving;
          });
          moving = hn::And(moving, going_on());
        }
        if (count > 0) CrossListed(count);
      }
    }
  }

 private:
  // The way of the rays through their cells, x from 0 where they enter to 1 where they leave.
  struct Way {
    Floats enter, leave;         // samples
    Floats begin[3], change[3];  // fractions at x = 0, and to x = 1
    Floats end[3];

    HWY_INLINE Floats FractionAt(std::size_t axis, Floats x) const { return hn::Add(begin[axis], hn::Mul(x, change[axis])); }
  };
  // Rays enter and leave exactly on a face of the cell.
  HWY_INLINE Way WayThroughCells() const {
    const auto zero = hn::Zero(FloatTag()), one = Set(1);
    Way way;
    Floats in[3], out[3];
    way.enter = Set(-kRayEnd);
    way.leave = Set(kRayEnd);
    for (std::size_t i = 0; i < 3; ++i) {
      const auto a = PlaneAt(i, cell_[i]), b = PlaneAt(i, hn::Add(cell_[i], one));
      in[i] = hn::IfThenElse(still_[i], Set(-kRayEnd), hn::Min(a, b));
      out[i] = hn::IfThenElse(still_[i], Set(kRayEnd), hn::Max(a, b));
      way.enter = hn::Max(way.enter, in[i]);
      way.leave = hn::Min(way.leave, out[i]);
    }
    for (std::size_t i = 0; i < 3; ++i) {
      const auto fraction = [&](Floats at) HWY_ATTR { return hn::Min(hn::Max(FractionIn(i, PositionOf(packet_, i, at)), zero), one); };
      const auto backward = hn::Lt(packet_.move[i], zero);
      const auto near_face = hn::IfThenElseZero(backward, one), far_face = hn::Sub(one, near_face);
      way.begin[i] = hn::IfThenElse(hn::Eq(in[i], way.enter), near_face, fraction(way.enter));
      way.end[i] = hn::IfThenElse(hn::Eq(out[i], way.leave), far_face, fraction(way.leave));
      way.change[i] = hn::Sub(way.end[i], way.begin[i]);
    }
    return way;
  }

  // The interpolant where rays enter and leave their cells: two cells agree on it.
  struct Ends {
    Floats first, last;
  };
  static HWY_INLINE Ends InterpolateEnds(const Way& way, const Neighbours<T>& voxels) {
    const auto value_at = [&](const Floats(&at)[3]) HWY_ATTR {
      const Floats rest[3] = {hn::Sub(Set(1), at[0]), hn::Sub(Set(1), at[1]), hn::Sub(Set(1), at[2])};
      // Exact at both ends of t, unlike Lerp.
      const auto mix = [&](std::size_t i, Floats a, Floats b) HWY_ATTR { return hn::Add(hn::Mul(rest[i], a), hn::Mul(at[i], b)); };
      const auto row = [&](const SampleRow& pair) HWY_ATTR { return mix(0, pair.a, pair.b); };
      return mix(2, mix(1, row(voxels.inner[0][0]), row(voxels.inner[0][1])), mix(1, row(voxels.inner[1][0]), row(voxels.inner[1][1])));
    };
    return {value_at(way.begin), value_at(way.end)};
  }
  // The interpolant along the way: the product of its slopes along the axes, and its ends.
  static HWY_INLINE Cubic CubicAlong(const Way& way, const Neighbours<T>& voxels, const Ends& ends) {
    const auto& rows = voxels.inner;
    const auto along_x = [&](const SampleRow& row) HWY_ATTR { return hn::Sub(row.b, row.a); };
    const auto lowest = along_x(rows[0][0]);
    const auto xy = hn::Sub(along_x(rows[0][1]), lowest), xz = hn::Sub(along_x(rows[1][0]), lowest);
    const auto xyz = hn::Sub(hn::Sub(along_x(rows[1][1]), along_x(rows[1][0])), xy);
    const auto yz = hn::Sub(hn::Sub(rows[1][1].a, rows[1][0].a), hn::Sub(rows[0][1].a, rows[0][0].a));
    const auto [u, v, w] = way.change;
    const auto of = [&](Floats a, Floats b, Floats product, std::size_t other)
                        HWY_ATTR { return hn::Mul(hn::Mul(a, b), hn::Add(product, hn::Mul(xyz, way.begin[other]))); };
    const auto c3 = hn::Mul(hn::Mul(xyz, u), hn::Mul(v, w));
    const auto c2 = hn::Add(hn::Add(of(u, v, xy, 2), of(u, w, xz, 1)), of(v, w, yz, 0));
    return {ends.first, hn::Sub(hn::Sub(hn::Sub(ends.last, ends.first), c2), c3), c2, c3};
  }

  // The nearest crossing so far in the cells, and how many changes of sides there are.
  struct Nearest {
    Floats at, x, surface, changes;
  };
  static constexpr std::size_t kMostKept = 8, kMostCells = 128;

  // Cells of rays that hold a surface, those of a ray in its order, with last_ and surface_ there.
  struct Cells {
    float cell[3][kMostCells], last[kMostCells], surface[kMostCells];
    std::int32_t ray[kMostCells];

    // Returns how many there are then.
    HWY_INLINE std::size_t Append(std::size_t count, Mask rays, const Floats (&cells)[3], Floats lasts, Floats surfaces) {
      const FloatTag df;
      const IntTag di;
      for (std::size_t i = 0; i < 3; ++i) hn::StoreU(hn::Compress(cells[i], rays), df, cell[i] + count);
      hn::StoreU(hn::Compress(lasts, rays), df, last + count);
      hn::StoreU(hn::Compress(surfaces, rays), df, surface + count);
      hn::StoreU(hn::Compress(hn::Iota(di, 0), hn::RebindMask(di, rays)), di, ray + count);
      return count + hn::CountTrue(df, rays);
    }
  };

  HWY_INLINE Floats Kept() const { return hn::Load(FloatTag(), kept_); }
  static HWY_INLINE Mask IsStill(Floats move) { return hn::Lt(hn::Abs(move), Set(1e-9F)); }

  // Whether a crossing counts: it comes after the last one, within the clipped ray, and the box owns it.
  HWY_INLINE Mask Counts(const Way& way, Floats at, Floats x, Floats surface) const {
    auto counts = hn::And(hn::Ge(at, from_), hn::Le(at, to_));
    counts = hn::And(counts, hn::Or(hn::Gt(at, last_), hn::And(hn::Eq(at, last_), hn::Gt(surface, surface_))));
    for (std::size_t i = 0; i < 3; ++i) {
      const auto position = PositionIn(i, way.FractionAt(i, x));
      counts = hn::And(counts, hn::And(hn::Ge(position, Set(box_.low[i])), hn::Lt(position, Set(box_.high[i]))));
    }
    return counts;
  }

  // Looks for crossings of `rays` with a surface, stretch by stretch between the extrema of their cubic.
  HWY_INLINE void CrossSurface(const Way& way, const Cubic& cubic, const Ends& values, std::size_t surface, Mask rays,
                               Nearest& nearest) const {
    const FloatTag df;
    const auto zero = hn::Zero(df), one = Set(1), value = Set(work_.look->isovalues[surface]);
    Cubic above = cubic;
    above.c0 = hn::Sub(cubic.c0, value);
    const auto enters_above = hn::Ge(values.first, value), leaves_above = hn::Ge(values.last, value);
    // Bezier's points between the ends. There are at most as many crossings as changes of sides among all four (Descartes).
    const auto third = Set(1.0F / 3);
    const auto first = hn::Add(above.c0, hn::Mul(above.c1, third)), second = hn::Add(first, hn::Mul(hn::Add(above.c1, above.c2), third));
    const auto first_above = hn::Ge(first, zero), second_above = hn::Ge(second, zero);
    const auto a = hn::Xor(enters_above, first_above), b = hn::Xor(first_above, second_above), c = hn::Xor(second_above, leaves_above);
    rays = hn::And(rays, hn::Or(hn::Or(a, b), c));
    if (hn::AllFalse(df, rays)) return;
    // Most rays have one change, in one stretch.
    const auto several = hn::And(rays, hn::Or(hn::And(a, hn::Or(b, c)), hn::And(b, c)));
    Floats ends[4] = {zero, one, one, one};
    Mask sides[4] = {enters_above, leaves_above, leaves_above, leaves_above};
    if (!hn::AllFalse(df, several)) {
      const Extrema extrema = ExtremaOf(cubic);
      const auto is_above = [&](Floats x) HWY_ATTR {
        const auto at_end = hn::Ge(x, one);
        return hn::Or(hn::And(at_end, leaves_above), hn::AndNot(at_end, hn::Ge(above.At(x), zero)));
      };
      ends[1] = hn::IfThenElse(several, extrema.first, one);
      ends[2] = hn::IfThenElse(several, extrema.second, one);
      sides[1] = is_above(ends[1]);
      sides[2] = is_above(ends[2]);
    }
    // Each ray takes the first stretch that is left.
    Mask left[3];
    for (std::size_t i = 0; i < 3; ++i) {
      left[i] = hn::And(rays, hn::Xor(sides[i], sides[i + 1]));
      nearest.changes = hn::Add(nearest.changes, hn::IfThenElseZero(left[i], one));
    }
    for (;;) {
      const auto any = hn::Or(left[0], hn::Or(left[1], left[2]));
      if (hn::AllFalse(df, any)) return;
      auto rest = any, low_side = hn::Lt(one, zero);
      auto low = zero, high = zero;
      for (std::size_t i = 0; i < 3; ++i) {
        const auto taken = hn::And(rest, left[i]);
        low = hn::IfThenElse(taken, ends[i], low);
        high = hn::IfThenElse(taken, ends[i + 1], high);
        low_side = hn::Or(low_side, hn::And(taken, sides[i]));
        left[i] = hn::AndNot(taken, left[i]);
        rest = hn::AndNot(taken, rest);
      }
      const auto x = RootBetween(above, any, low_side, low, high);
      const auto at = hn::Add(way.enter, hn::Mul(x, hn::Sub(way.leave, way.enter)));
      const auto number = Set(float(surface));
      const auto counts = hn::And(hn::And(any, hn::Lt(at, nearest.at)), Counts(way, at, x, number));
      nearest.at = hn::IfThenElse(counts, at, nearest.at);
      nearest.x = hn::IfThenElse(counts, x, nearest.x);
      nearest.surface = hn::IfThenElse(counts, number, nearest.surface);
    }
  }

  // The lowest corners of the cells; fractions are not used.
  HWY_INLINE SamplePlace PlaceOfCells() const {
    SamplePlace place;
    for (std::size_t i = 0; i < 3; ++i) {
      place.voxel[i] = hn::Sub(hn::ConvertTo(IntTag(), cell_[i]), SetInt(box_.origin[int(i)]));
      place.fraction[i] = place.position[i] = hn::Zero(FloatTag());
    }
    return place;
  }

  // Moves rays into their next cell, or farther through empty ones. `moves_on`: takes those of them whose cell holds a surface, and returns
  // those that move.
  template <class MovesOn>
  HWY_INLINE void Advance(Mask rays, MovesOn&& moves_on) {
    const FloatTag df;
    const SamplePlace place = PlaceOfCells();
    const auto group = CellOf<kCellShift>(place, box_.cells, rays);
    const auto distance = DistanceAt(*work_.to_surfaces, octant_start_, group);
    const auto leaping = hn::And(rays, hn::RebindMask(df, hn::Gt(distance, hn::Zero(IntTag()))));
    const auto stepping = hn::AndNot(leaping, moves_on(hn::And(rays, HoldsSurface(group, place))));
    if (!hn::AllFalse(df, stepping)) Step(stepping);
    if (!hn::AllFalse(df, leaping)) Leap(place, leaping, hn::ConvertTo(df, distance));
  }

  // Whether a surface passes through the cells that lie at `place`, in these groups.
  HWY_INLINE Mask HoldsSurface(Ints group, const SamplePlace& place) const {
    const IntTag di;
    const auto among = [&](std::size_t axis) HWY_ATTR { return hn::And(place.voxel[axis], SetInt(kCellSide - 1)); };
    const auto z = among(2);
    const auto number = hn::Add(hn::ShiftLeft<1>(group), hn::And(z, SetInt(1)));
    const auto bit = hn::Add(hn::Add(hn::ShiftLeft<4>(hn::ShiftRight<1>(z)), hn::ShiftLeft<2>(among(1))), among(0));
    const auto cells = hn::GatherIndex(di, work_.surface_cells, number);
    return hn::RebindMask(FloatTag(), hn::Ne(hn::And(cells, hn::Shl(SetInt(1), bit)), hn::Zero(di)));
  }

  // The next crossing of these rays in their cells, and how many changes of sides there are.
  struct Found {
    Crossing crossing;
    Floats changes;
  };
  HWY_INLINE Found SearchCell(Mask rays) const {
    const FloatTag df;
    const auto zero = hn::Zero(df);
    const SamplePlace place = PlaceOfCells();
    const Neighbours<T> voxels = LoadNeighbours<T>(box_, place, rays);
    auto least = voxels.inner[0][0].a, greatest = least, magnitude = zero;
    for (const auto& slice : voxels.inner) {
      for (const SampleRow& row : slice) {
        least = hn::Min(least, hn::Min(row.a, row.b));
        greatest = hn::Max(greatest, hn::Max(row.a, row.b));
        if constexpr (std::is_same_v<T, float>) magnitude = hn::Add(magnitude, hn::Add(hn::Abs(row.a), hn::Abs(row.b)));
      }
    }
    const Way way = WayThroughCells();
    const auto finite = hn::Le(magnitude, Set(std::numeric_limits<float>::max()));
    const auto valid = hn::And(hn::And(rays, finite), hn::Le(way.enter, way.leave));
    const Ends ends = InterpolateEnds(way, voxels);
    const Cubic cubic = CubicAlong(way, voxels, ends);
    Nearest nearest = {Set(kRayEnd), zero, zero, zero};
    const std::vector<float>& isovalues = work_.look->isovalues;
    for (std::size_t surface = 0; surface < isovalues.size(); ++surface) {
      const auto value = Set(isovalues[surface]);
      const auto crossed = hn::And(valid, hn::And(hn::Lt(least, value), hn::Le(value, greatest)));
      if (!hn::AllFalse(df, crossed)) CrossSurface(way, cubic, ends, surface, crossed, nearest);
    }
    return {{nearest.at,
             nearest.surface,
             {place.voxel[0], place.voxel[1], place.voxel[2]},
             {way.FractionAt(0, nearest.x), way.FractionAt(1, nearest.x), way.FractionAt(2, nearest.x)}},
            nearest.changes};
  }

  // Keeps the next crossing of these rays in their cells, and moves rays on that have no other one there.
  HWY_NOINLINE void CrossCells(Mask rays) {
    const FloatTag df;
    const auto [crossing, changes] = SearchCell(rays);
    const auto found = hn::Lt(crossing.at, Set(kRayEnd));
    if (!hn::AllFalse(df, found)) {
      last_ = hn::IfThenElse(found, crossing.at, last_);
      surface_ = hn::IfThenElse(found, crossing.surface, surface_);
      known_to_ = hn::IfThenElse(found, crossing.at, known_to_);
      const auto kept = Kept();
      for (std::size_t i = 0; i <= std::size_t(hn::GetLane(hn::MaxOfLanes(df, kept))) && i < kMostKept; ++i) {
        Crossing next = crossings_[i].Load();
        next.Become(hn::And(found, hn::Eq(kept, Set(float(i)))), crossing);
        crossings_[i].Store(next);
      }
      hn::Store(hn::Add(kept, hn::IfThenElseZero(found, Set(1))), df, kept_);
      if (work_.labels == nullptr) {
        const auto entry = hn::ShiftLeft<2>(hn::ConvertTo(IntTag(), surface_));
        const auto opacity = hn::GatherIndex(df, work_.look->surface_looks.data() + 3, entry);
        const auto transmitted = hn::Load(df, transmitted_);
        hn::Store(hn::Sub(transmitted, hn::IfThenElseZero(found, hn::Mul(transmitted, opacity))), df, transmitted_);
      }
      EndOpaque();
    }
    Step(hn::And(hn::And(rays, walking_), hn::Not(hn::And(found, hn::Gt(changes, Set(1))))));
  }

  // Keeps the crossings in the cells listed.
  HWY_NOINLINE void CrossListed(std::size_t count) {
    const FloatTag df;
    const IntTag di;
    bool done[kLanes] = {};  // cells of the ray that follow do not count
    // A walk with a ray of its own in each lane.
    RayPacket packet;
    SurfaceWalk walk(work_, packet, octant_start_);
    for (std::size_t first = 0; first < count; first += kLanes) {
      const auto valid = hn::FirstN(df, count - first);
      const auto numbers = hn::IfThenElseZero(hn::RebindMask(di, valid), hn::LoadU(di, cells_.ray + first));
      const auto indices = hn::IndicesFromVec(df, numbers);
      const auto of_rays = [&](Floats v) HWY_ATTR { return hn::TableLookupLanes(v, indices); };
      for (std::size_t i = 0; i < 3; ++i) {
        packet.first[i] = of_rays(packet_.first[i]);
        packet.move[i] = of_rays(packet_.move[i]);
        walk.inverse_[i] = of_rays(inverse_[i]);
        walk.still_[i] = IsStill(packet.move[i]);
        walk.cell_[i] = hn::IfThenElse(valid, hn::LoadU(df, cells_.cell[i] + first), of_rays(cell_[i]));
      }
      walk.from_ = of_rays(from_);
      walk.to_ = of_rays(to_);
      walk.last_ = hn::LoadU(df, cells_.last + first);
      walk.surface_ = hn::LoadU(df, cells_.surface + first);
      const Found found = walk.SearchCell(valid);
      const auto any = hn::Lt(found.crossing.at, Set(kRayEnd));
      if (hn::AllFalse(df, any)) continue;
      KeptCrossing crossing;
      crossing.Store(found.crossing);
      alignas(64) float changes[kLanes];
      alignas(64) std::int32_t lanes[kLanes];
      hn::Store(found.changes, df, changes);
      hn::Store(hn::Compress(hn::Iota(di, 0), hn::RebindMask(di, any)), di, lanes);
      for (std::size_t i = 0; i < hn::CountTrue(df, any); ++i) {
        const auto lane = std::size_t(lanes[i]), number = first + lane, ray = std::size_t(cells_.ray[number]);
        if (done[ray]) continue;
        if (kept_[ray] == float(kMostKept)) {
          done[ray] = true;
          GoBack(ray, number, crossing.at[lane], cells_.last[number], cells_.surface[number]);
          continue;
        }
        crossings_[std::size_t(kept_[ray]++)].SetLane(ray, crossing, lane);
        done[ray] = changes[lane] > 1;
        if (done[ray]) GoBack(ray, number, crossing.at[lane], crossing.at[lane], crossing.surface[lane]);
        if (work_.labels != nullptr) continue;
        transmitted_[ray] -= transmitted_[ray] * work_.look->surface_looks[4 * std::size_t(crossing.surface[lane]) + 3];
        done[ray] = done[ray] || transmitted_[ray] <= work_.termination;
      }
    }
    EndOpaque();
  }
  // A ray ends at the latest where the surfaces alone let too little through. Labels may change their opacity.
  HWY_INLINE void EndOpaque() {
    walking_ = hn::And(walking_, hn::Gt(hn::Load(FloatTag(), transmitted_), Set(work_.termination)));
    known_to_ = hn::IfThenElse(walking_, known_to_, Set(kRayEnd));
  }
  // The ray walks on from a listed cell, behind its last crossing there; the next one is not before `at`.
  HWY_INLINE void GoBack(std::size_t ray, std::size_t number, float at, float last, float surface) {
    const auto lane = hn::Eq(hn::Iota(FloatTag(), 0), Set(float(ray)));
    walking_ = hn::Or(walking_, lane);
    known_to_ = hn::IfThenElse(lane, Set(at), known_to_);
    last_ = hn::IfThenElse(lane, Set(last), last_);
    surface_ = hn::IfThenElse(lane, Set(surface), surface_);
    for (std::size_t i = 0; i < 3; ++i) cell_[i] = hn::IfThenElse(lane, Set(cells_.cell[i][number]), cell_[i]);
  }

  // Moves rays into the next cell.
  HWY_INLINE void Step(Mask rays) {
    const auto zero = hn::Zero(FloatTag()), one = Set(1);
    Floats plane_at[3], step[3];
    auto leave = Set(kRayEnd);
    for (std::size_t i = 0; i < 3; ++i) {
      const auto backward = hn::Lt(packet_.move[i], zero);
      step[i] = hn::IfThenElse(backward, Set(-1), one);
      const auto plane = hn::IfThenElse(backward, cell_[i], hn::Add(cell_[i], one));
      plane_at[i] = hn::IfThenElse(still_[i], Set(kRayEnd), PlaneAt(i, plane));
      leave = hn::Min(leave, plane_at[i]);
    }
    for (std::size_t i = 0; i < 3; ++i) {
      cell_[i] = hn::Add(cell_[i], hn::IfThenElseZero(hn::And(rays, hn::Eq(plane_at[i], leave)), step[i]));
    }
    Moved(rays, leave);
  }

  // Moves rays to the border of the empty groups around them.
  HWY_INLINE void Leap(const SamplePlace& place, Mask rays, Floats distance) {
    const FloatTag df;
    const auto zero = hn::Zero(df), one = Set(1);
    // The planes through which the rays leave.
    Floats plane[3], plane_at[3];
    auto leave = Set(kRayEnd);
    for (std::size_t i = 0; i < 3; ++i) {
      const auto backward = hn::Lt(packet_.move[i], zero);
      const auto group = hn::ConvertTo(df, hn::ShiftRight<kCellShift>(place.voxel[i]));
      const auto ahead = hn::Add(group, hn::IfThenElse(backward, hn::Sub(one, distance), distance));
      plane[i] = hn::Add(hn::Mul(ahead, Set(float(kCellSide))), Set(float(box_.origin[int(i)])));
      plane_at[i] = hn::IfThenElse(still_[i], Set(kRayEnd), PlaneAt(i, plane[i]));
      leave = hn::Min(leave, plane_at[i]);
    }
    for (std::size_t i = 0; i < 3; ++i) {
      const auto backward = hn::Lt(packet_.move[i], zero);
      const auto last = hn::IfThenElse(backward, plane[i], hn::Sub(plane[i], one));  // cell before the plane
      const auto behind = hn::IfThenElse(backward, hn::Sub(plane[i], one), plane[i]);
      // Along the other axes: never back, and not beyond the plane.
      const auto beside = CellAt(i, PositionOf(packet_, i, leave));
      const auto limited = hn::IfThenElse(backward, hn::Min(hn::Max(beside, last), cell_[i]), hn::Max(hn::Min(beside, last), cell_[i]));
      cell_[i] = hn::IfThenElse(rays, hn::IfThenElse(hn::Eq(plane_at[i], leave), behind, limited), cell_[i]);
    }
    Moved(rays, leave);
  }

  // Rays have passed a plane there, in samples, into other cells.
  HWY_INLINE void Moved(Mask rays, Floats at) {
    auto inside = hn::And(rays, hn::Le(at, to_));
    for (std::size_t i = 0; i < 3; ++i) inside = hn::And(inside, hn::And(hn::Ge(cell_[i], lowest_[i]), hn::Le(cell_[i], highest_[i])));
    walking_ = hn::Or(hn::AndNot(rays, walking_), inside);
    last_ = hn::IfThenElse(rays, Set(-kRayEnd), last_);
    known_to_ = hn::IfThenElse(rays, hn::IfThenElse(inside, at, Set(kRayEnd)), known_to_);
  }

  // Where the rays pass a position, in samples, or the plane of voxels of a number.
  HWY_INLINE Floats Passes(std::size_t axis, Floats position) const {
    return hn::Mul(hn::Sub(position, packet_.first[axis]), inverse_[axis]);
  }
  HWY_INLINE Floats PlaneAt(std::size_t axis, Floats voxel) const {
    if constexpr (kStretched) return Passes(axis, PlaceOfVoxel(box_.stretch->axes[axis], voxel));
    return Passes(axis, voxel);
  }
  // The cell of a position; what fraction lies before it in its cell; and back.
  HWY_INLINE Floats CellAt(std::size_t axis, Floats position) const {
    if constexpr (kStretched) return VoxelBefore(box_.stretch->axes[axis], position);
    return hn::Floor(position);
  }
  HWY_INLINE Floats FractionIn(std::size_t axis, Floats position) const {
    if constexpr (kStretched) return FractionBehind(box_.stretch->axes[axis], position, cell_[axis]);
    return hn::Sub(position, cell_[axis]);
  }
  HWY_INLINE Floats PositionIn(std::size_t axis, Floats fraction) const {
    if constexpr (kStretched) {
      const StretchTable& table = box_.stretch->axes[axis];
      return Lerp(fraction, PlaceOfVoxel(table, cell_[axis]), PlaceOfVoxel(table, hn::Add(cell_[axis], Set(1))));
    }
    return hn::Add(cell_[axis], fraction);
  }

  const MarchWork& work_;
  const RayBox& box_;
  const RayPacket& packet_;
  const Ints octant_start_;
  Floats from_, to_;                       // samples
  Mask still_[3];                          // rays that do not move along an axis
  Floats inverse_[3];                      // 1 / move
  Floats lowest_[3], highest_[3];          // cells of the box
  Mask walking_;                           // rays that are still in the box
  Floats cell_[3];                         // floors of the positions in it
  Floats last_, surface_;                  // the last crossing found in this cell, and the surface of the last crossing
  Floats known_to_;                        // no other crossing comes before, in samples; kRayEnd: none comes at all
  alignas(64) float transmitted_[kLanes];  // by all crossings found
  alignas(64) float kept_[kLanes];         // how many
  bool waits_;                             // a surface is so opaque that rays end there
  Cells cells_;
  KeptCrossing crossings_[kMostKept];  // nearest first
};

// Adds the crossings of rays with isosurfaces up to `before`, in samples, to `sums`: add(rays, crossings). A packet walks `ahead` samples
// at once. Returns how many.
template <class Walk, class Sums, class Add>
HWY_INLINE std::uint64_t AddCrossingsUpTo(Floats before, float ahead, float termination, Walk& walk, Sums& sums, Add&& add) {
  const FloatTag df;
  const auto opaque = Set(1 - termination);
  std::uint64_t count = 0;
  for (;;) {
    const auto alive = hn::Lt(sums.alpha, opaque);
    const auto unknown = hn::And(alive, walk.MayCross(before));
    if (!hn::AllFalse(df, unknown)) {
      const auto last = hn::MaxOfLanes(df, hn::IfThenElseZero(unknown, before));
      walk.Find(alive, hn::Add(last, Set(ahead)));
    }
    const auto at = walk.nearest().at;
    const auto crossing = hn::And(alive, hn::And(hn::Le(at, before), hn::Lt(at, Set(kRayEnd))));
    if (hn::AllFalse(df, crossing)) return count;
    count += hn::CountTrue(df, crossing);
    add(crossing, walk.nearest());
    walk.Leave(crossing);
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace slabstream
HWY_AFTER_NAMESPACE();

#endif
