#include "worker/light/transmittance.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "worker/light/transmittance.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

#include "common/memory/aligned_buffer.h"
#include "common/parallel/parallel.h"
#include "worker/light/exponential-inl.h"

#ifndef SLABSTREAM_WORKER_LIGHT_TRANSMITTANCE_CPP_  // shared by all instruction sets
#define SLABSTREAM_WORKER_LIGHT_TRANSMITTANCE_CPP_
namespace slabstream {

// Rays are numbered (a, b) in the first plane, where ray (a, b) meets voxel (a, b) of the plane's axes u and v. In plane k, from the light
// on, it is at (a + k * shift_u, b + k * shift_v).
struct Sweep {
  const float* each = nullptr;          // extinction
  const MatterRange* matter = nullptr;  // LightRows
  std::int32_t nu = 0, nv = 0, planes = 0;
  std::ptrdiff_t row = 0, plane = 0;  // voxels from one to the next along v, and away from the light
  std::ptrdiff_t first = 0;           // voxel (0, 0) of the plane nearest to the light
  double shift_u = 0, shift_v = 0;
  float step = 1;  // length of a ray between two planes
  float strength = 1;
  std::uint8_t* out = nullptr;  // laid out like `each`

  std::ptrdiff_t RowAt(std::int32_t plane_number, std::int32_t v) const { return first + plane_number * plane + v * row; }
  MatterRange MatterOf(std::int32_t plane_number, std::int32_t v) const {
    return v < 0 || v >= nv ? MatterRange{} : matter[RowAt(plane_number, v) / nu];
  }
};

inline constexpr std::int32_t kBandRays = 16;  // rows of rays that a task follows: their transmittances stay in the cache
inline constexpr std::int32_t kMargin = 16;    // floats beside a row, which whole registers may touch

inline std::int32_t Floor(double x) { return std::int32_t(std::floor(x)); }

inline MatterRange Hull(const MatterRange& a, const MatterRange& b) {
  if (a.empty()) return b;
  if (b.empty()) return a;
  return {std::min(a.begin, b.begin), std::max(a.end, b.end)};
}

}  // namespace slabstream
#endif

HWY_BEFORE_NAMESPACE();
namespace slabstream::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

// to[x][y] = from[y][x] for x < width, y < height; rows are so far apart.
void TurnPlane(const float* __restrict from, std::ptrdiff_t from_row, std::int32_t width, std::int32_t height, float* __restrict to,
               std::ptrdiff_t to_row) {
  const hn::FixedTag<float, 4> d;
  const auto turn_square = [&](const float* at, float* out) HWY_ATTR {
    const auto row = [&](std::int32_t y) HWY_ATTR { return hn::LoadU(d, at + y * from_row); };
    const auto low_even = hn::InterleaveLower(d, row(0), row(2)), low_odd = hn::InterleaveLower(d, row(1), row(3));
    const auto high_even = hn::InterleaveUpper(d, row(0), row(2)), high_odd = hn::InterleaveUpper(d, row(1), row(3));
    hn::StoreU(hn::InterleaveLower(d, low_even, low_odd), d, out);
    hn::StoreU(hn::InterleaveUpper(d, low_even, low_odd), d, out + to_row);
    hn::StoreU(hn::InterleaveLower(d, high_even, high_odd), d, out + 2 * to_row);
    hn::StoreU(hn::InterleaveUpper(d, high_even, high_odd), d, out + 3 * to_row);
  };
  constexpr std::int32_t kRows = 64;  // as many as stay in the cache
  for (std::int32_t y_begin = 0; y_begin < height; y_begin += kRows) {
    const std::int32_t y_end = std::min(y_begin + kRows, height);
    for (std::int32_t x = 0; x < width; x += 4) {
      std::int32_t y = y_begin;
      for (; x + 4 <= width && y + 4 <= y_end; y += 4) turn_square(from + y * from_row + x, to + x * to_row + y);
      for (; y < y_end; ++y) {
        for (std::int32_t i = x; i < std::min(x + 4, width); ++i) to[i * to_row + y] = from[y * from_row + i];
      }
    }
  }
}

// Follows rows [b_begin, b_end) of rays, and writes the voxels between row b and row b + 1 of these. Row b_end is followed, too.
void FollowBand(const Sweep& s, std::int32_t b_begin, std::int32_t b_end) {
  const hn::CappedTag<float, 16> d;
  const auto lanes = std::ptrdiff_t(hn::Lanes(d));
  const auto set = [&](float value) HWY_ATTR { return hn::Set(d, value); };
  const auto lerp = [&](float t, auto a, auto b) HWY_ATTR { return hn::Add(a, hn::Mul(set(t), hn::Sub(b, a))); };
  const double last_shift = (s.planes - 1) * s.shift_u;
  const std::int32_t a_begin = std::min(0, Floor(-last_shift)) - 1;
  const std::int32_t a_end = std::max(0, Floor(-last_shift) + 1) + s.nu + 1;
  const std::ptrdiff_t ray_row = (a_end - a_begin + 2 * kMargin + 15) / 16 * 16;
  AlignedVector<float> rays(std::size_t(ray_row) * std::size_t(b_end - b_begin + 1), 1.0F);
  const auto ray = [&](std::int32_t b) { return rays.data() + std::ptrdiff_t(b - b_begin) * ray_row + kMargin - a_begin; };
  // Of each row of rays, those that have met matter: the others transmit exactly 1.
  std::vector<MatterRange> shaded(std::size_t(b_end - b_begin + 1));
  // What a step through two neighbouring rows of voxels transmits; 1 beside the volume.
  const std::ptrdiff_t voxel_row = (s.nu + 2 * kMargin + 15) / 16 * 16;
  AlignedVector<float> matter(2 * std::size_t(voxel_row), 1.0F);
  const auto load_row = [&](std::int32_t k, std::int32_t j, float* row) HWY_ATTR {
    std::fill_n(row, s.nu, 1.0F);
    const MatterRange range = s.MatterOf(k, j);
    if (range.empty()) return;
    const float* each = s.each + s.RowAt(k, j);
    std::ptrdiff_t i = range.begin / lanes * lanes;
    const auto length = set(s.step);
    for (; i < range.end && i + lanes <= s.nu; i += lanes) {
      hn::StoreU(ExpOfMinus(hn::Mul(hn::LoadU(d, each + i), length)), d, row + i);
    }
    if (i < range.end) {
      HWY_ALIGN float rest[16] = {};
      std::copy_n(each + i, s.nu - i, rest);
      hn::Store(ExpOfMinus(hn::Mul(hn::Load(d, rest), length)), d, rest);
      std::copy_n(rest, s.nu - i, row + i);
    }
  };

  // Adds plane k to the rays.
  const auto add_plane = [&](std::int32_t k) HWY_ATTR {
    const double at_u = k * s.shift_u, at_v = k * s.shift_v;
    const std::int32_t floor_u = Floor(at_u), floor_v = Floor(at_v);
    const auto t_u = float(at_u - floor_u), t_v = float(at_v - floor_v);
    float *below = matter.data() + kMargin, *above = below + voxel_row;
    std::int32_t held = -2;  // the row in `above`
    for (std::int32_t b = b_begin; b <= b_end; ++b) {
      const std::int32_t j = b + floor_v;
      const MatterRange range = Hull(s.MatterOf(k, j), s.MatterOf(k, j + 1));
      if (range.empty()) continue;
      if (held == j) {
        std::swap(below, above);
      } else {
        load_row(k, j, below);
      }
      load_row(k, j + 1, above);
      held = j + 1;
      float* to = ray(b) - floor_u;  // by voxel
      for (std::ptrdiff_t i = range.begin / lanes * lanes - 1; i < range.end; i += lanes) {
        const auto first = lerp(t_v, hn::LoadU(d, below + i), hn::LoadU(d, above + i));
        const auto next = lerp(t_v, hn::LoadU(d, below + i + 1), hn::LoadU(d, above + i + 1));
        hn::StoreU(hn::Mul(hn::LoadU(d, to + i), lerp(t_u, first, next)), d, to + i);
      }
      MatterRange& shaded_rays = shaded[std::size_t(b - b_begin)];
      shaded_rays = Hull(shaded_rays, {range.begin - 1 - floor_u, range.end - floor_u});
    }
  };
  // Writes the band's voxels of plane k.
  const auto write_plane = [&](std::int32_t k) HWY_ATTR {
    const hn::Rebind<std::int32_t, decltype(d)> di;
    const hn::Rebind<std::uint8_t, decltype(d)> db;
    const double at_u = -k * s.shift_u, at_v = -k * s.shift_v;
    const std::int32_t floor_u = Floor(at_u), floor_v = Floor(at_v);
    const auto t_u = float(at_u - floor_u), t_v = float(at_v - floor_v);
    const std::int32_t j_begin = std::max(0, b_begin - floor_v), j_end = std::min(s.nv, b_end - floor_v);
    for (std::int32_t j = j_begin; j < j_end; ++j) {
      const std::int32_t b = j + floor_v;
      const float *below = ray(b) + floor_u, *above = below + ray_row;
      std::uint8_t* const out = s.out + s.RowAt(k, j);
      std::fill_n(out, s.nu, std::uint8_t{255});
      const MatterRange rays_here = Hull(shaded[std::size_t(b - b_begin)], shaded[std::size_t(b + 1 - b_begin)]);
      if (rays_here.empty()) continue;
      const std::ptrdiff_t end = std::min(s.nu, rays_here.end - floor_u);
      for (std::ptrdiff_t i = std::max(0, rays_here.begin - floor_u - 1) / lanes * lanes; i < end; i += lanes) {
        const auto first = lerp(t_v, hn::LoadU(d, below + i), hn::LoadU(d, above + i));
        const auto next = lerp(t_v, hn::LoadU(d, below + i + 1), hn::LoadU(d, above + i + 1));
        const auto lit = hn::Sub(set(1), hn::Mul(set(s.strength), hn::Sub(set(1), lerp(t_u, first, next))));
        const auto bytes = hn::DemoteTo(db, hn::ConvertTo(di, hn::Add(hn::Mul(lit, set(255)), set(0.5F))));
        if (i + lanes <= s.nu) {
          hn::StoreU(bytes, db, out + i);
          continue;
        }
        HWY_ALIGN std::uint8_t rest[16];
        hn::StoreU(bytes, db, rest);
        std::copy_n(rest, s.nu - i, out + i);
      }
    }
  };
  // Half a step and one more, kShadowOffset, lie between a voxel and the matter that shades it.
  for (std::int32_t k = 0; k < s.planes; ++k) {
    if (k >= 2) add_plane(k - 2);
    write_plane(k);
  }
}

}  // namespace slabstream::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace slabstream {
namespace {

HWY_EXPORT(FollowBand);
HWY_EXPORT(TurnPlane);

void Run(const Sweep& sweep) {
  // Rows of rays that any voxel lies on.
  const double last = -(sweep.planes - 1) * sweep.shift_v;
  const std::int32_t begin = std::min(0, Floor(last)), end = std::max(0, Floor(last)) + sweep.nv;
  const std::int32_t bands = (end - begin + kBandRays - 1) / kBandRays;
  ParallelFor(0, bands, [&](std::int32_t band) {
    HWY_DYNAMIC_DISPATCH(FollowBand)(sweep, begin + band * kBandRays, std::min(begin + (band + 1) * kBandRays, end));
  });
}

int SweepAxis(const Extinction& extinction, const Vec3& to_light) {
  const Vec3 steps = Absolute(to_light / extinction.spacing);
  return steps.x > std::max(steps.y, steps.z) ? 0 : steps.y > steps.z ? 1 : 2;
}

// `length`: voxels in a row.
void FindMatter(std::int32_t length, std::int64_t count, LightRows& rows) {
  rows.matter.resize(std::size_t(count));
  ParallelForRanges(std::int64_t{0}, count, 256, [&](std::int64_t begin, std::int64_t end) {
    for (std::int64_t row = begin; row < end; ++row) {
      const float* const each = rows.each + row * length;
      const auto takes_light = [](float extinction) { return extinction > 0; };
      const float* const first = std::find_if(each, each + length, takes_light);
      if (first == each + length) continue;
      const float* last = each + length - 1;
      while (!takes_light(*last)) --last;
      rows.matter[std::size_t(row)] = {std::int32_t(first - each), std::int32_t(last + 1 - each)};
    }
  });
}

}  // namespace

bool SweepsAlongX(const Extinction& extinction, const Vec3& to_light) { return SweepAxis(extinction, to_light) == 0; }

LightRows RowsAlongX(const Extinction& extinction) {
  LightRows rows{.each = extinction.each.data(), .turned = {}, .matter = {}};
  FindMatter(extinction.size.x, std::int64_t{extinction.size.y} * extinction.size.z, rows);
  return rows;
}

LightRows RowsAlongY(const Extinction& extinction) {
  const Index3& size = extinction.size;
  LightRows rows{.each = nullptr, .turned = UnwrittenVector<float>(extinction.each.size()), .matter = {}};
  ParallelFor(0, size.z, [&](std::int32_t z) {
    HWY_DYNAMIC_DISPATCH(TurnPlane)
    (extinction.each.data() + NumberIn(size, {0, 0, z}), size.x, size.x, size.y, rows.turned.data() + std::ptrdiff_t{z} * size.y,
     std::ptrdiff_t{size.z} * size.y);
  });
  rows.each = rows.turned.data();
  FindMatter(size.y, std::int64_t{size.z} * size.x, rows);
  return rows;
}

void FindTransmittance(const Extinction& extinction, const LightRows& rows, const Vec3& to_light, double strength, std::uint8_t* out) {
  const Index3& size = extinction.size;
  const int c = SweepAxis(extinction, to_light);
  const int u = c == 0 ? 1 : 0, v = c == 2 ? 1 : 2;
  // The layout's steps from voxel to voxel.
  Vector3<std::ptrdiff_t> stride = {1, size.x, std::ptrdiff_t{size.x} * size.y};
  if (c == 0) stride = {std::ptrdiff_t{size.y} * size.z, 1, size.y};

  const Vec3 steps = to_light / extinction.spacing;  // towards the light, in voxels
  const double per_plane = std::abs(steps[c]);
  const bool from_above = steps[c] > 0;  // the light is on the side of the last plane
  Sweep sweep{.each = rows.each,
              .matter = rows.matter.data(),
              .nu = size[u],
              .nv = size[v],
              .planes = size[c],
              .row = stride[v],
              .plane = from_above ? -stride[c] : stride[c],
              .first = from_above ? (size[c] - 1) * stride[c] : 0,
              .shift_u = -steps[u] / per_plane,
              .shift_v = -steps[v] / per_plane,
              .step = float(1 / per_plane),
              .strength = float(strength),
              .out = out};
  Run(sweep);
}

}  // namespace slabstream
#endif
