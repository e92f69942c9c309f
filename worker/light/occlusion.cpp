#include "worker/light/occlusion.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "worker/light/occlusion.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "common/memory/aligned_buffer.h"
#include "common/parallel/parallel.h"
#include "common/volume/indices.h"
#include "worker/light/exponential-inl.h"

#ifndef SLABSTREAM_WORKER_LIGHT_OCCLUSION_CPP_  // shared by all instruction sets
#define SLABSTREAM_WORKER_LIGHT_OCCLUSION_CPP_
namespace slabstream {

inline constexpr std::ptrdiff_t kRegister = 16;  // floats that kernels may touch beyond a row

// A grid of extinction. Rows follow each other along y, slices along z.
struct ExtinctionGrid {
  Index3 size;
  Vec3 spacing;
  const float* first = nullptr;
  std::ptrdiff_t row = 0, slice = 0;

  const float* Row(std::int32_t y, std::int32_t z) const { return first + z * slice + y * row; }
};

// Extinction with a margin of empty voxels that no way leaves. All are empty at first.
class PaddedExtinction {
 public:
  PaddedExtinction() = default;
  PaddedExtinction(const Index3& size, const Vec3& spacing) : grid_{.size = size, .spacing = spacing} {
    const Index3 whole = size + Uniform(2 * kMostOcclusionSteps);
    grid_.row = whole.x;
    grid_.slice = grid_.row * whole.y;
    each_.resize(CountIn(whole) + std::size_t(kRegister));
    grid_.first = each_.data() + kMostOcclusionSteps * (grid_.slice + grid_.row + 1);
  }

  PaddedExtinction(PaddedExtinction&&) = default;
  PaddedExtinction& operator=(PaddedExtinction&&) = default;

  const ExtinctionGrid& grid() const { return grid_; }
  float* Row(std::int32_t y, std::int32_t z) { return each_.data() + (grid_.Row(y, z) - each_.data()); }

 private:
  ExtinctionGrid grid_;
  AlignedVector<float> each_;
};

// A way in one direction: `count` voxels, one every `stride`.
struct Way {
  std::ptrdiff_t stride = 0;
  std::int32_t count = 0;
  float step = 0;    // length from voxel to voxel
  float weight = 0;  // all add up to 1
};

// Where voxels of a fine grid lie in a coarse one along an axis: `share` of the way from voxel `below` to the next one. kRegister more than
// there are voxels, like the last one. `below` grows by at most 1 from voxel to voxel.
struct Places {
  std::vector<std::int32_t> below;
  std::vector<float> share;
};

// The four rows of a coarse grid around a row of a fine one.
struct CoarseRows {
  std::int32_t count = 0;               // of voxels in a row
  std::array<const float*, 4> beams{};  // number 2 z + y: above along y, z or both
  float y = 0, z = 0;                   // the shares of those above
};

}  // namespace slabstream
#endif

HWY_BEFORE_NAMESPACE();
namespace slabstream::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

// Openness of the voxels of a slice; `out` has room for kRegister more.
void OpennessOfSlice(const ExtinctionGrid& extinction, const std::array<Way, 26>& ways, std::int32_t z, float* out) {
  const hn::CappedTag<float, 16> d;
  for (std::int32_t y = 0; y < extinction.size.y; ++y, out += extinction.size.x) {
    for (std::int32_t x = 0; x < extinction.size.x; x += std::int32_t(hn::Lanes(d))) {
      const float* const at = extinction.Row(y, z) + x;
      auto open = hn::Zero(d);
      for (const Way& way : ways) {
        auto sum = hn::Zero(d);
        for (std::int32_t i = 1; i <= way.count; ++i) sum = hn::Add(sum, hn::LoadU(d, at + i * way.stride));
        open = hn::Add(open, hn::Mul(ExpOfMinus(hn::Mul(sum, hn::Set(d, way.step))), hn::Set(d, way.weight)));
      }
      hn::StoreU(open, d, out + x);
    }
  }
}

// Adds what each of `count` voxels transmits along `length`. `sums` has room for kRegister more.
void AddTransmitted(const float* each, std::int32_t count, float length, float* sums) {
  const hn::CappedTag<float, 16> d;
  const auto lanes = std::int32_t(hn::Lanes(d));
  const auto add = [&](const float* from, float* to) HWY_ATTR {
    hn::StoreU(hn::Add(hn::LoadU(d, to), ExpOfMinus(hn::Mul(hn::LoadU(d, from), hn::Set(d, length)))), d, to);
  };
  std::int32_t x = 0;
  for (; x + lanes <= count; x += lanes) add(each + x, sums + x);
  if (x == count) return;
  HWY_ALIGN float rest[16] = {};
  std::copy_n(each + x, count - x, rest);
  add(rest, sums + x);
}

// A row of the fine grid, from the rows of the coarse one around it. `out` has room for kRegister more, `room` (of a coarse row) for twice
// as many.
void InterpolateRow(const CoarseRows& rows, const Places& along_x, std::int32_t count, float* room, float* out) {
  const hn::CappedTag<float, 16> d;
  const hn::RebindToSigned<decltype(d)> di;
  const auto lerp = [&](auto t, auto from, auto to) HWY_ATTR { return hn::Add(from, hn::Mul(t, hn::Sub(to, from))); };
  const auto y = hn::Set(d, rows.y), z = hn::Set(d, rows.z);
  for (std::int32_t x = 0; x < rows.count; x += std::int32_t(hn::Lanes(d))) {
    const auto beam = [&](std::size_t number) HWY_ATTR { return hn::LoadU(d, rows.beams[number] + x); };
    hn::StoreU(lerp(z, lerp(y, beam(0), beam(1)), lerp(y, beam(2), beam(3))), d, room + x);
  }
  room[rows.count] = room[rows.count - 1];
  for (std::int32_t x = 0; x < count; x += std::int32_t(hn::Lanes(d))) {
    const std::int32_t begin = along_x.below[std::size_t(x)];
    const auto lane = hn::IndicesFromVec(d, hn::Sub(hn::LoadU(di, along_x.below.data() + x), hn::Set(di, begin)));
    const auto from = hn::TableLookupLanes(hn::LoadU(d, room + begin), lane),
               to = hn::TableLookupLanes(hn::LoadU(d, room + begin + 1), lane);
    hn::StoreU(lerp(hn::LoadU(d, along_x.share.data() + x), from, to), d, out + x);
  }
}

void BytesOfOpen(const float* open, std::size_t count, float strength, std::uint8_t* out) {
  const hn::CappedTag<float, 16> d;
  const hn::RebindToSigned<decltype(d)> di;
  const hn::Rebind<std::uint8_t, decltype(d)> db;
  const auto one = hn::Set(d, 1);
  const auto bytes_of = [&](const float* from) HWY_ATTR {
    const auto closed = hn::Sub(one, hn::Min(hn::Mul(hn::Set(d, 2), hn::LoadU(d, from)), one));
    const auto kept = hn::Mul(hn::Set(d, 255), hn::Sub(one, hn::Mul(hn::Set(d, strength), closed)));
    return hn::DemoteTo(db, hn::ConvertTo(di, hn::Add(kept, hn::Set(d, 0.5F))));
  };
  std::size_t i = 0;
  for (; i + hn::Lanes(d) <= count; i += hn::Lanes(d)) hn::StoreU(bytes_of(open + i), db, out + i);
  if (i == count) return;
  HWY_ALIGN float rest[16] = {};
  HWY_ALIGN std::uint8_t bytes[16];
  std::copy_n(open + i, count - i, rest);
  hn::Store(bytes_of(rest), db, bytes);
  std::copy_n(bytes, count - i, out + i);
}

}  // namespace slabstream::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace slabstream {
namespace {

HWY_EXPORT(OpennessOfSlice);
HWY_EXPORT(AddTransmitted);
HWY_EXPORT(InterpolateRow);
HWY_EXPORT(BytesOfOpen);

// Half as many voxels along the axes of `halved`. What a voxel transmits is the mean of the voxels in it: beside opaque matter half of the
// light passes.
PaddedExtinction Halved(const ExtinctionGrid& fine, const Index3& halved) {
  const Index3 block = Uniform(1) + halved;
  PaddedExtinction coarse((fine.size + block - Uniform(1)) / block, fine.spacing * ToVec3(block));
  const ExtinctionGrid& grid = coarse.grid();
  const double length = std::cbrt(grid.spacing.x * grid.spacing.y * grid.spacing.z);
  ParallelFor(0, grid.size.z, [&](std::int32_t z) {
    AlignedVector<float> sums(std::size_t(fine.size.x + kRegister));
    for (std::int32_t y = 0; y < grid.size.y; ++y) {
      const Index3 begin = Index3{0, y, z} * block, end = Min(begin + block, fine.size);
      std::ranges::fill(sums, 0.0F);
      for (std::int32_t k = begin.z; k < end.z; ++k) {
        for (std::int32_t j = begin.y; j < end.y; ++j) {
          HWY_DYNAMIC_DISPATCH(AddTransmitted)(fine.Row(j, k), fine.size.x, float(length), sums.data());
        }
      }
      const std::int32_t rows = (end.z - begin.z) * (end.y - begin.y);
      float* out = coarse.Row(y, z);
      for (std::int32_t i = 0; i < fine.size.x; i += block.x) {
        const std::int32_t columns = std::min(block.x, fine.size.x - i);
        double transmitted = 0;
        for (std::int32_t column = 0; column < columns; ++column) transmitted += double(sums[std::size_t(i + column)]);
        const double mean = transmitted / (rows * columns);  // of empty voxels exactly 1
        *out++ = mean < 1 ? float(-std::log(mean) / length) : 0;
      }
    }
  });
  return coarse;
}

PaddedExtinction Padded(const ExtinctionGrid& grid) {
  PaddedExtinction padded(grid.size, grid.spacing);
  ParallelFor(0, grid.size.z, [&](std::int32_t z) {
    for (std::int32_t y = 0; y < grid.size.y; ++y) std::copy_n(grid.Row(y, z), grid.size.x, padded.Row(y, z));
  });
  return padded;
}

std::array<Way, 26> WaysOf(const ExtinctionGrid& extinction, double radius) {
  // Lebedev's weights of the six directions of faces, the twelve of edges and the eight of corners.
  constexpr std::array<double, 3> kWeights = {1.0 / 21, 4.0 / 105, 9.0 / 280};
  std::array<Way, 26> ways;
  std::size_t number = 0;
  for (const Index3& to : IndicesIn(Box{Uniform(-1), Uniform(2)})) {
    const int axes = std::abs(to.x) + std::abs(to.y) + std::abs(to.z);
    if (axes == 0) continue;
    const double step = Length(ToVec3(to) * extinction.spacing);
    const auto count = std::clamp(std::int32_t(std::lround(radius / step)), 1, kMostOcclusionSteps);
    // A way of a whole number of steps stands for one of the radius.
    ways[number++] = {.stride = to.z * extinction.slice + to.y * extinction.row + to.x,
                      .count = count,
                      .step = float(std::min(radius / count, 2 * step)),
                      .weight = float(kWeights[std::size_t(axes) - 1])};
  }
  return ways;
}

// From voxels of a grid to those of `coarse`, by axis, where each voxel's place is map.scale * i + map.offset.
std::array<Places, 3> PlacesOf(const Index3& size, const GridMap& map, const Index3& coarse) {
  std::array<Places, 3> places;
  for (int axis = 0; axis < 3; ++axis) {
    Places& along = places[std::size_t(axis)];
    for (std::int32_t i = 0; i < size[axis]; ++i) {
      const double at = std::clamp(map.scale[axis] * i + map.offset[axis], 0.0, coarse[axis] - 1.0);
      along.below.push_back(std::clamp(std::int32_t(at), 0, std::max(coarse[axis] - 2, 0)));
      along.share.push_back(float(at - along.below.back()));
    }
    along.below.resize(along.below.size() + std::size_t(kRegister), along.below.back());
    along.share.resize(along.below.size());
  }
  return places;
}

}  // namespace

void FindOpenness(const Extinction& extinction, double radius, const TakeOpenness& take) {
  ExtinctionGrid used = {extinction.size, extinction.spacing, extinction.each.data(), extinction.size.x,
                         std::ptrdiff_t{extinction.size.x} * extinction.size.y};
  PaddedExtinction padded;
  GridMap map;  // from voxels of `extinction` to those of `used`
  for (;;) {
    Index3 halved;
    for (const Axis axis : kAxes) {
      const bool too_many = used.size[axis] > kMaxOcclusionSide || radius > (kMostOcclusionSteps + 0.5) * used.spacing[axis];
      halved[axis] = too_many && used.size[axis] > 1 ? 1 : 0;
      if (halved[axis] == 0) continue;
      map.scale[axis] /= 2;
      map.offset[axis] = (map.offset[axis] - 0.5) / 2;
    }
    if (halved == Index3{}) break;
    padded = Halved(used, halved);
    used = padded.grid();
  }
  if (used.first == extinction.each.data()) {
    padded = Padded(used);
    used = padded.grid();
  }
  const std::array<Way, 26> ways = WaysOf(used, radius);
  const Index3& size = used.size;
  AlignedVector<float> open(CountIn(size) + std::size_t(kRegister));
  const std::size_t slice = std::size_t(size.x) * std::size_t(size.y);
  ParallelFor(0, size.z, [&](std::int32_t z) {
    AlignedVector<float> of_slice(slice + std::size_t(kRegister));
    HWY_DYNAMIC_DISPATCH(OpennessOfSlice)(used, ways, z, of_slice.data());
    std::copy_n(of_slice.data(), slice, open.data() + std::size_t(z) * slice);
  });

  const std::array<Places, 3> places = PlacesOf(extinction.size, map, size);
  ParallelFor(0, extinction.size.z, [&](std::int32_t z) {
    AlignedVector<float> room(std::size_t(size.x + 2 * kRegister)), row(std::size_t(extinction.size.x + kRegister));
    const std::int32_t below_z = places[2].below[std::size_t(z)];
    for (std::int32_t y = 0; y < extinction.size.y; ++y) {
      const std::int32_t below_y = places[1].below[std::size_t(y)];
      CoarseRows rows{.count = size.x, .y = places[1].share[std::size_t(y)], .z = places[2].share[std::size_t(z)]};
      for (std::int32_t beam = 0; beam < 4; ++beam) {
        const Index3 at = {0, std::min(below_y + beam % 2, size.y - 1), std::min(below_z + beam / 2, size.z - 1)};
        rows.beams[std::size_t(beam)] = open.data() + NumberIn(size, at);
      }
      HWY_DYNAMIC_DISPATCH(InterpolateRow)(rows, places[0], extinction.size.x, room.data(), row.data());
      take(NumberIn(extinction.size, {0, y, z}), {row.data(), std::size_t(extinction.size.x)});
    }
  });
}

void KeepOpen(std::span<const float> open, float strength, std::uint8_t* out) {
  HWY_DYNAMIC_DISPATCH(BytesOfOpen)(open.data(), open.size(), strength, out);
}

}  // namespace slabstream
#endif
