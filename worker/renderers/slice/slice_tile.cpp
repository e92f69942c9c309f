#include "worker/renderers/slice/slice_tile.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "worker/renderers/slice/slice_tile.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "worker/kernels/power-inl.h"
#include "worker/rays/ray_sums-inl.h"
#include "worker/renderers/slice/cell_shape.h"

#ifndef SLABSTREAM_WORKER_RENDERERS_SLICE_TILE_ROOM
#define SLABSTREAM_WORKER_RENDERERS_SLICE_TILE_ROOM
namespace slabstream::slice {

inline constexpr std::size_t kTilePixels = std::size_t(kTileWidth) * kTileHeight, kRowPadding = 16;  // kernels may rewrite what lies behind

// A cell that reaches into the chunk.
struct ActiveCell {
  CellShape shape;
  std::int32_t k_begin, k_end;  // planes that it may reach into
  std::int32_t y_begin, y_end;  // rows of the tile
};

// One of the parts that clipping leaves of the rays; by pixel, [y][x].
struct TilePart {
  alignas(64) float begin[kTilePixels], end[kTilePixels];   // samples of the box
  alignas(64) float first[kTilePixels], last[kTilePixels];  // EndSamples
  alignas(64) float first_excess[kTilePixels], last_excess[kTilePixels];
};

struct TileRoom {
  TilePart parts[2];
  alignas(64) float length[kTilePixels];  // of a step of each ray, in distances of planes
  alignas(64) float red[kTilePixels], green[kTilePixels], blue[kTilePixels], alpha[kTilePixels];
  alignas(64) float values[kChunkPlanes * kTilePixels + kRowPadding];  // [plane][y][x], NaN: no cell
  std::vector<std::size_t> chunk_first;                                // of `ordered`, by chunk
  std::vector<std::uint32_t> ordered;                                  // the tile's cells
  std::vector<ActiveCell> cells;                                       // rooms of active cells
  std::vector<std::uint32_t> active, vacant;                           // of `cells`
};

}  // namespace slabstream::slice
#endif

HWY_BEFORE_NAMESPACE();
namespace slabstream::slice::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;
using namespace slabstream::HWY_NAMESPACE;  // NOLINT(google-build-using-namespace): the shared kernels of this instruction set

// Rows of a plane, one to a lane.
using RowTag = hn::CappedTag<double, 8>;
using Rows = hn::Vec<RowTag>;
constexpr std::int32_t kRowLanes = std::int32_t(hn::MaxLanes(RowTag()));

// Writes the values of a cell's samples in planes [k_begin, k_end) of the chunk that begins at `chunk`.
HWY_INLINE void CutCell(const ActiveCell& cell, const FrameSpace& space, std::int32_t chunk, std::int32_t k_begin, std::int32_t k_end,
                        double tile_y, float* values) {
  const RowTag dd;
  const FloatTag df;
  const hn::Rebind<std::int32_t, RowTag> di;
  const hn::Rebind<float, RowTag> dv;
  const CellShape& shape = cell.shape;
  const auto least = Set(shape.least), greatest = Set(shape.greatest);
  for (std::int32_t k = k_begin; k < k_end; ++k) {
    const double s = space.SOf(k), scale = space.ScaleOf(k);
    double root[4];
    for (std::size_t i = 0; i < 4; ++i) root[i] = shape.at[i] + s * shape.per_s[i];
    // Values far outside the range are cut off, so that none overflows.
    const double value = (shape.value + s * shape.value_s) * scale, value_y = shape.value_y * scale;
    const auto value_x = Set(float(std::clamp(shape.value_x * scale, -1e36, 1e36)));
    float* const plane = values + std::size_t(k - chunk) * kTilePixels;
    for (std::int32_t row = cell.y_begin; row < cell.y_end; row += kRowLanes) {
      const auto y = hn::Add(hn::Set(dd, tile_y + row), hn::Iota(dd, 0));
      const auto root_of = [&](std::size_t i) HWY_ATTR { return hn::Add(hn::Set(dd, root[i]), hn::Mul(hn::Set(dd, shape.per_y[i]), y)); };
      const auto r1 = root_of(1), r2 = root_of(2);
      auto left = hn::Max(hn::Max(root_of(0), hn::Zero(dd)),
                          hn::Max(hn::Add(r1, hn::Set(dd, shape.before[0])), hn::Add(r2, hn::Set(dd, shape.before[1]))));
      auto right = hn::Min(hn::Min(root_of(3), hn::Set(dd, double(kTileWidth))),
                           hn::Min(hn::Add(r1, hn::Set(dd, shape.behind[0])), hn::Add(r2, hn::Set(dd, shape.behind[1]))));
      left = hn::Ceil(left);
      right = hn::Ceil(right);
      const auto any = hn::And(hn::Lt(left, right), hn::Lt(y, hn::Set(dd, tile_y + cell.y_end)));
      if (hn::AllFalse(dd, any)) continue;
      alignas(64) std::int32_t begins[8], ends[8];
      alignas(64) float firsts[8];
      hn::Store(hn::DemoteTo(di, left), di, begins);
      hn::Store(hn::DemoteTo(di, right), di, ends);
      const auto first = hn::Add(hn::Set(dd, value), hn::Mul(hn::Set(dd, value_y), y));
      hn::Store(hn::DemoteTo(dv, hn::Min(hn::Max(first, hn::Set(dd, -1e38)), hn::Set(dd, 1e38))), dv, firsts);
      std::uint8_t bits[8] = {};
      hn::StoreMaskBits(dd, any, bits);
      for (unsigned rest = bits[0]; rest != 0; rest &= rest - 1) {
        const auto lane = std::size_t(std::countr_zero(rest));
        float* const to = plane + (std::size_t(row) + lane) * kTileWidth;
        for (std::int32_t x = begins[lane]; x < ends[lane]; x += std::int32_t(kLanes)) {
          const auto column = hn::Iota(df, float(x));
          const auto v = hn::Add(Set(firsts[lane]), hn::Mul(value_x, column));
          hn::BlendedStore(hn::Min(hn::Max(v, least), greatest), hn::FirstN(df, std::size_t(ends[lane] - x)), df, to + x);
        }
      }
    }
  }
}

// Fills in the parts of the tile's rays and their lengths.
HWY_INLINE void FindRays(const SliceWork& work, const PixelBounds& tile, TileRoom& room) {
  const FloatTag df;
  const ViewRays& rays = work.space->rays();
  const std::int32_t x0 = tile.x_begin / kTileWidth * kTileWidth, y0 = tile.y_begin / kTileHeight * kTileHeight;
  const bool clipped = !rays.clip.empty(), has_ends = work.at_border || clipped;
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
      PacketPart cut[2];
      if (clipped) PartsOf(rays.clip, packet, cut);
      for (std::size_t i = 0; i < (clipped ? 2 : 1); ++i) {
        const PacketPart* const part = clipped ? &cut[i] : nullptr;
        const SampleInterval samples = part != nullptr ? part->Of(owned) : owned;
        spread(samples.begin, room.parts[i].begin);
        spread(samples.end, room.parts[i].end);
        if (!has_ends) continue;
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

// Adds the samples of the chunk's planes [k_begin, k_end). Returns how many were drawn; `alive`: whether a ray goes on.
template <bool kClipped>
HWY_INLINE std::uint64_t Compose(const SliceWork& work, std::int32_t chunk, std::int32_t k_begin, std::int32_t k_end, TileRoom& room,
                                 bool& alive) {
  const FloatTag df;
  const RayLook& look = *work.look;
  const float* const entries = look.entries.data();
  const auto zero = hn::Zero(df), one = Set(1), opaque = Set(1 - work.termination);
  const bool has_ends = work.at_border || kClipped, perspective = work.space->perspective();
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
      const auto value = hn::Load(df, room.values + std::size_t(k - chunk) * kTilePixels + pixel);
      auto present = hn::Eq(value, value);
      if (hn::AllFalse(df, present)) continue;
      const auto plane = Set(float(k));
      auto mine = hn::And(hn::Ge(plane, owned[0].begin), hn::Lt(plane, owned[0].end));
      if constexpr (kClipped) mine = hn::Or(mine, hn::And(hn::Ge(plane, owned[1].begin), hn::Lt(plane, owned[1].end)));
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
          length = hn::Add(length, hn::Mul(length, excess));
        }
      }
      const auto uneven = hn::And(visible, hn::Ne(length, one));
      if (!hn::AllFalse(df, uneven)) {
        opacity = hn::IfThenElse(uneven, hn::Sub(one, PowerOfFraction(hn::Sub(one, opacity), length)), opacity);
      }
      sums.Add(visible, opacity, entries, entry, {one, zero});
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
HWY_INLINE void Activate(const SliceWork& work, std::uint32_t cell, std::int32_t x0, std::int32_t y0, TileRoom& room) {
  const Mesh& mesh = *work.mesh;
  Tetrahedron t = mesh.tetrahedra[cell];
  std::ranges::sort(t);
  const std::array<FramePoint, 4> points = {work.points[t[0]], work.points[t[1]], work.points[t[2]], work.points[t[3]]};
  const SampleBounds bounds = BoundsOf(points[0], points[1], points[2], points[3]);
  std::array<float, 4> values{};
  for (std::size_t i = 0; i < 4; ++i) values[i] = mesh.values[mesh.at == ValuesAt::kCells ? cell : t[i]];
  if (room.vacant.empty()) {
    room.vacant.push_back(std::uint32_t(room.cells.size()));
    room.cells.emplace_back();
  }
  ActiveCell& active = room.cells[room.vacant.back()];
  if (!MakeCellShape(points, values, x0, work.space->perspective() && mesh.at == ValuesAt::kPoints, active.shape)) return;
  active.k_begin = std::max(bounds.k_begin, work.k_begin);
  active.k_end = std::min(bounds.k_end, work.k_end);
  active.y_begin = std::max(bounds.y_begin - y0, 0);
  active.y_end = std::min(bounds.y_end - y0, kTileHeight);
  room.active.push_back(room.vacant.back());
  room.vacant.pop_back();
}

std::uint64_t Slice(const SliceWork& work, const PixelBounds& tile, std::span<const CellBins::Entry> cells, TileRoom& room, float* rgba,
                    std::size_t floats_a_row) {
  if (cells.empty()) return 0;
  const FloatTag df;
  const std::int32_t x0 = tile.x_begin / kTileWidth * kTileWidth, y0 = tile.y_begin / kTileHeight * kTileHeight;
  FindRays(work, tile, room);
  for (float* channel : {room.red, room.green, room.blue, room.alpha}) std::fill_n(channel, kTilePixels, 0.0F);
  const std::int32_t first_chunk = OrderCells(cells, room);
  room.active.clear();
  room.vacant.resize(room.cells.size());
  for (std::size_t i = 0; i < room.vacant.size(); ++i) room.vacant[i] = std::uint32_t(i);

  std::uint64_t drawn = 0;
  bool alive = true;
  const bool clipped = !work.space->rays().clip.empty();
  const std::int32_t chunks = std::int32_t(room.chunk_first.size()) - 1;
  for (std::int32_t number = 0; alive && (number < chunks || !room.active.empty()); ++number) {
    const std::int32_t chunk = (first_chunk + number) * kChunkPlanes;
    if (chunk >= work.k_end) break;
    if (number < chunks) {
      for (std::size_t i = room.chunk_first[std::size_t(number)]; i < room.chunk_first[std::size_t(number) + 1]; ++i) {
        Activate(work, room.ordered[i], x0, y0, room);
      }
    }
    const std::int32_t k_begin = std::max(chunk, work.k_begin), k_end = std::min(chunk + kChunkPlanes, work.k_end);
    if (room.active.empty() || k_begin >= k_end) continue;
    const auto nothing = Set(std::numeric_limits<float>::quiet_NaN());
    for (std::size_t i = 0; i < kChunkPlanes * kTilePixels; i += kLanes) hn::Store(nothing, df, room.values + i);
    std::size_t kept = 0;
    for (const std::uint32_t place : room.active) {
      const ActiveCell& cell = room.cells[place];
      CutCell(cell, *work.space, chunk, std::max(cell.k_begin, k_begin), std::min(cell.k_end, k_end), y0, room.values);
      if (cell.k_end > k_end) {
        room.active[kept++] = place;
      } else {
        room.vacant.push_back(place);
      }
    }
    room.active.resize(kept);
    alive = false;
    drawn += clipped ? Compose<true>(work, chunk, k_begin, k_end, room, alive) : Compose<false>(work, chunk, k_begin, k_end, room, alive);
  }
  if (drawn == 0) return 0;
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

void DeleteTileRoom::operator()(TileRoom* room) const { delete room; }
TileRoomPtr MakeTileRoom() { return TileRoomPtr(new TileRoom); }

std::uint64_t SliceTile(const SliceWork& work, const PixelBounds& tile, std::span<const CellBins::Entry> cells, TileRoom& room, float* rgba,
                        std::size_t floats_a_row) {
  return HWY_DYNAMIC_DISPATCH(Slice)(work, tile, cells, room, rgba, floats_a_row);
}

}  // namespace slabstream::slice
#endif
