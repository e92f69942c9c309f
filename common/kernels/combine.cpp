#include "common/kernels/combine.h"

#include <cstring>
#include <utility>

#include "common/base/check.h"
#include "common/image/run_payload.h"

namespace slabstream {
namespace {

// A stretch of pixels of one row, to read or to write.
template <class Float, class Index>
struct Pixels {
  Float* rgba;
  Float* depth;  // kDepth only
  Index* voxel;  // kDepth only
};
using SourcePixels = Pixels<const float, const std::uint32_t>;
using TargetPixels = Pixels<float, std::uint32_t>;

std::size_t IndexOf(const PixelBounds& bounds, std::int32_t x, std::int32_t y) {
  return std::size_t(y - bounds.y_begin) * std::size_t(bounds.width()) + std::size_t(x - bounds.x_begin);
}

TargetPixels At(LocalImage& image, std::size_t pixel) {
  if (image.format == PixelFormat::kRgba) return {&image.rgba[4 * pixel], nullptr, nullptr};
  return {&image.rgba[4 * pixel], &image.depth[pixel], &image.voxel[pixel]};
}

SourcePixels At(const LocalImage& image, std::size_t pixel) {
  if (image.format == PixelFormat::kRgba) return {&image.rgba[4 * pixel], nullptr, nullptr};
  return {&image.rgba[4 * pixel], &image.depth[pixel], &image.voxel[pixel]};
}

void NearestRow(const SourcePixels& source, const TargetPixels& target, std::size_t count) {
  for (std::size_t i = 0; i < count; ++i) {
    if (!NearerDepth(source.depth[i], source.voxel[i], target.depth[i], target.voxel[i])) continue;
    std::memcpy(target.rgba + 4 * i, source.rgba + 4 * i, kRgbaBytes);
    target.depth[i] = source.depth[i];
    target.voxel[i] = source.voxel[i];
  }
}

// Both have depths, or neither.
void CombineRow(const SourcePixels& source, Side side, const TargetPixels& target, std::size_t count) {
  if (source.depth != nullptr && target.depth != nullptr) {
    NearestRow(source, target, count);
  } else if (side == Side::kFront) {
    OverRow(source.rgba, target.rgba, target.rgba, count);
  } else {
    OverRow(target.rgba, source.rgba, target.rgba, count);
  }
}

void CopyRow(const SourcePixels& source, const TargetPixels& target, std::size_t count) {
  std::memcpy(target.rgba, source.rgba, kRgbaBytes * count);
  if (source.depth == nullptr) return;
  std::memcpy(target.depth, source.depth, sizeof(float) * count);
  std::memcpy(target.voxel, source.voxel, sizeof(std::uint32_t) * count);
}

void GrowToHold(LocalImage& image, const PixelBounds& bounds) {
  if (image.bounds.Contains(bounds)) return;
  LocalImage grown = MakeLocalImage(image.format, Union(image.bounds, bounds));
  const LocalImage& old = image;
  if (!old.bounds.empty()) {
    for (std::int32_t y = old.bounds.y_begin; y < old.bounds.y_end; ++y) {
      CopyRow(At(old, IndexOf(old.bounds, old.bounds.x_begin, y)), At(grown, IndexOf(grown.bounds, old.bounds.x_begin, y)),
              std::size_t(old.bounds.width()));
    }
  }
  image = std::move(grown);
}

}  // namespace

void Combine(LocalImage& image, const LocalImage& other, Side side) {
  CHECK_EQ(int(image.format), int(other.format));
  if (other.bounds.empty()) return;
  GrowToHold(image, other.bounds);
  for (std::int32_t y = other.bounds.y_begin; y < other.bounds.y_end; ++y) {
    CombineRow(At(other, IndexOf(other.bounds, other.bounds.x_begin, y)), side, At(image, IndexOf(image.bounds, other.bounds.x_begin, y)),
               std::size_t(other.bounds.width()));
  }
}

void CombineRuns(LocalImage& image, const RunImageHeader& header, std::span<const std::byte> payload, Side side) {
  CHECK_EQ(int(image.format), int(header.format));
  if (header.run_count == 0) return;
  GrowToHold(image, header.bounds);

  // A run is copied to where kernels may read it; it fits the cache.
  LocalImage scratch = MakeLocalImage(header.format, {0, 0, header.bounds.width(), 1});
  const TargetPixels pixels = At(scratch, 0);
  const RunPayload runs(header, payload);
  std::size_t first = 0;
  for (std::uint32_t i = 0; i < header.run_count; ++i) {
    const Run run = runs.ReadRun(i);
    runs.ReadRgba(first, run.pixel_count, pixels.rgba);
    if (pixels.depth != nullptr) {
      runs.ReadDepth(first, run.pixel_count, pixels.depth);
      runs.ReadVoxel(first, run.pixel_count, pixels.voxel);
    }
    const std::size_t target =
        IndexOf(image.bounds, header.bounds.x_begin + std::int32_t(run.column), header.bounds.y_begin + std::int32_t(run.row));
    CombineRow({pixels.rgba, pixels.depth, pixels.voxel}, side, At(image, target), run.pixel_count);
    first += run.pixel_count;
  }
}

}  // namespace slabstream
