#include "worker/renderers/slice/slice_tile.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "worker/renderers/slice/slice_tile.cpp"
#include <hwy/cache_control.h>
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <vector>

#include "worker/kernels/power-inl.h"
#include "worker/rays/ray_sums-inl.h"
#include "worker/renderers/slice/cell_shape-inl.h"
#include "worker/renderers/slice/tile_room.h"

HWY_BEFORE_NAMESPACE();
namespace slabstream::slice::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;
using namespace slabstream::HWY_NAMESPACE;  // NOLINT(google-build-using-namespace): the shared kernels of this instruction set

using DoubleTag = hn::CappedTag<double, 8>;
using Doubles = hn::Vec<DoubleTag>;
constexpr std::int32_t kDoubles = std::int32_t(hn::MaxLanes(DoubleTag()));
static_assert(kChunkPlanes % kDoubles == 0);

// The planes of a chunk, and where its values are written.
struct Chunk {
  std::int32_t begin = 0;
  double s[kChunkPlanes], scale[kChunkPlanes];  // FrameSpace::SOf, ScaleOf
  double tile_y = 0;                            // of the tile's first row
  float* values = nullptr;                      // TileRoom::values
};

// Rows of a plane, or planes of a row, one to a lane.
struct Lanes {
  Doubles s, scale;  // of the planes
  Doubles root[4];   // places of the cell's faces where y is 0
};
HWY_INLINE Lanes LanesAt(const CellShape& shape, Doubles s, Doubles scale) {
  const DoubleTag dd;
  Lanes lanes;
  lanes.s = s;
  lanes.scale = scale;
  for (std::size_t i = 0; i < 4; ++i) lanes.root[i] = hn::Add(hn::Set(dd, shape.at[i]), hn::Mul(s, hn::Set(dd, shape.per_s[i])));
  return lanes;
}

// A linear function on rows, one to a lane: at x = 0, and its change from pixel to pixel.
struct OnRows {
  float firsts[8], changes[8];

  HWY_INLINE OnRows(const LinearFunction& f, const Lanes& lanes, Doubles y, Doubles scale) {
    const DoubleTag dd;
    const hn::Rebind<float, DoubleTag> dv;
    const auto set = [&](double value) HWY_ATTR { return hn::Set(dd, value); };
    // Values far outside the range are cut off, so that none overflows.
    const auto limited = [&](Doubles v, double limit) HWY_ATTR { return hn::DemoteTo(dv, hn::Min(hn::Max(v, set(-limit)), set(limit))); };
    const auto at_zero = hn::Add(hn::Add(set(f.at), hn::Mul(lanes.s, set(f.per_s))), hn::Mul(set(f.per_y), y));
    hn::StoreU(limited(hn::Mul(at_zero, scale), 1e38), dv, firsts);
    hn::StoreU(limited(hn::Mul(set(f.per_x), scale), 1e36), dv, changes);
  }
};

// Writes the values, and if kLit the gradients, of a cell's samples on the rows y of these lanes. A lane's row begins at `to` + lane *
// `stride`.
template <bool kLit>
HWY_INLINE void CutRows(const CellShape& shape, const Lanes& lanes, Doubles y, hn::Mask<DoubleTag> valid, float* to, std::size_t stride) {
  const DoubleTag dd;
  const FloatTag df;
  const hn::Rebind<std::int32_t, DoubleTag> di;
  const auto set = [&](double value) HWY_ATTR { return hn::Set(dd, value); };
  const auto root = [&](std::size_t i) HWY_ATTR { return hn::Add(lanes.root[i], hn::Mul(set(shape.per_y[i]), y)); };
  const auto r1 = root(1), r2 = root(2);
  const auto left =
      hn::Ceil(hn::Max(hn::Max(root(0), hn::Zero(dd)), hn::Max(hn::Add(r1, set(shape.before[0])), hn::Add(r2, set(shape.before[1])))));
  const auto right = hn::Ceil(
      hn::Min(hn::Min(root(3), set(double(kTileWidth))), hn::Min(hn::Add(r1, set(shape.behind[0])), hn::Add(r2, set(shape.behind[1])))));
  const auto any = hn::And(hn::Lt(left, right), valid);
  std::uint8_t bits[8] = {};
  hn::StoreMaskBits(dd, any, bits);
  if (bits[0] == 0) return;

  std::int32_t begins[8], ends[8];
  hn::StoreU(hn::DemoteTo(di, left), di, begins);
  hn::StoreU(hn::DemoteTo(di, right), di, ends);
  const OnRows value(shape.value, lanes, y, lanes.scale);
  const auto least = Set(shape.least), greatest = Set(shape.greatest);
  for (unsigned rest = bits[0]; rest != 0; rest &= rest - 1) {
    const auto lane = std::size_t(std::countr_zero(rest));
    const auto first = Set(value.firsts[lane]), change = Set(value.changes[lane]);
    for (std::int32_t x = begins[lane]; x < ends[lane]; x += std::int32_t(kLanes)) {
      const auto at = hn::Add(first, hn::Mul(change, hn::Iota(df, float(x))));
      hn::BlendedStore(hn::Min(hn::Max(at, least), greatest), hn::FirstN(df, std::size_t(ends[lane] - x)), df, to + lane * stride + x);
    }
  }
  if constexpr (kLit) {
    for (const LinearFunction& slope : shape.slope) {
      to += kChunkFloats;
      const OnRows of(slope, lanes, y, set(1));
      for (unsigned rest = bits[0]; rest != 0; rest &= rest - 1) {
        const auto lane = std::size_t(std::countr_zero(rest));
        const auto first = Set(of.firsts[lane]), change = Set(of.changes[lane]);
        for (std::int32_t x = begins[lane]; x < ends[lane]; x += std::int32_t(kLanes)) {
          const auto at = hn::Add(first, hn::Mul(change, hn::Iota(df, float(x))));
          hn::BlendedStore(at, hn::FirstN(df, std::size_t(ends[lane] - x)), df, to + lane * stride + x);
        }
      }
    }
  }
}

// Writes the values of a cell's samples in the chunk's planes [k_begin, k_end). Rows or planes are taken to lanes, whichever needs fewer
// vectors; every sample has the same bits either way.
template <bool kLit>
HWY_NOINLINE void CutCell(const ActiveMacrocell& cell, const Chunk& chunk, std::int32_t k_begin, std::int32_t k_end) {
  const DoubleTag dd;
  const CellShape& shape = cell.shape;
  const std::int32_t planes = k_end - k_begin, rows = cell.y_end - cell.y_begin;
  const auto vectors = [](std::int32_t count) { return (count + kDoubles - 1) / kDoubles; };
  const auto first_lanes = [&](std::int32_t count) HWY_ATTR { return hn::Lt(hn::Iota(dd, 0), hn::Set(dd, double(count))); };
  const auto row_at = [&](std::int32_t k, std::int32_t row) {
    return chunk.values + std::size_t(k) * kTilePixels + std::size_t(row) * kTileWidth;
  };
  if (planes * vectors(rows) <= rows * vectors(planes)) {
    for (std::int32_t k = k_begin - chunk.begin; k < k_end - chunk.begin; ++k) {
      const Lanes lanes = LanesAt(shape, hn::Set(dd, chunk.s[k]), hn::Set(dd, chunk.scale[k]));
      for (std::int32_t row = cell.y_begin; row < cell.y_end; row += kDoubles) {
        CutRows<kLit>(shape, lanes, hn::Iota(dd, chunk.tile_y + row), first_lanes(cell.y_end - row), row_at(k, row), kTileWidth);
      }
    }
    return;
  }
  // Vectors begin at whole multiples of lanes, so that loads stay in the chunk.
  for (std::int32_t k = (k_begin - chunk.begin) / kDoubles * kDoubles; k < k_end - chunk.begin; k += kDoubles) {
    const Lanes lanes = LanesAt(shape, hn::LoadU(dd, chunk.s + k), hn::LoadU(dd, chunk.scale + k));
    const auto valid = hn::AndNot(first_lanes(k_begin - chunk.begin - k), first_lanes(k_end - chunk.begin - k));
    for (std::int32_t row = cell.y_begin; row < cell.y_end; ++row) {
      CutRows<kLit>(shape, lanes, hn::Set(dd, chunk.tile_y + row), valid, row_at(k, row), kTilePixels);
    }
  }
}

// Fills in the parts of the tile's rays and their lengths. `shapes_end`: some rays, at room.ray_ends.
HWY_NOINLINE void FindRays(const SliceWork& work, const PixelBounds& tile, bool shapes_end, TileRoom& room) {
  const FloatTag df;
  const ViewRays& rays = work.space->rays();
  const std::int32_t x0 = tile.x_begin / kTileWidth * kTileWidth, y0 = tile.y_begin / kTileHeight * kTileHeight;
  const bool clipped = !rays.clip.empty(), cut = clipped || shapes_end;
  room.has_ends = work.at_border || cut;
  for (TilePart& part : room.parts) std::fill_n(part.end, kTilePixels, -1.0F);
  for (std::int32_t y = y0; y < y0 + kTileHeight; y += kPacketHeight) {
    for (std::int32_t x = x0; x < x0 + kTileWidth; x += kPacketWidth) {
      if (x >= tile.x_end || y >= tile.y_end || x + kPacketWidth <= tile.x_begin || y + kPacketHeight <= tile.y_begin) continue;
      const RayPacket packet = PacketAt(rays, x, y, tile.x_end, tile.y_end);
      const std::size_t pixel = std::size_t(y - y0) * kTileWidth + std::size_t(x - x0);
      const auto spread = [&](Floats v, float* to) HWY_ATTR {
        alignas(64) float lanes[kLanes];
        hn::Store(v, df, lanes);
        for (std::size_t row = 0; row < std::size_t(kPacketHeight); ++row) {
          std::copy_n(lanes + row * kPacketWidth, kPacketWidth, to + pixel + row * kTileWidth);
        }
      };
      const SampleInterval owned = SamplesInside(packet, work.low, work.high, work.k_begin, work.k_end);
      for (std::size_t i = 0; work.light != nullptr && i < 3; ++i) {
        spread(packet.first[i], room.first[i]);
        spread(packet.move[i], room.move[i]);
      }
      PacketPart parts[2];
      if (cut) PartsOf(rays.clip, packet, parts);
      if (shapes_end) {
        alignas(64) float ends[kLanes];
        for (std::size_t row = 0; row < std::size_t(kPacketHeight); ++row) {
          std::copy_n(room.ray_ends + pixel + row * kTileWidth, kPacketWidth, ends + row * kPacketWidth);
        }
        for (PacketPart& part : parts) part = Between(part, Set(-kRayEnd), hn::Load(df, ends));
      }
      for (std::size_t i = 0; i < (clipped ? 2 : 1); ++i) {
        const PacketPart* const part = cut ? &parts[i] : nullptr;
        const SampleInterval samples = part != nullptr ? part->Of(owned) : owned;
        spread(samples.begin, room.parts[i].begin);
        spread(samples.end, room.parts[i].end);
        if (clipped && work.look->phong) {
          for (std::size_t axis = 0; axis < 3; ++axis) spread(part->face[axis], room.parts[i].face[axis]);
          spread(part->face_end, room.parts[i].face_end);
        }
        if (!room.has_ends) continue;
        const EndSamples ends = EndSamplesOf(rays, packet, LeapScalesOf(packet), part);
        spread(ends.first, room.parts[i].first);
        spread(ends.last, room.parts[i].last);
        spread(ends.first_excess, room.parts[i].first_excess);
        spread(ends.last_excess, room.parts[i].last_excess);
      }
    }
  }
  if (!work.space->perspective()) return;
  for (std::int32_t y = 0; y < kTileHeight; ++y) {
    for (std::int32_t x = 0; x < kTileWidth; ++x) {
      const float from_x = float(x0 + x) - rays.centre_x, from_y = float(y0 + y) - rays.centre_y;
      room.length[y * kTileWidth + x] = std::sqrt(1 + (from_x * from_x + from_y * from_y) * rays.pixel_squared);
    }
  }
}

// The light on samples of a plane. `at`: of the first one, in a buffer of TileRoom::values. `in(i)`: those that lie in part i of their
// rays.
template <bool kClipped>
HWY_INLINE Light LightOnSamples(const SliceWork& work, const TileRoom& room, std::size_t at, std::size_t pixel, Floats plane, auto&& in) {
  const FloatTag df;
  const RayLook& look = *work.look;
  Gradient gradient = {hn::Zero(df), hn::Zero(df), hn::Zero(df)};
  if (look.phong) {
    gradient = {hn::Load(df, room.values[1] + at), hn::Load(df, room.values[2] + at), hn::Load(df, room.values[3] + at)};
    for (std::size_t i = 0; kClipped && i < 2; ++i) {
      const TilePart& part = room.parts[i];
      const auto face = [&](std::size_t axis) HWY_ATTR { return hn::Load(df, part.face[axis] + pixel); };
      const auto on_face = hn::And(in(i), hn::Lt(plane, hn::Load(df, part.face_end + pixel)));
      gradient = Choose(on_face, {face(0), face(1), face(2)}, gradient);
    }
    if (work.light == nullptr) return LightOf(look, gradient);
  }
  SamplePlace place;
  for (std::size_t i = 0; i < 3; ++i) {
    place.position[i] = hn::Add(hn::Load(df, room.first[i] + pixel), hn::Mul(plane, hn::Load(df, room.move[i] + pixel)));
  }
  return LightAt(look, gradient, *work.light, place);
}

// Adds the samples of the chunk's planes [k_begin, k_end). Returns how many were drawn; `alive`: whether a ray goes on.
template <bool kClipped>
HWY_NOINLINE std::uint64_t Compose(const SliceWork& work, std::int32_t chunk, std::int32_t k_begin, std::int32_t k_end, TileRoom& room,
                                   bool& alive) {
  const FloatTag df;
  const RayLook& look = *work.look;
  const float* const entries = look.entries.data();
  const auto zero = hn::Zero(df), one = Set(1), opaque = Set(1 - work.termination);
  const bool has_ends = room.has_ends, perspective = work.space->perspective();
  std::uint64_t drawn = 0;
  for (std::size_t pixel = 0; pixel < kTilePixels; pixel += kLanes) {
    constexpr std::size_t kParts = kClipped ? 2 : 1;
    SampleInterval owned[kParts];
    auto end = hn::Set(df, -1.0F);
    for (std::size_t i = 0; i < kParts; ++i) {
      owned[i] = {hn::Load(df, room.parts[i].begin + pixel), hn::Load(df, room.parts[i].end + pixel)};
      end = hn::Max(end, owned[i].end);
    }
    Sums sums = {hn::Load(df, room.red + pixel), hn::Load(df, room.green + pixel), hn::Load(df, room.blue + pixel),
                 hn::Load(df, room.alpha + pixel)};
    const auto goes_on = hn::And(hn::Lt(sums.alpha, opaque), hn::Lt(Set(float(k_begin)), end));
    if (hn::AllFalse(df, goes_on)) continue;
    alive = true;
    std::uint64_t count = 0;
    for (std::int32_t k = k_begin; k < k_end; ++k) {
      const std::size_t at = std::size_t(k - chunk) * kTilePixels + pixel;
      const auto value = hn::Load(df, room.values[0] + at);
      auto present = hn::Eq(value, value);
      if (hn::AllFalse(df, present)) continue;
      const auto plane = Set(float(k));
      const auto in = [&](std::size_t i) HWY_ATTR { return hn::And(hn::Ge(plane, owned[i].begin), hn::Lt(plane, owned[i].end)); };
      auto mine = in(0);
      if constexpr (kClipped) mine = hn::Or(mine, in(1));
      present = hn::And(hn::And(present, mine), hn::Lt(sums.alpha, opaque));
      const auto entry = EntryOf(look, value, present);
      auto opacity = hn::GatherIndex(df, entries + 3, entry);
      const auto visible = hn::And(present, hn::Gt(opacity, zero));
      const std::size_t found = hn::CountTrue(df, visible);
      if (found == 0) continue;
      count += found;
      // The length that a sample stands for. A lane's bits do not depend on the other lanes.
      auto length = perspective ? hn::Load(df, room.length + pixel) : one;
      if (has_ends) {
        for (std::size_t i = 0; i < kParts; ++i) {
          const TilePart& part = room.parts[i];
          const auto is_first = hn::Eq(plane, hn::Load(df, part.first + pixel)), is_last = hn::Eq(plane, hn::Load(df, part.last + pixel));
          const auto excess = hn::Add(hn::IfThenElseZero(is_first, hn::Load(df, part.first_excess + pixel)),
                                      hn::IfThenElseZero(is_last, hn::Load(df, part.last_excess + pixel)));
          length = hn::Add(length, hn::IfThenElseZero(in(i), hn::Mul(length, excess)));
        }
      }
      const auto uneven = hn::And(visible, hn::Ne(length, one));
      if (!hn::AllFalse(df, uneven)) {
        opacity = hn::IfThenElse(uneven, hn::Sub(one, PowerOfFraction(hn::Sub(one, opacity), length)), opacity);
      }
      Light light = {one, zero};
      if (look.phong || work.light != nullptr) light = LightOnSamples<kClipped>(work, room, at, pixel, plane, in);
      sums.Add(visible, opacity, entries, entry, light);
    }
    if (count == 0) continue;
    drawn += count;
    hn::Store(sums.red, df, room.red + pixel);
    hn::Store(sums.green, df, room.green + pixel);
    hn::Store(sums.blue, df, room.blue + pixel);
    hn::Store(sums.alpha, df, room.alpha + pixel);
  }
  return drawn;
}

// The tile's cells by the chunk where they begin, and by number. Returns the first chunk; room.chunk_first has the places of each chunk
// from it on.
std::int32_t OrderCells(std::span<const CellBins::Entry> cells, TileRoom& room) {
  if (cells.empty()) {
    room.chunk_first.assign(1, 0);
    return 0;
  }
  std::int32_t first = std::numeric_limits<std::int32_t>::max(), last = 0;
  for (const CellBins::Entry& entry : cells) {
    first = std::min(first, entry.chunk);
    last = std::max(last, entry.chunk);
  }
  std::vector<std::size_t>& places = room.chunk_first;
  places.assign(std::size_t(last - first) + 2, 0);
  for (const CellBins::Entry& entry : cells) ++places[std::size_t(entry.chunk - first) + 1];
  for (std::size_t i = 1; i < places.size(); ++i) places[i] += places[i - 1];
  room.ordered.resize(cells.size());
  for (const CellBins::Entry& entry : cells) room.ordered[places[std::size_t(entry.chunk - first)]++] = entry.cell;
  std::copy_backward(places.begin(), places.end() - 1, places.end());
  places[0] = 0;
  return first;
}

// Makes a cell active if it has samples in the tile.
HWY_NOINLINE void Activate(const SliceWork& work, std::uint32_t cell, std::int32_t x0, std::int32_t y0, TileRoom& room) {
  const Mesh& mesh = *work.mesh;
  Tetrahedron t = mesh.tetrahedra[cell];
  const SampleBounds bounds = BoundsOf(work.points->bounds, t);
  const auto order = [&](std::size_t a, std::size_t b) {
    const PointNumber low = std::min(t[a], t[b]), high = std::max(t[a], t[b]);
    t[a] = low;
    t[b] = high;
  };
  order(0, 1);
  order(2, 3);
  order(0, 2);
  order(1, 3);
  order(1, 2);
  static constexpr Vector3<float> kNone = {};
  CellCorners corners{};
  corners.scaled_gradient = work.space->perspective();
  corners.scaled_value = corners.scaled_gradient && mesh.at == ValuesAt::kPoints;
  for (std::size_t i = 0; i < 4; ++i) {
    corners.points[i] = &work.points->points[t[i]];
    corners.values[i] = mesh.values[mesh.at == ValuesAt::kCells ? cell : t[i]];
    if (work.look->phong) corners.gradients[i] = mesh.gradients.empty() ? &kNone : &mesh.gradients[t[i]];
  }
  if (room.vacant.empty()) {
    room.vacant.push_back(std::uint32_t(room.cells.size()));
    room.cells.emplace_back();
  }
  ActiveMacrocell& active = room.cells[room.vacant.back()];
  if (!MakeCellShape(corners, x0, active.shape)) return;
  active.k_begin = std::max(bounds.k_begin, work.k_begin);
  active.k_end = std::min(bounds.k_end, work.k_end);
  active.y_begin = std::max(bounds.y_begin - y0, 0);
  active.y_end = std::min(bounds.y_end - y0, kTileHeight);
  room.active.push_back(room.vacant.back());
  room.vacant.pop_back();
}

// Cells and points lie anywhere in memory: has those of the next cells fetched.
HWY_INLINE void FetchAhead(const SliceWork& work, const std::vector<std::uint32_t>& cells, std::size_t at) {
  constexpr std::size_t kFar = 16, kNear = 6;
  if (at + kFar >= cells.size()) return;
  hwy::Prefetch(&work.mesh->tetrahedra[cells[at + kFar]]);
  for (const PointNumber point : work.mesh->tetrahedra[cells[at + kNear]]) {
    hwy::Prefetch(&work.points->points[point]);
    hwy::Prefetch(&work.points->bounds[point]);
  }
}

std::uint64_t Slice(const SliceWork& work, const PixelBounds& tile, std::span<const CellBins::Entry> cells, TileRoom& room, float* rgba,
                    std::size_t floats_a_row) {
  const FloatTag df;
  const std::int32_t x0 = tile.x_begin / kTileWidth * kTileWidth, y0 = tile.y_begin / kTileHeight * kTileHeight;
  const bool shapes_end = FindFragments(work, tile, room);
  if (cells.empty() && room.fragments.empty()) return 0;
  FindRays(work, tile, shapes_end, room);
  for (float* channel : {room.red, room.green, room.blue, room.alpha}) std::fill_n(channel, kTilePixels, 0.0F);
  const std::int32_t first_chunk = OrderCells(cells, room);
  room.active.clear();
  room.vacant.resize(room.cells.size());
  for (std::size_t i = 0; i < room.vacant.size(); ++i) room.vacant[i] = std::uint32_t(i);

  std::uint64_t drawn = 0;
  bool alive = true;
  Chunk planes;
  planes.tile_y = y0;
  planes.values = room.values[0];
  const bool clipped = !work.space->rays().clip.empty();
  const std::int32_t chunks = std::int32_t(room.chunk_first.size()) - 1;
  for (std::int32_t number = 0; alive && (number < chunks || !room.active.empty()); ++number) {
    const std::int32_t chunk = (first_chunk + number) * kChunkPlanes;
    if (chunk >= work.k_end) break;
    if (number < chunks) {
      for (std::size_t i = room.chunk_first[std::size_t(number)]; i < room.chunk_first[std::size_t(number) + 1]; ++i) {
        FetchAhead(work, room.ordered, i);
        Activate(work, room.ordered[i], x0, y0, room);
      }
    }
    const std::int32_t k_begin = std::max(chunk, work.k_begin), k_end = std::min(chunk + kChunkPlanes, work.k_end);
    if (room.active.empty() || k_begin >= k_end) continue;
    const auto nothing = Set(std::numeric_limits<float>::quiet_NaN());
    for (std::size_t i = 0; i < kChunkPlanes * kTilePixels; i += kLanes) hn::Store(nothing, df, room.values[0] + i);
    planes.begin = chunk;
    for (std::int32_t k = 0; k < kChunkPlanes; ++k) {
      planes.s[k] = work.space->SOf(chunk + k);
      planes.scale[k] = work.space->ScaleOf(chunk + k);
    }
    std::size_t kept = 0;
    for (const std::uint32_t place : room.active) {
      const ActiveMacrocell& cell = room.cells[place];
      (work.look->phong ? CutCell<true> : CutCell<false>)(cell, planes, std::max(cell.k_begin, k_begin), std::min(cell.k_end, k_end));
      if (cell.k_end > k_end) {
        room.active[kept++] = place;
      } else {
        room.vacant.push_back(place);
      }
    }
    room.active.resize(kept);
    alive = false;
    for (std::int32_t k = k_begin; k < k_end;) {
      AddFragments(k, room);
      const bool more = room.next_fragment < room.fragments.size();
      const std::int32_t end = more ? std::min(k_end, room.fragments[room.next_fragment].plane) : k_end;
      drawn += clipped ? Compose<true>(work, chunk, k, end, room, alive) : Compose<false>(work, chunk, k, end, room, alive);
      k = end;
    }
  }
  AddFragments(std::numeric_limits<std::int32_t>::max(), room);
  if (drawn == 0 && room.fragments.empty()) return 0;
  for (std::int32_t y = tile.y_begin; y < tile.y_end; ++y) {
    float* to = rgba + std::size_t(y - tile.y_begin) * floats_a_row;
    std::size_t pixel = std::size_t(y - y0) * kTileWidth + std::size_t(tile.x_begin - x0);
    for (std::int32_t x = tile.x_begin; x < tile.x_end; ++x, to += 4, ++pixel) {
      to[0] = room.red[pixel];
      to[1] = room.green[pixel];
      to[2] = room.blue[pixel];
      to[3] = room.alpha[pixel];
    }
  }
  return drawn;
}

}  // namespace slabstream::slice::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace slabstream::slice {
HWY_EXPORT(Slice);

std::uint64_t SliceTile(const SliceWork& work, const PixelBounds& tile, std::span<const CellBins::Entry> cells, TileRoom& room, float* rgba,
                        std::size_t floats_a_row) {
  return HWY_DYNAMIC_DISPATCH(Slice)(work, tile, cells, room, rgba, floats_a_row);
}

}  // namespace slabstream::slice
#endif
