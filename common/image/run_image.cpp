#include "common/image/run_image.h"

#include <algorithm>
#include <cstring>
#include <limits>
#include <string>

#include "common/base/check.h"
#include "common/image/run_payload.h"

namespace slabstream {
namespace {

std::size_t PixelBytes(PixelFormat format) {
  return format == PixelFormat::kDepth ? kRgbaBytes + sizeof(float) + sizeof(std::uint32_t) : kRgbaBytes;
}

// One run and where its pixels lie in the image.
struct PlacedRun {
  Run run;
  std::size_t first_pixel;
};

void Append(PooledVector<std::byte>& out, const void* data, std::size_t bytes) {
  const auto* begin = static_cast<const std::byte*>(data);
  out.insert(out.end(), begin, begin + bytes);
}

// Columns [begin, end), relative to bounds.x_begin, of row y that lie in the range; none if begin >= end.
struct Columns {
  std::int64_t begin, end;
};

Columns ColumnsInRange(const PixelBounds& bounds, std::int64_t y, PixelRange range, std::uint64_t frame_width) {
  const std::uint64_t row_start = std::uint64_t(y) * frame_width;
  const auto column = [&](std::uint64_t index) { return index <= row_start ? 0 : std::int64_t(std::min(index - row_start, frame_width)); };
  return {std::max<std::int64_t>(bounds.x_begin, column(range.begin)) - bounds.x_begin,
          std::min<std::int64_t>(bounds.x_end, column(range.end)) - bounds.x_begin};
}

Status Invalid(const std::string& message) { return Status::InvalidArgument("run image: " + message); }

// Pixels [begin, end).
void MakeEmpty(LocalImage& image, std::size_t begin, std::size_t end) {
  std::fill(image.rgba.data() + 4 * begin, image.rgba.data() + 4 * end, 0.0F);
  if (image.format != PixelFormat::kDepth) return;
  std::fill(image.depth.data() + begin, image.depth.data() + end, std::numeric_limits<float>::infinity());
  std::fill(image.voxel.data() + begin, image.voxel.data() + end, 0U);
}

// `floats`: the bytes of floats, at any address.
bool AllFinite(std::span<const std::byte> floats) {
  constexpr std::size_t kBatch = 16384;  // floats between two looks at what was found
  constexpr std::uint32_t kExponentBits = 0x7F800000U;
  const std::size_t total = floats.size() / sizeof(float);
  for (std::size_t first = 0; first < total; first += kBatch) {
    const std::size_t end = std::min(first + kBatch, total);
    std::uint32_t bad = 0;
    for (std::size_t i = first; i < end; ++i) {
      std::uint32_t bits;
      std::memcpy(&bits, floats.data() + sizeof(bits) * i, sizeof(bits));
      // All bits of the exponent are set for infinities and NaNs alone.
      bad |= std::uint32_t{(bits & kExponentBits) == kExponentBits};
    }
    if (bad != 0) return false;
  }
  return true;
}

// The pixels of one row, [begin, end), that are not empty, as maximal spans: found(begin, end) for each. Empty is where `plane`, which has
// a value each `stride`, is `empty`.
template <std::size_t stride, class Found>
void ForEachSpan(const float* plane, float empty, std::int64_t begin, std::int64_t end, Found&& found) {
  const auto is_empty = [&](std::int64_t x) { return plane[stride * std::size_t(x)] == empty; };
  for (std::int64_t x = begin; x < end;) {
    // Four at a time without a branch each, then what is left of them.
    while (x + 4 <= end && (is_empty(x) & is_empty(x + 1) & is_empty(x + 2) & is_empty(x + 3))) x += 4;
    while (x < end && is_empty(x)) ++x;
    const std::int64_t first = x;
    while (x + 4 <= end && !(is_empty(x) | is_empty(x + 1) | is_empty(x + 2) | is_empty(x + 3))) x += 4;
    while (x < end && !is_empty(x)) ++x;
    if (x > first) found(first, x);
  }
}

}  // namespace

std::size_t PayloadBytes(const RunImageHeader& header) {
  return sizeof(Run) * std::size_t{header.run_count} + PixelBytes(header.format) * std::size_t(header.pixel_count);
}

RunImage EncodeRuns(const LocalImage& image, PixelRange range, std::int32_t frame_width) {
  RunImage result;
  result.header.format = image.format;
  if (image.bounds.empty() || range.begin >= range.end) return result;

  // Rows that the range touches.
  const PixelBounds& bounds = image.bounds;
  CHECK(bounds.x_begin >= 0 && bounds.y_begin >= 0 && bounds.x_end <= frame_width) << "the image leaves the frame";
  const auto width = std::uint64_t(frame_width);
  const auto first_row = std::max<std::int64_t>(bounds.y_begin, std::int64_t(range.begin / width));
  const auto end_row = std::min<std::int64_t>(bounds.y_end, std::int64_t((range.end - 1) / width) + 1);
  if (first_row >= end_row) return result;
  result.header.bounds = {bounds.x_begin, std::int32_t(first_row), bounds.x_end, std::int32_t(end_row)};

  std::vector<PlacedRun> runs;
  std::uint64_t pixel_count = 0;
  for (std::int64_t y = first_row; y < end_row; ++y) {
    const Columns columns = ColumnsInRange(bounds, y, range, width);
    const std::size_t row = std::size_t((y - bounds.y_begin) * bounds.width());
    const auto found = [&](std::int64_t begin, std::int64_t end) {
      runs.push_back({{std::uint32_t(y - first_row), std::uint32_t(begin), std::uint32_t(end - begin)}, row + std::size_t(begin)});
      pixel_count += std::uint64_t(end - begin);
    };
    if (image.format == PixelFormat::kDepth) {
      ForEachSpan<1>(&image.depth[row], std::numeric_limits<float>::infinity(), columns.begin, columns.end, found);
    } else {
      ForEachSpan<4>(&image.rgba[4 * row] + 3, 0, columns.begin, columns.end, found);
    }
  }
  result.header.run_count = std::uint32_t(runs.size());
  result.header.pixel_count = pixel_count;

  result.payload.reserve(PayloadBytes(result.header));
  for (const PlacedRun& r : runs) Append(result.payload, &r.run, sizeof(Run));
  for (const PlacedRun& r : runs) Append(result.payload, &image.rgba[4 * r.first_pixel], kRgbaBytes * r.run.pixel_count);
  if (image.format == PixelFormat::kDepth) {
    for (const PlacedRun& r : runs) Append(result.payload, &image.depth[r.first_pixel], sizeof(float) * r.run.pixel_count);
    for (const PlacedRun& r : runs) Append(result.payload, &image.voxel[r.first_pixel], sizeof(std::uint32_t) * r.run.pixel_count);
  }
  return result;
}

Status ValidateRuns(const RunImageHeader& header, std::span<const std::byte> payload, const PixelBounds& frame) {
  if (header.format != PixelFormat::kRgba && header.format != PixelFormat::kDepth) {
    return Invalid("format is " + std::to_string(int(header.format)) + ", but must be 1 (rgba) or 2 (depth)");
  }
  const PixelBounds& bounds = header.bounds;
  // Nothing is computed from the bounds before this: differences of hostile numbers may overflow.
  if (!frame.Contains(bounds) || (bounds.empty() && bounds != PixelBounds{})) {
    return Invalid("bounds [" + std::to_string(bounds.x_begin) + ", " + std::to_string(bounds.x_end) + ") x [" +
                   std::to_string(bounds.y_begin) + ", " + std::to_string(bounds.y_end) + ") do not lie in the frame of " +
                   std::to_string(frame.width()) + " x " + std::to_string(frame.height()) + " pixels");
  }
  const auto limit = std::uint64_t(bounds.pixel_count());
  if (header.pixel_count > limit) {
    return Invalid("pixel_count is " + std::to_string(header.pixel_count) + ", but the bounds have " + std::to_string(limit) + " pixels");
  }
  if (header.run_count > header.pixel_count) {
    return Invalid("run_count is " + std::to_string(header.run_count) + ", but there are only " + std::to_string(header.pixel_count) +
                   " pixels");
  }
  if (payload.size() != PayloadBytes(header)) {
    return Invalid("the payload has " + std::to_string(payload.size()) + " bytes, but the header says " +
                   std::to_string(PayloadBytes(header)));
  }

  const RunPayload runs(header, payload);
  std::uint64_t pixels = 0;
  std::uint64_t next_row = 0, next_column = 0;  // first place where the next run may begin
  for (std::uint32_t i = 0; i < header.run_count; ++i) {
    const Run run = runs.ReadRun(i);
    const std::uint64_t end_column = std::uint64_t{run.column} + run.pixel_count;
    if (run.pixel_count == 0 || run.row >= std::uint32_t(bounds.height()) || end_column > std::uint64_t(bounds.width())) {
      return Invalid("run " + std::to_string(i) + " (row " + std::to_string(run.row) + ", column " + std::to_string(run.column) + ", " +
                     std::to_string(run.pixel_count) + " pixels) is empty or leaves the bounds");
    }
    if (run.row < next_row || (run.row == next_row && run.column < next_column)) {
      return Invalid("run " + std::to_string(i) + " (row " + std::to_string(run.row) + ", column " + std::to_string(run.column) +
                     ") overlaps, touches or precedes the run before it");
    }
    next_row = run.row;
    next_column = end_column + 1;
    pixels += run.pixel_count;
  }
  if (pixels != header.pixel_count) {
    return Invalid("runs hold " + std::to_string(pixels) + " pixels, but pixel_count is " + std::to_string(header.pixel_count));
  }
  if (!AllFinite(runs.rgba(pixels))) return Invalid("a pixel's colour is not finite");
  if (header.format == PixelFormat::kDepth && !AllFinite(runs.depth(pixels))) return Invalid("a pixel's depth is not finite");
  return Status::Ok();
}

LocalImage DecodeRuns(const RunImageHeader& header, std::span<const std::byte> payload) {
  LocalImage image = MakeUnwrittenImage(header.format, header.bounds);
  const RunPayload runs(header, payload);
  std::size_t source = 0, written = 0;
  for (std::uint32_t i = 0; i < header.run_count; ++i) {
    const Run run = runs.ReadRun(i);
    const std::size_t target = std::size_t{run.row} * std::size_t(header.bounds.width()) + run.column;
    MakeEmpty(image, written, target);
    written = target + run.pixel_count;
    runs.ReadRgba(source, run.pixel_count, &image.rgba[4 * target]);
    if (header.format == PixelFormat::kDepth) {
      runs.ReadDepth(source, run.pixel_count, &image.depth[target]);
      runs.ReadVoxel(source, run.pixel_count, &image.voxel[target]);
    }
    source += run.pixel_count;
  }
  MakeEmpty(image, written, std::size_t(header.bounds.pixel_count()));
  return image;
}

}  // namespace slabstream
