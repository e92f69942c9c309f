#include "worker/shapes/tile_coding.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "common/base/log.h"
#include "worker/shapes/drawn_tiles.h"

namespace slabstream {
namespace {

constexpr std::uint32_t kEnds = 128;
static_assert(kMostShapeFragments < kEnds && sizeof(ShapeFragment) == 5 * sizeof(float));

bool IsOpaque(const ShapeFragment& fragment) { return fragment.rgba[3] == 1; }

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

// Fragments whose colours are left out.
std::size_t WithoutColor(const ShapeTile& tile, bool colors) {
  return colors ? 0 : std::size_t(std::ranges::count_if(tile.ends, [](float depth) { return depth != kRayGoesOn; }));
}

}  // namespace

std::size_t BytesOf(const ShapeTile& tile, bool colors) {
  if (tile.fragments.empty()) return 0;
  const std::size_t without = WithoutColor(tile, colors);
  return tile.ends.size() + (tile.fragments.size() - without) * sizeof(ShapeFragment) + without * sizeof(float);
}

void AppendTile(const ShapeTile& tile, bool colors, PooledVector<std::byte>& bytes) {
  if (tile.fragments.empty()) return;
  const std::size_t begin = bytes.size(), pixels = tile.ends.size(), first = begin + pixels;
  bytes.resize(begin + BytesOf(tile, colors));
  std::byte* to = &bytes[first];
  if (colors) {
    for (std::size_t pixel = 0; pixel < pixels; ++pixel) bytes[begin + pixel] = std::byte(tile.begin[pixel + 1] - tile.begin[pixel]);
    std::memcpy(to, tile.fragments.data(), tile.fragments.size() * sizeof(ShapeFragment));
    return;
  }
  std::byte* depth = to + (tile.fragments.size() - WithoutColor(tile, colors)) * sizeof(ShapeFragment);
  for (std::size_t pixel = 0; pixel < pixels; ++pixel) {
    const bool ends = tile.ends[pixel] != kRayGoesOn;
    const std::uint32_t count = tile.begin[pixel + 1] - tile.begin[pixel] - (ends ? 1 : 0);
    bytes[begin + pixel] = std::byte(ends ? count + kEnds : count);
    if (count > 0) std::memcpy(to, &tile.fragments[tile.begin[pixel]], count * sizeof(ShapeFragment));
    to += count * sizeof(ShapeFragment);
    if (!ends) continue;
    std::memcpy(depth, &tile.ends[pixel], sizeof(float));
    depth += sizeof(float);
  }
}

Result<ShapeTile> ReadTile(std::span<const std::byte> bytes, const PixelBounds& pixels) {
  ShapeTile tile{.pixels = pixels};
  if (bytes.empty()) return tile;
  const auto pixel_count = std::size_t(pixels.pixel_count());
  if (bytes.size() < pixel_count) return Status::DataLoss(fmt::format("{} bytes of {} pixels", bytes.size(), pixel_count));
  tile.begin.resize(pixel_count + 1);
  std::uint32_t most = 0, ends = 0;
  for (std::size_t pixel = 0; pixel < pixel_count; ++pixel) {
    const auto code = std::uint32_t(bytes[pixel]), end = code / kEnds, count = code % kEnds + end;
    most = std::max(most, count);
    ends += end;
    tile.begin[pixel + 1] = tile.begin[pixel] + count;
  }
  if (most > kMostShapeFragments) return Status::DataLoss(fmt::format("{} fragments of a pixel, at most {}", most, kMostShapeFragments));
  const std::span<const std::byte> rest = bytes.subspan(pixel_count);
  const std::size_t count = tile.begin.back(), colored = count - ends;
  if (rest.size() != colored * sizeof(ShapeFragment) + ends * sizeof(float)) {
    return Status::DataLoss(fmt::format("{} bytes of {} fragments, {} of them without colours", rest.size(), count, ends));
  }
  tile.colors = ends == 0;
  tile.fragments.resize(count);
  tile.ends.assign(pixel_count, kRayGoesOn);
  const std::byte* from = rest.data();
  const std::byte* depth = from + colored * sizeof(ShapeFragment);
  if (ends == 0) {
    std::memcpy(tile.fragments.data(), from, count * sizeof(ShapeFragment));
  } else {
    for (std::size_t pixel = 0; pixel < pixel_count; ++pixel) {
      const auto code = std::uint32_t(bytes[pixel]), of_pixel = code % kEnds;
      if (of_pixel > 0) std::memcpy(&tile.fragments[tile.begin[pixel]], from, of_pixel * sizeof(ShapeFragment));
      from += of_pixel * sizeof(ShapeFragment);
      if (code < kEnds) continue;
      ShapeFragment& end = tile.fragments[tile.begin[pixel + 1] - 1];
      std::memcpy(&end.depth, depth, sizeof(float));
      end.rgba = {0, 0, 0, 1};
      depth += sizeof(float);
    }
  }
  if (!AreFragments(tile.fragments)) return Status::DataLoss("a fragment's depth, colour or opacity");
  std::ptrdiff_t opaque = 0;
  for (std::size_t pixel = 0; pixel < pixel_count; ++pixel) {
    if (tile.begin[pixel] == tile.begin[pixel + 1]) continue;
    const ShapeFragment& last = tile.fragments[tile.begin[pixel + 1] - 1];
    if (!IsOpaque(last)) continue;
    tile.ends[pixel] = last.depth;
    ++opaque;
  }
  if (std::ranges::count_if(tile.fragments, IsOpaque) != opaque) return Status::DataLoss("an opaque fragment in front of another one");
  return tile;
}

std::optional<ShapeTile> DrawnTiles::Take(std::uint32_t tile, const PixelBounds& pixels) {
  std::unique_lock lock(mutex_);
  const auto taken = tiles_.extract(tile);
  lock.unlock();
  if (taken.empty()) return std::nullopt;
  Result<ShapeTile> read = ReadTile(taken.mapped().span(), pixels);
  if (read.ok()) return *std::move(read);
  LogWarning(fmt::format("shapes: tile {} of another worker is drawn here: {}", tile, read.status().message()));
  return std::nullopt;
}

}  // namespace slabstream
