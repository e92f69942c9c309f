#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "common/kernels/resample.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <hwy/cache_control.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "common/kernels/resample.h"
#include "common/kernels/resample_geometry.h"

HWY_BEFORE_NAMESPACE();
namespace slabstream::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using PixelTag = hn::FixedTag<float, 4>;  // one pixel
// Up to four neighbouring pixels of a row.
using PixelsTag = hn::FixedTag<float, HWY_HAVE_SCALABLE ? 4 : HWY_MIN(std::size_t{16}, HWY_MAX_BYTES / sizeof(float))>;

constexpr double kSplineReach = 1.5;  // half of a narrow spline's width

// Some neighbouring pixels of a row of the picture: where they lie in the frame, and, if none of their splines is wider than 3 pixels, the
// first pixel and the weights of each.
constexpr std::int32_t kBatch = 16;
struct Places {
  HWY_ALIGN double x[kBatch], y[kBatch];
  bool narrow = false;  // no spline is wider than 3 pixels; needed by the members below
  bool inside = false;  // all pixels of the frame that they read lie on the image
  bool empty = false;   // none of the splines reaches the image
  HWY_ALIGN std::int32_t first_x[kBatch], first_y[kBatch];
  HWY_ALIGN float weight_x[4 * kBatch + 16];  // of the three pixels and a 0, pixel after pixel; then room to read beyond
  HWY_ALIGN float weight_y[3][kBatch];
};

// Weights of narrow splines at the places `at` (pixel centres: + 1/2): store(i, first pixels, the three weights) for each vector.
template <class Store>
HWY_INLINE void NarrowSpline(const double* HWY_RESTRICT at, Store&& store) {
  const hn::CappedTag<double, 8> d;
  const hn::Rebind<float, decltype(d)> df;
  const hn::Rebind<std::int32_t, decltype(d)> di;
  const auto half = hn::Set(df, 0.5F), most = hn::Set(df, 0.75F);
  for (std::int32_t i = 0; i < kBatch; i += std::int32_t(hn::Lanes(d))) {
    const auto place = hn::Load(d, at + i), nearest = hn::Floor(place);  // the pixel that holds the point
    const auto t = hn::Sub(hn::DemoteTo(df, hn::Sub(place, nearest)), half);
    const auto left = hn::Sub(half, t), right = hn::Add(half, t);
    store(i, hn::Sub(hn::DemoteTo(di, nearest), hn::Set(di, 1)), hn::Mul(half, hn::Mul(left, left)), hn::NegMulAdd(t, t, most),
          hn::Mul(half, hn::Mul(right, right)));
  }
}

template <class D>
HWY_INLINE double Least(D d, hn::Vec<D> values) {
  return hn::GetLane(hn::MinOfLanes(d, values));
}
template <class D>
HWY_INLINE double Largest(D d, hn::Vec<D> values) {
  return hn::GetLane(hn::MaxOfLanes(d, values));
}

// Whether all pixels that a narrow spline reads lie on the image: three, and a fourth with weight 0.
HWY_INLINE bool IsInside(const PixelBounds& image, const Places& places, std::int32_t i) {
  constexpr double kReach = 3;
  return places.x[i] >= image.x_begin + kReach && places.x[i] <= image.x_end - kReach && places.y[i] >= image.y_begin + kReach &&
         places.y[i] <= image.y_end - kReach;
}

// Finds the places of pixels x_begin, x_begin + 1, ... of row y, as ResampleAt does, in vectors. Affine: W is the same everywhere.
template <bool affine>
HWY_INLINE void FindPlaces(const ProjectiveMap& map, const PixelBounds& image, std::int32_t x_begin, std::int32_t y, Places& places) {
  const hn::CappedTag<double, 8> d;
  const hn::Rebind<float, decltype(d)> df;
  const hn::Rebind<std::int32_t, decltype(d)> di;
  const auto one = hn::Set(d, 1.0), zero = hn::Zero(d);
  auto widest = zero, least_w = one;  // widest: the square of the steepest gradient
  // Of the places.
  auto left = hn::Set(d, kFarthestPlace), right = hn::Neg(left), top = left, bottom = right;
  for (std::int32_t i = 0; i < kBatch; i += std::int32_t(hn::Lanes(d))) {
    const auto x = hn::Add(hn::Iota(d, double(i)), hn::Set(d, x_begin + 0.5));
    const auto row = [&](std::size_t r) HWY_ATTR {
      return hn::MulAdd(hn::Set(d, map[3 * r]), x, hn::Set(d, map[3 * r + 1] * (y + 0.5) + map[3 * r + 2]));
    };
    const auto w = affine ? hn::Set(d, map[8]) : row(2);
    const auto per_w = hn::Div(one, hn::IfThenElse(hn::Gt(w, zero), w, one));
    const auto square = [&](std::size_t r, auto at) HWY_ATTR {
      auto dx = hn::Set(d, map[3 * r]), dy = hn::Set(d, map[3 * r + 1]);
      if constexpr (!affine) dx = hn::NegMulAdd(at, hn::Set(d, map[6]), dx), dy = hn::NegMulAdd(at, hn::Set(d, map[7]), dy);
      dx = hn::Mul(dx, per_w), dy = hn::Mul(dy, per_w);
      return hn::MulAdd(dx, dx, hn::Mul(dy, dy));
    };
    const auto at_x = hn::Mul(row(0), per_w), at_y = hn::Mul(row(1), per_w);
    hn::Store(at_x, d, places.x + i);
    hn::Store(at_y, d, places.y + i);
    widest = hn::Max(widest, hn::Max(square(0, at_x), square(1, at_y)));
    least_w = hn::Min(least_w, w);
    left = hn::Min(left, at_x), right = hn::Max(right, at_x);
    top = hn::Min(top, at_y), bottom = hn::Max(bottom, at_y);
  }
  constexpr double kSteepest = (1 + kSkewSlack) * (1 + kSkewSlack);
  const bool seen = hn::AllTrue(d, hn::Gt(least_w, zero));
  places.narrow = seen && hn::AllTrue(d, hn::Le(widest, hn::Set(d, kSteepest)));
  const double reach = kSplineReach * (places.narrow ? 1 : std::sqrt(std::max(1.0, Largest(d, widest))));
  places.empty = seen && (Largest(d, right) + reach < image.x_begin || Least(d, left) - reach > image.x_end ||
                          Largest(d, bottom) + reach < image.y_begin || Least(d, top) - reach > image.y_end);
  if (places.empty || !places.narrow) return;
  places.inside = IsInside(image, places, 0) && IsInside(image, places, kBatch - 1);  // a line stays a line, so its ends suffice
  NarrowSpline(places.x, [&](std::int32_t i, auto first, auto before, auto middle, auto after) HWY_ATTR {
    hn::Store(first, di, places.first_x + i);
    hn::StoreInterleaved4(before, middle, after, hn::Zero(df), df, places.weight_x + 4 * i);
  });
  NarrowSpline(places.y, [&](std::int32_t i, auto first, auto upper, auto middle, auto lower) HWY_ATTR {
    hn::Store(first, di, places.first_y + i);
    hn::Store(upper, df, places.weight_y[0] + i);
    hn::Store(middle, df, places.weight_y[1] + i);
    hn::Store(lower, df, places.weight_y[2] + i);
  });
}

// The part of a spline that lies on the pixels [low, high): weights of the pixels first, first + 1, ...
struct Spline {
  std::int32_t first = 0, taps = 0;
  std::vector<float> weight;

  void Place(double at, double scale, std::int32_t low, std::int32_t high) {
    const double spline_begin = std::ceil(at - 1.5 * scale - 0.5), spline_end = std::floor(at + 1.5 * scale - 0.5) + 1;
    const double begin = std::max<double>(low, spline_begin), end = std::min<double>(high, spline_end);
    first = std::int32_t(begin);
    taps = std::max(0, std::int32_t(end) - first);
    if (taps == 0) return;
    weight.resize(std::size_t(taps));
    const double per_scale = 1 / scale;
    const auto value = [&](double pixel) { return QuadraticSpline((pixel + 0.5 - at) * per_scale); };
    // The usual case: the whole spline lies there, so the sum of its weights is at hand.
    const bool whole = begin == spline_begin && end == spline_end;
    double sum = 0;
    for (std::int32_t i = 0; i < taps; ++i) {
      const double w = value(begin + i);
      weight[std::size_t(i)] = float(w);
      sum += w;
    }
    const auto per_sum = float(1 / (whole ? sum : SplineSum(at, scale)));
    for (float& w : weight) w *= per_sum;
  }
};

// Resamples one pixel, at any place and width.
void ResampleOne(const LocalImage& frame, const ResamplePoint& point, Spline& along_x, Spline& along_y, float* out) {
  const PixelTag d;
  const PixelBounds& b = frame.bounds;
  if (!point.seen || !IsNear(point.x, point.y)) return;
  along_x.Place(point.x, point.scale_x, b.x_begin, b.x_end);
  if (along_x.taps == 0) return;
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

// The sum of the pixels in a vector.
template <class Vector>
HWY_INLINE hn::Vec<PixelTag> SumOfPixels(Vector pixels) {
  if constexpr (sizeof(pixels) == sizeof(hn::Vec<PixelTag>)) {
    return pixels;
  } else {
    const hn::Half<hn::DFromV<Vector> > half;
    return SumOfPixels(hn::Add(hn::LowerHalf(half, pixels), hn::UpperHalf(half, pixels)));
  }
}

// Resamples pixels [begin, end) of the batch, all of them inside. `out`: of the batch's first pixel.
HWY_INLINE void ResampleNarrow(const LocalImage& frame, const Places& places, std::int32_t begin, std::int32_t end,
                               float* HWY_RESTRICT out) {
  const PixelsTag d;
  constexpr std::size_t kTapFloats = 12;
  HWY_ALIGN static constexpr std::int32_t kPixelOfFloat[16] = {0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2, 3, 3, 3, 3};
  const PixelBounds& b = frame.bounds;
  const auto row_floats = 4 * std::ptrdiff_t{b.width()};
  const float* const pixels = frame.rgba.data();
  for (std::int32_t n = begin; n < end; ++n) {
    const float* HWY_RESTRICT first =
        pixels + (places.first_y[n] - b.y_begin) * row_floats + 4 * std::ptrdiff_t{places.first_x[n] - b.x_begin};
    const auto upper = hn::Set(d, places.weight_y[0][n]), middle = hn::Set(d, places.weight_y[1][n]),
               lower = hn::Set(d, places.weight_y[2][n]);
    const auto weight_x = hn::LoadU(d, places.weight_x + 4 * n);
    auto sum = hn::Zero(d);
    for (std::size_t i = 0; i < kTapFloats; i += hn::Lanes(d)) {
      const float* const pixel = first + i;
      auto columns = hn::Mul(upper, hn::LoadU(d, pixel));
      columns = hn::MulAdd(middle, hn::LoadU(d, pixel + row_floats), columns);
      columns = hn::MulAdd(lower, hn::LoadU(d, pixel + 2 * row_floats), columns);
      sum = hn::MulAdd(hn::TableLookupLanes(weight_x, hn::SetTableIndices(d, kPixelOfFloat + i)), columns, sum);
    }
    hn::Store(SumOfPixels(sum), PixelTag(), out + 4 * n);
  }
}

// Prefetches about what the next batch of the row will read. The rows above and below fetch their own middle rows, and a line of the cache
// holds four pixels.
HWY_INLINE void FetchNext(const LocalImage& frame, const Places& places) {
  const PixelBounds& b = frame.bounds;
  constexpr double kBatchesPerSpan = double(kBatch) / (kBatch - 1);
  const auto step_x = std::int32_t((places.x[kBatch - 1] - places.x[0]) * kBatchesPerSpan),
             step_y = std::int32_t((places.y[kBatch - 1] - places.y[0]) * kBatchesPerSpan);
  for (std::int32_t n = 0; n < kBatch; n += 3) {
    const std::int32_t column = std::clamp(places.first_x[n] + 1 + step_x, b.x_begin, b.x_end - 1) - b.x_begin;
    const std::int32_t row = std::clamp(places.first_y[n] + 1 + step_y, b.y_begin, b.y_end - 1) - b.y_begin;
    hwy::Prefetch(&frame.rgba[4 * (std::size_t(row) * std::size_t(b.width()) + std::size_t(column))]);
  }
}

template <bool affine>
void ResampleRowsAs(const LocalImage& frame, const ProjectiveMap& frame_from_picture, std::int32_t y_begin, std::int32_t y_end,
                    LocalImage& picture) {
  const PixelBounds& to = picture.bounds;
  Places places;
  Spline along_x, along_y;
  // Works down columns of batches: neighbouring rows read the same lines of the frame, which leaves time to fetch the next column's.
  for (std::int32_t x = to.x_begin; x < to.x_end; x += kBatch) {
    const std::int32_t count = std::min(kBatch, to.x_end - x);
    for (std::int32_t y = y_begin; y < y_end; ++y) {
      FindPlaces<affine>(frame_from_picture, frame.bounds, x, y, places);
      if (places.empty) continue;
      float* out = &picture.rgba[4 * (std::size_t(y - to.y_begin) * std::size_t(to.width()) + std::size_t(x - to.x_begin))];
      if (places.narrow && places.inside) {
        FetchNext(frame, places);
        ResampleNarrow(frame, places, 0, count, out);
        continue;
      }
      for (std::int32_t n = 0; n < count; ++n) {
        if (places.narrow && IsInside(frame.bounds, places, n)) {
          ResampleNarrow(frame, places, n, n + 1, out);
        } else {
          ResampleOne(frame, ResampleAt(frame_from_picture, x + n + 0.5, y + 0.5), along_x, along_y, out + 4 * n);
        }
      }
    }
  }
}

void ResampleRows(const LocalImage& frame, const ProjectiveMap& frame_from_picture, std::int32_t y_begin, std::int32_t y_end,
                  LocalImage& picture) {
  const bool affine = frame_from_picture[6] == 0 && frame_from_picture[7] == 0;  // of orthographic views
  (affine ? ResampleRowsAs<true> : ResampleRowsAs<false>)(frame, frame_from_picture, y_begin, y_end, picture);
}

}  // namespace slabstream::HWY_NAMESPACE
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
