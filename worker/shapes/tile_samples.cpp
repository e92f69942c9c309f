#include "worker/shapes/tile_samples.h"

#include <algorithm>
#include <tuple>

namespace slabstream {

void AddHits(const TileSamples& samples, std::int32_t column, std::int32_t row, std::uint32_t mask,
             const std::array<float, kCellSamples>& keys, Element element, std::vector<ShapeHit>& hits) {
  const int count = samples.count();
  const std::int32_t side = samples.cell_side();
  while (mask != 0) {
    const int pixel = std::countr_zero(mask) / count;
    const std::uint32_t of_pixel = mask >> (pixel * count) & ((1U << count) - 1);
    mask &= ~(of_pixel << (pixel * count));
    float sum = 0, number = 0;
    for (int s = 0; s < count; ++s) {
      if ((of_pixel >> s & 1) == 0) continue;
      sum += keys[std::size_t(pixel * count + s)];
      ++number;
    }
    const std::int32_t x = column * side + pixel % side, y = row * side + pixel / side;
    hits.push_back({std::uint32_t(y * samples.pixels().width() + x), sum / number, element, of_pixel});
  }
}

void KeepNearest(std::vector<ShapeHit>& hits) {
  constexpr std::size_t kPixels = std::size_t{kShapeTile} * kShapeTile;
  std::vector<std::uint32_t> begin(kPixels + 1);
  for (const ShapeHit& hit : hits) ++begin[hit.pixel + std::size_t{1}];
  for (std::size_t i = 1; i <= kPixels; ++i) begin[i] += begin[i - 1];
  std::vector<ShapeHit> sorted(hits.size());
  std::vector<std::uint32_t> end = begin;
  for (const ShapeHit& hit : hits) sorted[end[hit.pixel]++] = hit;
  hits.clear();
  for (std::size_t i = 0; i < kPixels; ++i) {
    const auto first = sorted.begin() + begin[i], last = sorted.begin() + end[i];
    std::sort(first, last, [](const ShapeHit& a, const ShapeHit& b) { return std::tie(a.key, a.element) < std::tie(b.key, b.element); });
    hits.insert(hits.end(), first, first + std::min<std::ptrdiff_t>(last - first, kMostShapeHits));
  }
}

}  // namespace slabstream
