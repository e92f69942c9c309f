#include "tests/worker/rays/project_reference.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <type_traits>

#include "tests/worker/rays/pixel_ray.h"
#include "tests/worker/rays/whole_weights.h"

namespace slabstream::testing {
namespace {

float Lerp(float t, float a, float b) { return a + t * (b - a); }

// From the finite ones of eight voxels, x fastest, by their weights; not a number if the nearest one is not among them.
float SampleOfFinite(const std::array<float, 8>& voxels, const Float3& fraction) {
  float sum = 0, weights = 0, least = std::numeric_limits<float>::max(), largest = std::numeric_limits<float>::lowest();
  std::size_t nearest = 0;
  for (std::size_t i = 0; i < 3; ++i) nearest += fraction[i] >= 0.5F ? std::size_t{1} << i : 0;
  for (std::size_t corner = 0; corner < 8; ++corner) {
    if (!std::isfinite(voxels[corner])) continue;
    float weight = 1;
    for (std::size_t i = 0; i < 3; ++i) weight *= (corner >> i & 1) != 0 ? fraction[i] : 1 - fraction[i];
    weights += weight;
    sum += voxels[corner] * weight;
    least = std::min(least, voxels[corner]);
    largest = std::max(largest, voxels[corner]);
  }
  return std::isfinite(voxels[nearest]) ? std::clamp(sum / weights, least, largest) : std::numeric_limits<float>::quiet_NaN();
}

template <class T>
float SampleAt(const RayBox& box, const Float3& p, bool nearest) {
  const Float3 floor = {std::floor(p[0]), std::floor(p[1]), std::floor(p[2])};
  const std::int64_t first = std::int64_t{box.slice} * (std::int32_t(floor[2]) - box.origin.z + 1) +
                             std::int64_t{box.row} * (std::int32_t(floor[1]) - box.origin.y + 1) +
                             (std::int32_t(floor[0]) - box.origin.x + 1);
  const auto fraction = [&](std::size_t i) { return nearest ? float(p[i] - floor[i] >= 0.5F) : p[i] - floor[i]; };
  const float u = fraction(0), v = fraction(1), w = fraction(2);
  float least = std::numeric_limits<float>::max(), largest = std::numeric_limits<float>::lowest();
  std::array<float, 8> corners{};
  const auto row = [&](std::int64_t dy, std::int64_t dz) {
    const T* const voxels = reinterpret_cast<const T*>(box.samples) + first + dy * box.row + dz * box.slice;
    const auto a = float(voxels[0]), b = float(voxels[1]);
    const auto at = std::size_t(2 * dy + 4 * dz);
    corners[at] = a, corners[at + 1] = b;
    least = std::min({least, a, b});
    largest = std::max({largest, a, b});
    return Lerp(u, a, b);
  };
  const float low = Lerp(v, row(0, 0), row(1, 0)), high = Lerp(v, row(0, 1), row(1, 1));
  if (std::is_integral_v<T>) {
    double sum = 0;
    for (int corner = 0; corner < 8; ++corner) sum += double(WholeWeight({u, v, w}, corner)) * corners[std::size_t(corner)];
    return float(sum / 16384);
  }
  const float sample = Lerp(w, low, high);
  return std::isfinite(sample) ? std::clamp(sample, least, largest) : SampleOfFinite(corners, {u, v, w});
}

template <class T>
std::array<float, 4> Pixel(const ProjectWork& work, std::int32_t x, std::int32_t y) {
  const RayBox& box = *work.box;
  const PixelRay ray = RayOf(*work.rays, x, y);
  const auto value_of = [&](float sample) { return std::abs(std::clamp((sample - work.values.low) * work.values.scale, 0.0F, 1.0F)); };
  bool found = false;
  float best = 0;
  std::array<float, 4> sums{};
  const std::array<RayPart, 2> parts = PartsOf(work.rays->clip, ray);
  for (std::int32_t k = 0; k < work.rays->sample_count; ++k) {
    const Float3 p = SamplePosition(ray, k);
    bool owned = std::ranges::any_of(parts, [k](const RayPart& part) { return float(k) >= part.begin && float(k) < part.end; });
    for (std::size_t i = 0; i < 3; ++i) owned = owned && p[i] >= box.low[i] && p[i] < box.high[i];
    if (!owned) continue;
    const float sample = SampleAt<T>(box, p, work.nearest);
    if (!std::isfinite(sample)) continue;
    best = found ? std::max(best, work.sign * sample) : work.sign * sample;
    found = true;
    const std::int32_t fixed = std::min(std::int32_t(value_of(sample) * 0x1p24F), 0xFFFFFF);
    sums[0] += float(fixed >> 16);
    sums[1] += float(fixed >> 8 & 0xFF);
    sums[2] += float(fixed & 0xFF);
    sums[3] += 1;
  }
  if (!found) return {};
  if (work.opposite != nullptr) return sums;
  const float value = value_of(work.sign * best);
  return {work.complement ? 1 - value : value, 0, 0, 1};
}

}  // namespace

void ProjectTileReference(const ProjectWork& work, const PixelBounds& tile, float* pixels, std::size_t floats_a_row) {
  VisitScalarType(work.box->type, [&](auto* type) {
    for (std::int32_t y = tile.y_begin; y < tile.y_end; ++y) {
      for (std::int32_t x = tile.x_begin; x < tile.x_end; ++x) {
        const std::array<float, 4> pixel = Pixel<std::remove_cvref_t<decltype(*type)>>(work, x, y);
        std::copy(pixel.begin(), pixel.end(), pixels + std::size_t(y - tile.y_begin) * floats_a_row + 4 * std::size_t(x - tile.x_begin));
      }
    }
  });
}

}  // namespace slabstream::testing
