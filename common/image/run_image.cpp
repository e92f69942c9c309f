#include "common/image/run_image.h"

#include <algorithm>
#include <bit>
#include <limits>
#include <string>

#include "common/base/check.h"
#include "common/image/run_payload.h"

namespace slabstream {
namespace {

std::size_t PixelBytes(PixelFormat format) {
  return format == PixelFormat::kDepth ? kRgbaBytes + sizeof(float) + sizeof(std::uint32_t) : kRgbaBytes;
}

// Tells the pixels of one row of an image apart from empty ones.
class RowScanner {
 public:
  explicit RowScanner(const LocalImage& image) : image_(image), depth_(image.format == PixelFormat::kDepth) {}

  bool Empty(std::size_t pixel) const {
    return depth_ ? image_.depth[pixel] == std::numeric_limits<float>::infinity() : image_.rgba[4 * pixel + 3] == 0;
  }

 private:
  const LocalImage& image_;
  const bool depth_;
};

// One run and where its pixels lie in the image.
struct PlacedRun {
  Run run;
  std::size_t first_pixel;
};

void Append(std::vector<std::byte>& out, const void* data, std::size_t bytes) {
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

bool AllFinite(const RunPayload& payload, void (RunPayload::*read)(std::size_t, std::size_t, float*) const, std::size_t pixels,
               std::size_t floats_a_pixel) {
  constexpr std::size_t kBatch = 1024;  // pixels
  constexpr std::uint32_t kExponentBits = 0x7F800000U;
  float batch[4 * kBatch];
  for (std::size_t first = 0; first < pixels; first += kBatch) {
    const std::size_t count = std::min(kBatch, pixels - first);
    (payload.*read)(first, count, batch);
    // All bits of the exponent are set for infinities and NaNs alone.
    bool finite = true;
    for (std::size_t i = 0; i < floats_a_pixel * count; ++i) {
      finite &= (std::bit_cast<std::uint32_t>(batch[i]) & kExponentBits) != kExponentBits;
    }
    if (!finite) return false;
  }
  return true;
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

  const RowScanner scanner(image);
  std::vector<PlacedRun> runs;
  std::uint64_t pixel_count = 0;
  for (std::int64_t y = first_row; y < end_row; ++y) {
    const Columns columns = ColumnsInRange(bounds, y, range, width);
    const std::size_t row = std::size_t((y - bounds.y_begin) * bounds.width());
    for (std::int64_t x = columns.begin; x < columns.end;) {
      while (x < columns.end && scanner.Empty(row + std::size_t(x))) ++x;
      const std::int64_t begin = x;
      while (x < columns.end && !scanner.Empty(row + std::size_t(x))) ++x;
      if (x == begin) break;
      runs.push_back({{std::uint32_t(y - first_row), std::uint32_t(begin), std::uint32_t(x - begin)}, row + std::size_t(begin)});
      pixel_count += std::uint64_t(x - begin);
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
  if (!AllFinite(runs, &RunPayload::ReadRgba, pixels, 4)) return Invalid("a pixel's colour is not finite");
  if (header.format == PixelFormat::kDepth && !AllFinite(runs, &RunPayload::ReadDepth, pixels, 1))
    return Invalid("a pixel's depth is not finite");
  return Status::Ok();
}

LocalImage DecodeRuns(const RunImageHeader& header, std::span<const std::byte> payload) {
  LocalImage image = MakeLocalImage(header.format, header.bounds);
  const RunPayload runs(header, payload);
  std::size_t source = 0;
  for (std::uint32_t i = 0; i < header.run_count; ++i) {
    const Run run = runs.ReadRun(i);
    const std::size_t target = std::size_t{run.row} * std::size_t(header.bounds.width()) + run.column;
    runs.ReadRgba(source, run.pixel_count, &image.rgba[4 * target]);
    if (header.format == PixelFormat::kDepth) {
      runs.ReadDepth(source, run.pixel_count, &image.depth[target]);
      runs.ReadVoxel(source, run.pixel_count, &image.voxel[target]);
    }
    source += run.pixel_count;
  }
  return image;
}

}  // namespace slabstream
