#include "common/image/image_view.h"

#include <algorithm>
#include <cstring>
#include <limits>

#include "common/base/check.h"

namespace slabstream {
namespace {

// What lies in the range of `span`, which is of row y of the frame.
ColumnSpan InRange(ColumnSpan span, const PixelBounds& bounds, std::int64_t y, PixelRange range, std::uint64_t frame_width) {
  const std::uint64_t row_start = std::uint64_t(y) * frame_width;
  const auto column = [&](std::uint64_t index) {
    return (index <= row_start ? 0 : std::int64_t(std::min(index - row_start, frame_width))) - bounds.x_begin;
  };
  const std::int64_t begin = std::max<std::int64_t>(span.begin, column(range.begin));
  const std::int64_t end = std::min<std::int64_t>(span.end, column(range.end));
  return begin < end ? ColumnSpan{std::uint32_t(begin), std::uint32_t(end)} : ColumnSpan{};
}

// `span` without the empty pixels at both ends. `plane` has a value each `stride`; a pixel is empty if that is `empty`.
template <std::size_t stride>
ColumnSpan Narrowed(const float* plane, float empty, ColumnSpan span) {
  const auto is_empty = [&](std::uint32_t x) { return plane[stride * x] == empty; };
  // Tests eight pixels a branch, then the rest one by one.
  const auto are_empty = [&](std::uint32_t x) {
    bool all = true;
    for (std::uint32_t i = 0; i < 8; ++i) all &= is_empty(x + i);
    return all;
  };
  auto [begin, end] = span;
  while (begin + 8 <= end && are_empty(begin)) begin += 8;
  while (begin < end && is_empty(begin)) ++begin;
  while (begin + 8 <= end && are_empty(end - 8)) end -= 8;
  while (begin < end && is_empty(end - 1)) --end;
  return begin < end ? ColumnSpan{begin, end} : ColumnSpan{};
}

// Makes the bounds those of the spans.
void Tighten(ImageView& view) {
  const auto filled = [](const ColumnSpan& row) { return row.begin < row.end; };
  const auto first = std::ranges::find_if(view.rows, filled);
  if (first == view.rows.end()) {
    view = {.format = view.format};
    return;
  }
  const auto last = std::find_if(view.rows.rbegin(), view.rows.rend(), filled);
  const auto above = std::size_t(first - view.rows.begin()), below = std::size_t(last - view.rows.rbegin());
  view.rows.erase(view.rows.end() - std::ptrdiff_t(below), view.rows.end());
  view.rows.erase(view.rows.begin(), view.rows.begin() + std::ptrdiff_t(above));
  std::uint32_t left = std::numeric_limits<std::uint32_t>::max(), right = 0;
  for (const ColumnSpan& row : view.rows) {
    if (!filled(row)) continue;
    left = std::min(left, row.begin);
    right = std::max(right, row.end);
  }
  for (ColumnSpan& row : view.rows) row = filled(row) ? ColumnSpan{row.begin - left, row.end - left} : ColumnSpan{};
  view.bounds = {view.bounds.x_begin + std::int32_t(left), view.bounds.y_begin + std::int32_t(above),
                 view.bounds.x_begin + std::int32_t(right), view.bounds.y_end - std::int32_t(below)};
  const std::size_t first_pixel = above * view.stride + left;
  view.rgba += 4 * first_pixel;
  if (HasDepth(view.format)) view.depth += first_pixel;
  if (HasVoxel(view.format)) view.voxel += first_pixel;
}

}  // namespace

std::size_t ImageView::pixel_bytes() const {
  std::size_t pixels = 0;
  for (const ColumnSpan& row : rows) pixels += row.end - row.begin;
  return 4 * sizeof(float) * pixels;
}

ImageView ViewOf(const LocalImage& image) {
  ImageView view{.format = image.format, .bounds = image.bounds};
  if (image.bounds.empty()) return view;
  view.rgba = image.rgba.data();
  if (HasDepth(image.format)) view.depth = image.depth.data();
  if (HasVoxel(image.format)) view.voxel = image.voxel.data();
  view.stride = std::size_t(image.bounds.width());
  view.rows = image.rows;
  if (view.rows.empty()) view.rows.assign(std::size_t(image.bounds.height()), {0, std::uint32_t(image.bounds.width())});
  return view;
}

ImageView ViewOf(const LocalImage& image, PixelRange range, std::int32_t frame_width) {
  ImageView view = ViewOf(image);
  const PixelBounds& bounds = image.bounds;
  CHECK(bounds.empty() || (bounds.x_begin >= 0 && bounds.y_begin >= 0 && bounds.x_end <= frame_width)) << "the image leaves the frame";
  for (std::size_t y = 0; y < view.rows.size(); ++y) {
    const ColumnSpan span = InRange(view.rows[y], bounds, bounds.y_begin + std::int64_t(y), range, std::uint64_t(frame_width));
    const std::size_t row = y * view.stride;
    view.rows[y] = HasDepth(view.format) ? Narrowed<1>(view.depth + row, std::numeric_limits<float>::infinity(), span)
                                         : Narrowed<4>(view.rgba + 4 * row + 3, 0, span);
  }
  Tighten(view);
  return view;
}

std::optional<RunImageHeader> DenseHeader(const ImageView& view) {
  const auto width = std::size_t(view.bounds.width()), height = std::size_t(view.bounds.height());
  const ColumnSpan whole = {0, std::uint32_t(width)};
  if (HasDepth(view.format) || view.bounds.empty() || view.stride != width) return std::nullopt;
  if (!std::ranges::all_of(view.rows, [&](const ColumnSpan& row) { return row == whole; })) return std::nullopt;
  constexpr std::size_t kSamples = 32, kMostEmpty = 16;  // samples along a side; at most one in so many is empty
  const std::size_t samples_x = std::min(kSamples, width), samples_y = std::min(kSamples, height);
  std::size_t empty = 0;
  for (std::size_t j = 0; j < samples_y; ++j) {
    const std::size_t row = (2 * j + 1) * height / (2 * samples_y) * width;
    for (std::size_t i = 0; i < samples_x; ++i) {
      empty += std::size_t(view.rgba[4 * (row + (2 * i + 1) * width / (2 * samples_x)) + 3] == 0);
    }
  }
  if (kMostEmpty * empty > samples_x * samples_y) return std::nullopt;
  return RunImageHeader{.format = view.format, .bounds = view.bounds, .pixel_count = std::uint64_t(view.bounds.pixel_count())};
}

void Clip(ImageView& view, PixelRange range, std::int32_t frame_width) {
  for (std::size_t y = 0; y < view.rows.size(); ++y) {
    view.rows[y] = InRange(view.rows[y], view.bounds, view.bounds.y_begin + std::int64_t(y), range, std::uint64_t(frame_width));
  }
  Tighten(view);
}

LocalImage CopyOf(const ImageView& view) {
  LocalImage image = MakeUnwrittenImage(view.format, view.bounds);
  image.rows = view.rows;
  const auto width = std::size_t(view.bounds.width());
  for (std::size_t y = 0; y < view.rows.size(); ++y) {
    const ColumnSpan& row = view.rows[y];
    const std::size_t source = y * view.stride + row.begin, target = y * width + row.begin, count = row.end - row.begin;
    std::memcpy(image.rgba.data() + 4 * target, view.rgba + 4 * source, 4 * sizeof(float) * count);
    if (HasDepth(view.format)) std::memcpy(image.depth.data() + target, view.depth + source, sizeof(float) * count);
    if (HasVoxel(view.format)) std::memcpy(image.voxel.data() + target, view.voxel + source, sizeof(std::uint32_t) * count);
  }
  return image;
}

}  // namespace slabstream
