#include "worker/shapes/tile_coding.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

namespace slabstream {
namespace {

static_assert(kMostShapeFragments <= 255 && sizeof(ShapeFragment) == 5 * sizeof(float));

// Without branches: there are as many fragments as pixels, or more.
bool AreFragments(std::span<const ShapeFragment> fragments) {
  constexpr float kMost = std::numeric_limits<float>::max();
  bool all = true;
  for (const ShapeFragment& fragment : fragments) {
    const auto& [red, green, blue, alpha] = fragment.rgba;
    all &= std::abs(fragment.depth) <= kMost;
    all &= std::abs(red) <= kMost;
    all &= std::abs(green) <= kMost;
    all &= std::abs(blue) <= kMost;
    all &= alpha > 0;
    all &= alpha <= 1;
  }
  return all;
}

}  // namespace

std::size_t BytesOf(const ShapeTile& tile) {
  return tile.fragments.empty() ? 0 : BytesOfCounts(tile.ends.size()) + tile.fragments.size() * sizeof(ShapeFragment);
}

void AppendTile(const ShapeTile& tile, PooledVector<std::byte>& bytes) {
  if (tile.fragments.empty()) return;
  const std::size_t begin = bytes.size(), pixel_count = tile.ends.size();
  bytes.resize(begin + BytesOf(tile));
  for (std::size_t pixel = 0; pixel < pixel_count; ++pixel) bytes[begin + pixel] = std::byte(tile.begin[pixel + 1] - tile.begin[pixel]);
  std::memcpy(&bytes[begin + BytesOfCounts(pixel_count)], tile.fragments.data(), tile.fragments.size() * sizeof(ShapeFragment));
}

Result<ShapeTile> ReadTile(std::span<const std::byte> bytes, const PixelBounds& pixels) {
  ShapeTile tile{.pixels = pixels};
  if (bytes.empty()) return tile;
  const auto pixel_count = std::size_t(pixels.pixel_count());
  if (bytes.size() < BytesOfCounts(pixel_count)) return Status::DataLoss(fmt::format("{} bytes of {} pixels", bytes.size(), pixel_count));
  tile.begin.resize(pixel_count + 1);
  std::uint32_t most = 0;
  for (std::size_t pixel = 0; pixel < pixel_count; ++pixel) {
    const auto count = std::uint32_t(bytes[pixel]);
    most = std::max(most, count);
    tile.begin[pixel + 1] = tile.begin[pixel] + count;
  }
  if (most > kMostShapeFragments) return Status::DataLoss(fmt::format("{} fragments of a pixel, at most {}", most, kMostShapeFragments));
  const std::span<const std::byte> rest = bytes.subspan(BytesOfCounts(pixel_count));
  const std::size_t count = tile.begin.back();
  if (rest.size() != count * sizeof(ShapeFragment)) return Status::DataLoss(fmt::format("{} bytes of {} fragments", rest.size(), count));
  tile.fragments.resize(count);
  std::memcpy(tile.fragments.data(), rest.data(), rest.size());
  if (!AreFragments(tile.fragments)) return Status::DataLoss("a fragment's depth, colour or opacity");
  tile.ends.assign(pixel_count, kRayGoesOn);
  std::ptrdiff_t opaque = 0;
  for (std::size_t pixel = 0; pixel < pixel_count; ++pixel) {
    if (tile.begin[pixel] == tile.begin[pixel + 1]) continue;
    const ShapeFragment& last = tile.fragments[tile.begin[pixel + 1] - 1];
    if (last.rgba[3] != 1) continue;
    tile.ends[pixel] = last.depth;
    ++opaque;
  }
  if (std::ranges::count_if(tile.fragments, [](const ShapeFragment& fragment) { return fragment.rgba[3] == 1; }) != opaque) {
    return Status::DataLoss("an opaque fragment in front of another one");
  }
  return tile;
}

}  // namespace slabstream
