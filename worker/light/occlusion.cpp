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

// Extinction with a margin of empty voxels that no way leaves.
struct PaddedExtinction {
  Index3 size;
  std::int32_t margin = 0;
  std::ptrdiff_t row = 0, slice = 0;
  AlignedVector<float> each;

  std::ptrdiff_t At(std::int32_t x, std::int32_t y, std::int32_t z) const { return (z + margin) * slice + (y + margin) * row + x + margin; }
};

// A way in one direction: `count` voxels, one every `stride`.
struct Way {
  std::ptrdiff_t stride = 0;
  std::int32_t count = 0;
  float step = 0;    // length from voxel to voxel
  float weight = 0;  // all add up to 1
};

// Where voxels of a fine grid lie in a coarse one along an axis: `share` of the way from voxel `below` to the next one. kRegister more than
// there are voxels.
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
void OpennessOfSlice(const PaddedExtinction& extinction, const std::array<Way, 26>& ways, std::int32_t z, float* out) {
  const hn::CappedTag<float, 16> d;
  for (std::int32_t y = 0; y < extinction.size.y; ++y, out += extinction.size.x) {
    for (std::int32_t x = 0; x < extinction.size.x; x += std::int32_t(hn::Lanes(d))) {
      const float* const at = extinction.each.data() + extinction.At(x, y, z);
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

// A row of the fine grid, from the rows of the coarse one around it. `room` (of a coarse row) and `out` have room for kRegister more.
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
    const auto at = hn::LoadU(di, along_x.below.data() + x);
    hn::StoreU(lerp(hn::LoadU(d, along_x.share.data() + x), hn::GatherIndex(d, room, at), hn::GatherIndex(d, room + 1, at)), d, out + x);
  }
}

}  // namespace slabstream::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace slabstream {
namespace {

HWY_EXPORT(OpennessOfSlice);
HWY_EXPORT(AddTransmitted);
HWY_EXPORT(InterpolateRow);

// Half as many voxels along the axes of `halved`. What a voxel transmits is the mean of the voxels in it: beside opaque matter half of the
// light passes.
Extinction Halved(const Extinction& fine, const Index3& halved) {
  const Index3 block = Uniform(1) + halved;
  Extinction coarse{.size = (fine.size + block - Uniform(1)) / block, .spacing = fine.spacing * ToVec3(block), .each = {}};
  coarse.each.resize(CountIn(coarse.size));
  const double length = std::cbrt(coarse.spacing.x * coarse.spacing.y * coarse.spacing.z);
  ParallelFor(0, coarse.size.z, [&](std::int32_t z) {
    AlignedVector<float> sums(std::size_t(fine.size.x + kRegister));
    float* out = coarse.each.data() + NumberIn(coarse.size, {0, 0, z});
    for (std::int32_t y = 0; y < coarse.size.y; ++y) {
      const Index3 begin = Index3{0, y, z} * block, end = Min(begin + block, fine.size);
      std::ranges::fill(sums, 0.0F);
      for (std::int32_t k = begin.z; k < end.z; ++k) {
        for (std::int32_t j = begin.y; j < end.y; ++j) {
          const float* const row = fine.each.data() + NumberIn(fine.size, {0, j, k});
          HWY_DYNAMIC_DISPATCH(AddTransmitted)(row, fine.size.x, float(length), sums.data());
        }
      }
      const std::int32_t rows = (end.z - begin.z) * (end.y - begin.y);
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

PaddedExtinction Padded(const Extinction& extinction) {
  PaddedExtinction padded{.size = extinction.size, .margin = kMostOcclusionSteps, .each = {}};
  const Index3 whole = extinction.size + Uniform(2 * padded.margin);
  padded.row = whole.x;
  padded.slice = padded.row * whole.y;
  padded.each.assign(CountIn(whole) + std::size_t(kRegister), 0.0F);
  const float* from = extinction.each.data();
  for (std::int32_t z = 0; z < extinction.size.z; ++z) {
    for (std::int32_t y = 0; y < extinction.size.y; ++y, from += extinction.size.x) {
      std::copy_n(from, extinction.size.x, padded.each.data() + padded.At(0, y, z));
    }
  }
  return padded;
}

std::array<Way, 26> WaysOf(const PaddedExtinction& extinction, const Vec3& spacing, double radius) {
  // Lebedev's weights of the six directions of faces, the twelve of edges and the eight of corners.
  constexpr std::array<double, 3> kWeights = {1.0 / 21, 4.0 / 105, 9.0 / 280};
  std::array<Way, 26> ways;
  std::size_t number = 0;
  for (const Index3& to : IndicesIn(Box{Uniform(-1), Uniform(2)})) {
    const int axes = std::abs(to.x) + std::abs(to.y) + std::abs(to.z);
    if (axes == 0) continue;
    const double step = Length(ToVec3(to) * spacing);
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
    along.below.resize(along.below.size() + std::size_t(kRegister));
    along.share.resize(along.below.size());
  }
  return places;
}

}  // namespace

void FindOpenness(const Extinction& extinction, double radius, const TakeOpenness& take) {
  const Extinction* used = &extinction;
  Extinction coarse;
  GridMap map;  // from voxels of `extinction` to those of `used`
  for (;;) {
    Index3 halved;
    for (const Axis axis : kAxes) {
      const bool too_many = used->size[axis] > kMaxOcclusionSide || radius > (kMostOcclusionSteps + 0.5) * used->spacing[axis];
      halved[axis] = too_many && used->size[axis] > 1 ? 1 : 0;
    }
    if (halved == Index3{}) break;
    coarse = Halved(*used, halved);
    used = &coarse;
    for (const Axis axis : kAxes) {
      if (halved[axis] == 0) continue;
      map.scale[axis] /= 2;
      map.offset[axis] = (map.offset[axis] - 0.5) / 2;
    }
  }
  const PaddedExtinction padded = Padded(*used);
  const std::array<Way, 26> ways = WaysOf(padded, used->spacing, radius);
  const Index3& size = used->size;
  AlignedVector<float> open(CountIn(size) + std::size_t(kRegister));
  const std::size_t slice = std::size_t(size.x) * std::size_t(size.y);
  ParallelFor(0, size.z, [&](std::int32_t z) {
    AlignedVector<float> of_slice(slice + std::size_t(kRegister));
    HWY_DYNAMIC_DISPATCH(OpennessOfSlice)(padded, ways, z, of_slice.data());
    std::copy_n(of_slice.data(), slice, open.data() + std::size_t(z) * slice);
  });

  const std::array<Places, 3> places = PlacesOf(extinction.size, map, size);
  ParallelFor(0, extinction.size.z, [&](std::int32_t z) {
    AlignedVector<float> room(std::size_t(size.x + kRegister)), row(std::size_t(extinction.size.x + kRegister));
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

}  // namespace slabstream
#endif
