#include "worker/light/occlusion.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "worker/light/occlusion.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "common/base/aligned_buffer.h"
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

}  // namespace slabstream::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace slabstream {
namespace {

HWY_EXPORT(OpennessOfSlice);

// Half as many voxels along the axes of `halved`. What a voxel transmits is the mean of the voxels in it: beside opaque matter half of the
// light passes.
Extinction Halved(const Extinction& fine, const Index3& halved) {
  const Index3 block = Uniform(1) + halved;
  Extinction coarse{.size = (fine.size + block - Uniform(1)) / block, .spacing = fine.spacing * ToVec3(block), .each = {}};
  coarse.each.resize(CountIn(coarse.size));
  const double length = std::cbrt(coarse.spacing.x * coarse.spacing.y * coarse.spacing.z);
  tbb::parallel_for(std::int32_t{0}, coarse.size.z, [&](std::int32_t z) {
    for (std::int32_t y = 0; y < coarse.size.y; ++y) {
      for (std::int32_t x = 0; x < coarse.size.x; ++x) {
        const Index3 begin = Index3{x, y, z} * block, end = Min(begin + block, fine.size);
        double transmitted = 0, most = 0;
        int count = 0;
        for (std::int32_t k = begin.z; k < end.z; ++k) {
          for (std::int32_t j = begin.y; j < end.y; ++j) {
            for (std::int32_t i = begin.x; i < end.x; ++i, ++count) {
              const double each = fine.each[NumberIn(fine.size, {i, j, k})];
              most = std::max(most, each);
              if (each > 0) transmitted += std::exp(-each * length) - 1;
            }
          }
        }
        if (most > 0) coarse.each[NumberIn(coarse.size, {x, y, z})] = float(-std::log1p(transmitted / count) / length);
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
  for (int z = -1; z <= 1; ++z) {
    for (int y = -1; y <= 1; ++y) {
      for (int x = -1; x <= 1; ++x) {
        const int axes = std::abs(x) + std::abs(y) + std::abs(z);
        if (axes == 0) continue;
        const double step = Length(Vec3{double(x), double(y), double(z)} * spacing);
        const auto count = std::clamp(std::int32_t(std::lround(radius / step)), 1, kMostOcclusionSteps);
        // A way of a whole number of steps stands for one of the radius.
        ways[number++] = {.stride = z * extinction.slice + y * extinction.row + x,
                          .count = count,
                          .step = float(std::min(radius / count, 2 * step)),
                          .weight = float(kWeights[std::size_t(axes) - 1])};
      }
    }
  }
  return ways;
}

}  // namespace

std::vector<float> FindOpenness(const Extinction& extinction, double radius) {
  Extinction coarse = extinction;
  GridMap map;  // from voxels of `extinction` to those of `coarse`
  for (;;) {
    Index3 halved;
    for (const Axis axis : kAxes) {
      const bool too_many = coarse.size[axis] > kMaxOcclusionSide || radius > (kMostOcclusionSteps + 0.5) * coarse.spacing[axis];
      halved[axis] = too_many && coarse.size[axis] > 1 ? 1 : 0;
    }
    if (halved == Index3{}) break;
    coarse = Halved(coarse, halved);
    for (const Axis axis : kAxes) {
      if (halved[axis] == 0) continue;
      map.scale[axis] /= 2;
      map.offset[axis] = (map.offset[axis] - 0.5) / 2;
    }
  }
  const PaddedExtinction padded = Padded(coarse);
  const std::array<Way, 26> ways = WaysOf(padded, coarse.spacing, radius);
  AlignedVector<float> open(CountIn(coarse.size));
  const std::size_t slice = std::size_t(coarse.size.x) * std::size_t(coarse.size.y);
  tbb::parallel_for(std::int32_t{0}, coarse.size.z, [&](std::int32_t z) {
    AlignedVector<float> of_slice(slice + std::size_t(kRegister));
    HWY_DYNAMIC_DISPATCH(OpennessOfSlice)(padded, ways, z, of_slice.data());
    std::copy_n(of_slice.data(), slice, open.data() + std::size_t(z) * slice);
  });
  if (coarse.size == extinction.size) return {open.begin(), open.end()};

  // Places of voxels of `extinction` among those of `coarse`, by axis.
  struct Place {
    std::int32_t below = 0;
    float share = 0;  // of the voxel above
  };
  std::array<std::vector<Place>, 3> places;
  for (int axis = 0; axis < 3; ++axis) {
    for (std::int32_t i = 0; i < extinction.size[axis]; ++i) {
      const double at = std::clamp(map.scale[axis] * i + map.offset[axis], 0.0, coarse.size[axis] - 1.0);
      const auto below = std::clamp(std::int32_t(at), 0, std::max(coarse.size[axis] - 2, 0));
      places[std::size_t(axis)].push_back({below, float(at - below)});
    }
  }
  std::vector<float> fine(extinction.each.size());
  tbb::parallel_for(std::int32_t{0}, extinction.size.z, [&](std::int32_t z) {
    const Place pz = places[2][std::size_t(z)];
    std::vector<float> row(std::size_t(coarse.size.x) + 1);
    for (std::int32_t y = 0; y < extinction.size.y; ++y) {
      const Place py = places[1][std::size_t(y)];
      const auto beam = [&](int dy, int dz) {
        const Index3 at = {0, std::min(py.below + dy, coarse.size.y - 1), std::min(pz.below + dz, coarse.size.z - 1)};
        return open.data() + NumberIn(coarse.size, at);
      };
      const float *b00 = beam(0, 0), *b10 = beam(1, 0), *b01 = beam(0, 1), *b11 = beam(1, 1);
      for (std::size_t x = 0; x < std::size_t(coarse.size.x); ++x) {
        const float near = b00[x] + py.share * (b10[x] - b00[x]), far = b01[x] + py.share * (b11[x] - b01[x]);
        row[x] = near + pz.share * (far - near);
      }
      row.back() = row[row.size() - 2];
      float* out = fine.data() + NumberIn(extinction.size, {0, y, z});
      for (const Place& px : places[0]) {
        const float* at = row.data() + px.below;
        *out++ = at[0] + px.share * (at[1] - at[0]);
      }
    }
  });
  return fine;
}

}  // namespace slabstream
#endif
