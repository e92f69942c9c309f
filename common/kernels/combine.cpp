#include "common/kernels/combine.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cstring>
#include <utility>

#include "common/base/check.h"
#include "common/image/finite.h"
#include "common/image/run_payload.h"
#include "common/parallel/parallel.h"

namespace slabstream {
namespace {

// The index of the first pixel of row y.
std::size_t RowBegin(const PixelBounds& bounds, std::int32_t y) { return std::size_t(y - bounds.y_begin) * std::size_t(bounds.width()); }

TargetPixels At(LocalImage& image, std::size_t pixel) {
  if (!HasDepth(image.format)) return {&image.rgba[4 * pixel], nullptr, nullptr};
  return {&image.rgba[4 * pixel], &image.depth[pixel], &image.voxel[pixel]};
}

SourcePixels At(const ImageView& view, std::size_t pixel) {
  if (!HasDepth(view.format)) return {view.rgba + 4 * pixel, nullptr, nullptr};
  return {view.rgba + 4 * pixel, view.depth + pixel, view.voxel + pixel};
}

// memcpy writes rows without first reading the old contents, which a loop of vectors does not avoid. That saves more than it costs to check
// what was written, which is in the nearest cache.
void CopyRow(const SourcePixels& source, const TargetPixels& target, std::size_t count) {
  std::memcpy(target.rgba, source.rgba, kRgbaBytes * count);
  if (source.depth == nullptr) return;
  std::memcpy(target.depth, source.depth, sizeof(float) * count);
  std::memcpy(target.voxel, source.voxel, sizeof(std::uint32_t) * count);
}

// `ours` with `theirs` on its `side`, all of one format. `target` may be `ours`. False: a value that was computed is not finite.
bool CombineRow(PixelFormat format, const SourcePixels& ours, const SourcePixels& theirs, Side side, const TargetPixels& target,
                std::size_t count) {
  switch (format) {
    case PixelFormat::kRgba: {
      const bool in_front = side == Side::kFront;
      return OverRow(in_front ? theirs.rgba : ours.rgba, in_front ? ours.rgba : theirs.rgba, target.rgba, count);
    }
    case PixelFormat::kDepth:
      if (target.depth != ours.depth) CopyRow(ours, target, count);
      NearestRow(theirs, target, count);
      return true;
    case PixelFormat::kMaximum: return MaximumRow(ours.rgba, theirs.rgba, target.rgba, count);
    case PixelFormat::kSum: return SumRow(ours.rgba, theirs.rgba, target.rgba, count);
    case PixelFormat::kRgbaDepth: break;  // finished pictures do not combine
  }
  CHECK(false) << "images of pixel format " << int(format) << " do not combine";
  return false;
}

ColumnSpan Hull(const ColumnSpan& a, const ColumnSpan& b) {
  if (a.begin == a.end) return b;
  if (b.begin == b.end) return a;
  return {std::min(a.begin, b.begin), std::max(a.end, b.end)};
}

// Pixels of one row, where they are stored, and their columns in the image that they are combined into.
struct RowPixels {
  SourcePixels first;
  ColumnSpan columns;
  SourcePixels At(std::size_t column) const {
    const std::size_t offset = column - columns.begin;
    if (first.depth == nullptr) return {first.rgba + 4 * offset, nullptr, nullptr};
    return {first.rgba + 4 * offset, first.depth + offset, first.voxel + offset};
  }
};

// Whether the pixels to combine have been checked.
enum class Values { kKnown, kUnchecked };

bool AreFinite(const LocalImage& image, std::size_t first, std::size_t count) {
  return AllFinite(std::as_bytes(std::span(image.rgba).subspan(4 * first, 4 * count)));
}

// Writes both to the row of `image` that begins at index `row`: each pixel of their hull once, or not at all if `ours` is there already.
// False: what was written of `theirs`, whose values are unchecked, is no colour or depth. Checks what was written, because `theirs` may
// still change.
template <Values kTheirs>
bool MergeRow(const RowPixels& ours, const RowPixels& theirs, Side side, LocalImage& image, std::size_t row, bool in_place) {
  const ColumnSpan a = ours.columns, b = theirs.columns, hull = Hull(a, b);
  std::array<std::uint32_t, 4> cuts = {a.begin, a.end, b.begin, b.end};
  std::ranges::sort(cuts);
  bool valid = true;
  for (std::size_t i = 0; i + 1 < cuts.size(); ++i) {
    const std::uint32_t begin = std::max(cuts[i], hull.begin), end = std::min(cuts[i + 1], hull.end);
    if (begin >= end) continue;
    const bool in_ours = begin >= a.begin && end <= a.end, in_theirs = begin >= b.begin && end <= b.end;
    if (in_ours && in_theirs) {
      valid &= CombineRow(image.format, ours.At(begin), theirs.At(begin), side, At(image, row + begin), end - begin);
    } else if (in_theirs) {
      CopyRow(theirs.At(begin), At(image, row + begin), end - begin);
      if (kTheirs == Values::kUnchecked && !HasDepth(image.format)) valid &= AreFinite(image, row + begin, end - begin);
    } else if (!in_ours) {
      MakeEmpty(image, row + begin, row + end);
    } else if (!in_place) {
      CopyRow(ours.At(begin), At(image, row + begin), end - begin);
    }
  }
  if (kTheirs == Values::kKnown) return true;
  if (!HasDepth(image.format)) return valid;
  const std::size_t first = row + b.begin, count = b.end - b.begin;
  return AreFinite(image, first, count) && AllDepths(std::span(image.depth).subspan(first, count));
}

RowPixels RowOf(const ImageView& view, std::int32_t y, std::int32_t x_begin) {
  if (view.bounds.empty() || y < view.bounds.y_begin || y >= view.bounds.y_end) return {};
  const ColumnSpan& row = view.rows[std::size_t(y - view.bounds.y_begin)];
  if (row.begin == row.end) return {};
  const auto offset = std::uint32_t(view.bounds.x_begin - x_begin);
  return {At(view, std::size_t(y - view.bounds.y_begin) * view.stride + row.begin), {offset + row.begin, offset + row.end}};
}

// Pixels [first, first + count) of all runs that can be read as floats (RunPayload::AreFloats).
SourcePixels InPlace(const RunImageHeader& header, const RunPayload& runs, std::size_t first, std::size_t count) {
  const auto* const rgba = reinterpret_cast<const float*>(runs.rgba(first, count).data());
  if (!HasDepth(header.format)) return {rgba, nullptr, nullptr};
  return {rgba, reinterpret_cast<const float*>(runs.depth(first, count).data()),
          reinterpret_cast<const std::uint32_t*>(runs.voxel(first, count).data())};
}

// Adds `theirs` to row y of an image that has room for it. False: as MergeRow.
template <Values kTheirs>
bool MergeInPlace(LocalImage& image, std::int32_t y, const RowPixels& theirs, Side side) {
  if (theirs.columns.begin == theirs.columns.end) return true;
  const std::size_t row = RowBegin(image.bounds, y);
  ColumnSpan* const span = image.rows.empty() ? nullptr : &image.rows[std::size_t(y - image.bounds.y_begin)];
  const ColumnSpan columns = span == nullptr ? ColumnSpan{0, std::uint32_t(image.bounds.width())} : *span;
  RowPixels ours;
  if (columns.begin < columns.end) {
    const TargetPixels here = At(image, row + columns.begin);
    ours = {{here.rgba, here.depth, here.voxel}, columns};
  }
  const bool valid = MergeRow<kTheirs>(ours, theirs, side, image, row, true);
  if (span != nullptr) *span = Hull(columns, theirs.columns);
  return valid;
}

// Calls merge(y) for the rows [begin, end), in parallel. Returns false if merge did for one of them; other rows may be left out then.
template <class Merge>
bool AllRows(std::int32_t begin, std::int32_t end, Merge&& merge) {
  constexpr std::int64_t kRowsOfTask = 16;
  std::atomic<bool> valid = true;
  ParallelForRanges(begin, end, kRowsOfTask, [&](std::int32_t first, std::int32_t last) {
    for (std::int32_t y = first; y < last && valid; ++y) {
      if (!merge(y)) valid = false;
    }
  });
  return valid;
}

// False: as MergeRow, and the rest is left out.
template <Values kOther>
bool CombineRows(LocalImage& image, const ImageView& other, Side side, const PixelBounds& room) {
  CHECK_EQ(int(image.format), int(other.format));
  if (other.bounds.empty()) return true;
  if (image.bounds.Contains(other.bounds)) {
    return AllRows(other.bounds.y_begin, other.bounds.y_end,
                   [&](std::int32_t y) { return MergeInPlace<kOther>(image, y, RowOf(other, y, image.bounds.x_begin), side); });
  }
  const LocalImage old = std::move(image);
  const ImageView ours = ViewOf(old);
  CHECK(room.Contains(ours.bounds) && room.Contains(other.bounds));
  image = MakeEmptyRows(old.format, room);
  return AllRows(room.y_begin, room.y_end, [&](std::int32_t y) {
    const RowPixels a = RowOf(ours, y, room.x_begin), b = RowOf(other, y, room.x_begin);
    image.rows[std::size_t(y - room.y_begin)] = Hull(a.columns, b.columns);
    return MergeRow<kOther>(a, b, side, image, RowBegin(room, y), false);
  });
}

}  // namespace

void Combine(LocalImage& image, const LocalImage& other, Side side) {
  Combine(image, ViewOf(other), side, Union(image.bounds, other.bounds));
  FillRows(image);
}

void Combine(LocalImage& image, const ImageView& other, Side side, const PixelBounds& room) {
  (void)CombineRows<Values::kKnown>(image, other, side, room);
}

bool CombineUnchecked(LocalImage& image, const ImageView& other, Side side, const PixelBounds& room) {
  return CombineRows<Values::kUnchecked>(image, other, side, room);
}

void Erase(LocalImage& image, PixelRange pixels, std::int32_t frame_width) {
  const PixelBounds& bounds = image.bounds;
  if (bounds.empty()) return;
  if (image.rows.empty()) image.rows.assign(std::size_t(bounds.height()), {0, std::uint32_t(bounds.width())});
  const auto width = std::uint64_t(frame_width);
  for (std::size_t y = 0; y < image.rows.size(); ++y) {
    const std::uint64_t row = (std::uint64_t(bounds.y_begin) + y) * width;
    const auto column = [&](std::uint64_t index) {  // of a pixel of this row, cut to the bounds
      const auto x = index <= row ? 0 : std::int64_t(std::min(index - row, width));
      return std::uint32_t(std::clamp<std::int64_t>(x, bounds.x_begin, bounds.x_end) - bounds.x_begin);
    };
    ColumnSpan& span = image.rows[y];
    const std::uint32_t begin = std::max(column(pixels.begin), span.begin), end = std::min(column(pixels.end), span.end);
    if (begin >= end) continue;
    if (begin > span.begin && end < span.end) {
      const std::size_t first = y * std::size_t(bounds.width());
      MakeEmpty(image, first + begin, first + end);
    } else {
      span = begin == span.begin ? ColumnSpan{end, span.end} : ColumnSpan{span.begin, begin};
      if (span.begin == span.end) span = {};
    }
  }
}

Status CombineRuns(LocalImage& image, const RunImageHeader& header, std::span<const std::byte> payload, const PixelBounds& frame, Side side,
                   const PixelBounds& room) {
  CHECK_EQ(int(image.format), int(header.format));
  if (Status table = ValidateRunTable(header, payload, frame); !table.ok()) return table;
  if (header.pixel_count == 0) return Status::Ok();
  // First make room for all.
  if (!image.bounds.Contains(header.bounds)) Combine(image, ViewOf(MakeEmptyRows(header.format, header.bounds)), side, room);

  // A run that kernels cannot read in place is copied; it fits the cache.
  const RunPayload runs(header, payload);
  const bool readable = runs.AreFloats(), floats = header.color == ColorCoding::kFloat32 && !HasDepth(header.format);
  LocalImage scratch = MakeUnwrittenImage(header.format, {0, 0, readable ? 0 : header.bounds.width(), 1});
  std::size_t first = 0;
  for (std::uint32_t i = 0; i < runs.run_count(); ++i) {
    const Run run = runs.ReadRun(i);
    // Float colours are checked after combining. That would not show an invalid depth or code.
    if (!floats) {
      if (Status pixels = ValidatePixels(header, runs, first, run.pixel_count); !pixels.ok()) return pixels;
    }
    SourcePixels pixels;
    if (readable) {
      pixels = InPlace(header, runs, first, run.pixel_count);
    } else {
      const TargetPixels copy = At(scratch, 0);
      runs.ReadRgba(first, run.pixel_count, copy.rgba);
      if (copy.depth != nullptr) {
        runs.ReadDepth(first, run.pixel_count, copy.depth);
        runs.ReadVoxel(first, run.pixel_count, copy.voxel);
      }
      pixels = {copy.rgba, copy.depth, copy.voxel};
    }
    const std::uint32_t column = std::uint32_t(header.bounds.x_begin - image.bounds.x_begin) + run.column;
    const std::int32_t y = header.bounds.y_begin + std::int32_t(run.row);
    const RowPixels theirs = {pixels, {column, column + run.pixel_count}};
    if (!floats) {
      (void)MergeInPlace<Values::kKnown>(image, y, theirs, side);
    } else if (!MergeInPlace<Values::kUnchecked>(image, y, theirs, side)) {
      return Status::InvalidArgument("run image: a pixel's colour is not finite, or what it is combined to");
    }
    first += run.pixel_count;
  }
  return Status::Ok();
}

}  // namespace slabstream
