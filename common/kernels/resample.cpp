#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "common/kernels/resample.cpp"
#include <hwy/foreach_target.h>
// Highway wants this order.
#include <hwy/highway.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "common/kernels/resample.h"
#include "common/kernels/resample_geometry.h"

HWY_BEFORE_NAMESPACE();
namespace slabstream {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

#if HWY_TARGET == HWY_SCALAR

void ResampleRows(const LocalImage& frame, const ProjectiveMap& frame_from_picture, std::int32_t y_begin, std::int32_t y_end,
                  LocalImage& picture) {
  ResampleRowsReference(frame, frame_from_picture, y_begin, y_end, picture);
}

#else

using PixelTag = hn::FixedTag<float, 4>;  // one pixel

// Some neighbouring pixels of a row of the picture: where they lie in the frame, and, if no spline of theirs is wider than 3 pixels, its
// first pixel and weights.
constexpr std::int32_t kBatch = 16;
struct Places {
  HWY_ALIGN double w[kBatch], x[kBatch], y[kBatch], scale_x[kBatch], scale_y[kBatch];
  bool narrow = false;  // all of them, and all taps lie on the image
  std::int32_t first_x[kBatch], first_y[kBatch];
  float weight_x[3][kBatch], weight_y[3][kBatch];

  ResamplePoint Point(std::int32_t i) const { return {w[i] > 0, x[i], y[i], scale_x[i], scale_y[i]}; }
};

HWY_INLINE void NarrowSpline(const double* HWY_RESTRICT at, std::int32_t* HWY_RESTRICT first, float (*HWY_RESTRICT weight)[kBatch]) {
  for (std::int32_t i = 0; i < kBatch; ++i) {  // which the compiler turns into vectors
    const double nearest = std::floor(at[i]);  // the pixel that holds the point
    const auto t = float(at[i] - nearest - 0.5);
    first[i] = std::int32_t(nearest) - 1;
    weight[0][i] = 0.5F * (0.5F - t) * (0.5F - t);
    weight[1][i] = 0.75F - t * t;
    weight[2][i] = 0.5F * (0.5F + t) * (0.5F + t);
  }
}

// Of the pixels x_begin, x_begin + 1, ... of row y: ResampleAt in vectors.
HWY_INLINE void FindPlaces(const ProjectiveMap& map, const PixelBounds& image, std::int32_t x_begin, std::int32_t y, Places& places) {
  const hn::CappedTag<double, 8> d;
  const auto one = hn::Set(d, 1.0), zero = hn::Zero(d);
  auto widest = one, least_w = one;
  for (std::int32_t i = 0; i < kBatch; i += std::int32_t(hn::Lanes(d))) {
    const auto x = hn::Add(hn::Iota(d, double(i)), hn::Set(d, x_begin + 0.5));
    const auto row = [&](std::size_t r) HWY_ATTR {
      return hn::MulAdd(hn::Set(d, map[3 * r]), x, hn::Set(d, map[3 * r + 1] * (y + 0.5) + map[3 * r + 2]));
    };
    const auto w = row(2);
    const auto per_w = hn::Div(one, hn::IfThenElse(hn::Gt(w, zero), w, one));
    const auto scale = [&](std::size_t r, auto at) HWY_ATTR {
      const auto dx = hn::Mul(hn::NegMulAdd(at, hn::Set(d, map[6]), hn::Set(d, map[3 * r])), per_w);
      const auto dy = hn::Mul(hn::NegMulAdd(at, hn::Set(d, map[7]), hn::Set(d, map[3 * r + 1])), per_w);
      return hn::Max(one, hn::Sub(hn::Sqrt(hn::MulAdd(dx, dx, hn::Mul(dy, dy))), hn::Set(d, kSkewSlack)));
    };
    const auto at_x = hn::Mul(row(0), per_w), at_y = hn::Mul(row(1), per_w);
    const auto scale_x = scale(0, at_x), scale_y = scale(1, at_y);
    hn::Store(w, d, places.w + i);
    hn::Store(at_x, d, places.x + i);
    hn::Store(at_y, d, places.y + i);
    hn::Store(scale_x, d, places.scale_x + i);
    hn::Store(scale_y, d, places.scale_y + i);
    widest = hn::Max(widest, hn::Max(scale_x, scale_y));
    least_w = hn::Min(least_w, w);
  }
  const double* const ends_x[2] = {&places.x[0], &places.x[kBatch - 1]};
  const double* const ends_y[2] = {&places.y[0], &places.y[kBatch - 1]};
  constexpr double kReach = 2;
  const auto inside = [](const double* const* ends, std::int32_t begin, std::int32_t end) {  // a line stays a line
    return std::min(*ends[0], *ends[1]) >= begin + kReach && std::max(*ends[0], *ends[1]) <= end - kReach;
  };
  places.narrow = hn::AllTrue(d, hn::Eq(widest, one)) && hn::AllTrue(d, hn::Gt(least_w, zero)) &&
                  inside(ends_x, image.x_begin, image.x_end) && inside(ends_y, image.y_begin, image.y_end);
  if (!places.narrow) return;
  NarrowSpline(places.x, places.first_x, places.weight_x);
  NarrowSpline(places.y, places.first_y, places.weight_y);
}

// The part of a spline that lies on the pixels [low, high): weights of the pixels first, first + 1, ...
struct Spline {
  std::int32_t first = 0, taps = 0;
  std::vector<float> weight;

  void Place(double at, double scale, std::int32_t low, std::int32_t high) {
    const double begin = std::max<double>(low, std::ceil(at - 1.5 * scale - 0.5));
    const double end = std::min<double>(high, std::floor(at + 1.5 * scale - 0.5) + 1);
    first = std::int32_t(begin);
    taps = std::max(0, std::int32_t(end) - first);
    if (taps == 0) return;
    const double per_sum = 1 / SplineSum(at, scale);
    weight.resize(std::size_t(taps));
    for (std::int32_t i = 0; i < taps; ++i) weight[std::size_t(i)] = float(per_sum * QuadraticSpline((begin + i + 0.5 - at) / scale));
  }
};

// Any place and width.
void ResampleOne(const LocalImage& frame, const ResamplePoint& point, Spline& along_x, Spline& along_y, float* out) {
  const PixelTag d;
  const PixelBounds& b = frame.bounds;
  if (!point.seen || !IsNear(point.x, point.y)) return;
  along_x.Place(point.x, point.scale_x, b.x_begin, b.x_end);
  along_y.Place(point.y, point.scale_y, b.y_begin, b.y_end);
  auto sum = hn::Zero(d);
  for (std::int32_t j = 0; j < along_y.taps; ++j) {
    const std::size_t row = std::size_t(along_y.first + j - b.y_begin) * std::size_t(b.width()) + std::size_t(along_x.first - b.x_begin);
    auto row_sum = hn::Zero(d);
    for (std::int32_t i = 0; i < along_x.taps; ++i) {
      row_sum = hn::MulAdd(hn::Set(d, along_x.weight[std::size_t(i)]), hn::Load(d, &frame.rgba[4 * (row + std::size_t(i))]), row_sum);
    }
    sum = hn::MulAdd(hn::Set(d, along_y.weight[std::size_t(j)]), row_sum, sum);
  }
  hn::StoreU(sum, d, out);
}

HWY_INLINE void ResampleNarrow(const LocalImage& frame, const Places& places, std::int32_t count, float* HWY_RESTRICT out) {
  const PixelTag d;
  const PixelBounds& b = frame.bounds;
  const auto row_floats = 4 * std::ptrdiff_t{b.width()};
  const float* const pixels = frame.rgba.data();
  for (std::int32_t n = 0; n < count; ++n, out += 4) {
    const float* HWY_RESTRICT first =
        pixels + (places.first_y[n] - b.y_begin) * row_floats + 4 * std::ptrdiff_t{places.first_x[n] - b.x_begin};
    const auto left = hn::Set(d, places.weight_x[0][n]), middle = hn::Set(d, places.weight_x[1][n]),
               right = hn::Set(d, places.weight_x[2][n]);
    const auto row_sum = [&](const float* pixel) HWY_ATTR {
      return hn::MulAdd(right, hn::Load(d, pixel + 8), hn::MulAdd(middle, hn::Load(d, pixel + 4), hn::Mul(left, hn::Load(d, pixel))));
    };
    auto sum = hn::Mul(hn::Set(d, places.weight_y[0][n]), row_sum(first));
    sum = hn::MulAdd(hn::Set(d, places.weight_y[1][n]), row_sum(first + row_floats), sum);
    hn::Store(hn::MulAdd(hn::Set(d, places.weight_y[2][n]), row_sum(first + 2 * row_floats), sum), d, out);
  }
}

void ResampleRows(const LocalImage& frame, const ProjectiveMap& frame_from_picture, std::int32_t y_begin, std::int32_t y_end,
                  LocalImage& picture) {
  const std::int32_t width = picture.bounds.x_end;
  Places places;
  Spline along_x, along_y;
  for (std::int32_t y = y_begin; y < y_end; ++y) {
    for (std::int32_t x = 0; x < width; x += kBatch) {
      FindPlaces(frame_from_picture, frame.bounds, x, y, places);
      float* out = &picture.rgba[4 * (std::size_t(y) * std::size_t(width) + std::size_t(x))];
      const std::int32_t count = std::min(kBatch, width - x);
      if (places.narrow) {
        ResampleNarrow(frame, places, count, out);
        continue;
      }
      for (std::int32_t n = 0; n < count; ++n) ResampleOne(frame, places.Point(n), along_x, along_y, out + 4 * n);
    }
  }
}

#endif

}  // namespace HWY_NAMESPACE
}  // namespace slabstream
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace slabstream {
HWY_EXPORT(ResampleRows);

void ResampleRows(const LocalImage& frame, const ProjectiveMap& frame_from_picture, std::int32_t y_begin, std::int32_t y_end,
                  LocalImage& picture) {
  HWY_DYNAMIC_DISPATCH(ResampleRows)(frame, frame_from_picture, y_begin, y_end, picture);
}

}  // namespace slabstream
#endif
