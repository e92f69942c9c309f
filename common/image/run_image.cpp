#include "common/image/run_image.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <cstring>
#include <limits>
#include <string>
#include <vector>

#include "common/base/check.h"
#include "common/image/run_payload.h"

namespace slabstream {
namespace {

std::size_t PixelBytes(PixelFormat format) {
  return kRgbaBytes + (HasDepth(format) ? sizeof(float) : 0) + (HasVoxel(format) ? sizeof(std::uint32_t) : 0);
}

constexpr std::int64_t kBandRows = 32;  // of one task

// What one band of rows holds, and what lies in front of it in the payload.
struct Band {
  std::vector<Run> runs;
  std::uint64_t pixel_count = 0;
  std::size_t first_run = 0, first_pixel = 0;
};

// Writes the payload of a run image: the counterpart of RunPayload.
class PayloadWriter {
 public:
  // `payload` has room for PayloadBytes(header).
  PayloadWriter(const RunImageHeader& header, std::byte* payload)
      : runs_(payload),
        rgba_(runs_ + sizeof(Run) * header.run_count),
        depth_(rgba_ + kRgbaBytes * header.pixel_count),
        voxel_(depth_ + sizeof(float) * header.pixel_count),
        format_(header.format) {}

  // Run number `index`, whose pixels are those of `image` from `source` on and come after `first` others.
  void Write(std::size_t index, const Run& run, std::size_t first, const LocalImage& image, std::size_t source) const {
    const std::size_t count = run.pixel_count;
    std::memcpy(runs_ + sizeof(Run) * index, &run, sizeof(Run));
    std::memcpy(rgba_ + kRgbaBytes * first, &image.rgba[4 * source], kRgbaBytes * count);
    if (HasDepth(format_)) std::memcpy(depth_ + sizeof(float) * first, &image.depth[source], sizeof(float) * count);
    if (HasVoxel(format_)) std::memcpy(voxel_ + sizeof(std::uint32_t) * first, &image.voxel[source], sizeof(std::uint32_t) * count);
  }

 private:
  std::byte* runs_;
  std::byte* rgba_;
  std::byte* depth_;
  std::byte* voxel_;
  PixelFormat format_;
};

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
Status ColourNotFinite() { return Invalid("a pixel's colour is not finite"); }
Status DepthNotFinite() { return Invalid("a pixel's depth is not finite"); }

// Pixels [begin, end).
void MakeEmpty(LocalImage& image, std::size_t begin, std::size_t end) {
  std::fill(image.rgba.data() + 4 * begin, image.rgba.data() + 4 * end, 0.0F);
  if (HasDepth(image.format)) std::fill(image.depth.data() + begin, image.depth.data() + end, std::numeric_limits<float>::infinity());
  if (HasVoxel(image.format)) std::fill(image.voxel.data() + begin, image.voxel.data() + end, 0U);
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
  constexpr std::int64_t kBlock = 16;
  const auto is_empty = [&](std::int64_t x) { return plane[stride * std::size_t(x)] == empty; };
  // Whole blocks are counted in vectors; the compiler sees to that.
  const auto empty_ones = [&](std::int64_t x) {
    int count = 0;
    for (std::int64_t i = 0; i < kBlock; ++i) count += int(is_empty(x + i));
    return count;
  };
  for (std::int64_t x = begin; x < end;) {
    while (x + kBlock <= end && empty_ones(x) == kBlock) x += kBlock;
    while (x < end && is_empty(x)) ++x;
    const std::int64_t first = x;
    while (x + kBlock <= end && empty_ones(x) == 0) x += kBlock;
    while (x < end && !is_empty(x)) ++x;
    if (x > first) found(first, x);
  }
}

// `format`: that of the image, or one with fewer planes.
RunImage Encode(const LocalImage& image, PixelRange range, std::int32_t frame_width, PixelFormat format) {
  RunImage result;
  result.header.format = format;
  if (image.bounds.empty() || range.begin >= range.end) return result;

  // Rows that the range touches.
  const PixelBounds& bounds = image.bounds;
  CHECK(bounds.x_begin >= 0 && bounds.y_begin >= 0 && bounds.x_end <= frame_width) << "the image leaves the frame";
  const auto width = std::uint64_t(frame_width);
  const auto first_row = std::max<std::int64_t>(bounds.y_begin, std::int64_t(range.begin / width));
  const auto end_row = std::min<std::int64_t>(bounds.y_end, std::int64_t((range.end - 1) / width) + 1);
  if (first_row >= end_row) return result;
  result.header.bounds = {bounds.x_begin, std::int32_t(first_row), bounds.x_end, std::int32_t(end_row)};
  const auto row_start = [&](std::int64_t y) { return std::size_t(y - bounds.y_begin) * std::size_t(bounds.width()); };

  std::vector<Band> bands(std::size_t((end_row - first_row + kBandRows - 1) / kBandRows));
  tbb::parallel_for(std::size_t{0}, bands.size(), [&](std::size_t i) {
    Band& band = bands[i];
    const std::int64_t begin_row = first_row + std::int64_t(i) * kBandRows;
    for (std::int64_t y = begin_row; y < std::min(begin_row + kBandRows, end_row); ++y) {
      const Columns columns = ColumnsInRange(bounds, y, range, width);
      const auto found = [&](std::int64_t begin, std::int64_t end) {
        band.runs.push_back({std::uint32_t(y - first_row), std::uint32_t(begin), std::uint32_t(end - begin)});
        band.pixel_count += std::uint64_t(end - begin);
      };
      if (HasDepth(format)) {
        ForEachSpan<1>(&image.depth[row_start(y)], std::numeric_limits<float>::infinity(), columns.begin, columns.end, found);
      } else {
        ForEachSpan<4>(&image.rgba[4 * row_start(y)] + 3, 0, columns.begin, columns.end, found);
      }
    }
  });
  std::size_t run_count = 0;
  for (Band& band : bands) {
    band.first_run = run_count;
    band.first_pixel = result.header.pixel_count;
    run_count += band.runs.size();
    result.header.pixel_count += band.pixel_count;
  }
  result.header.run_count = std::uint32_t(run_count);

  result.payload.resize(PayloadBytes(result.header));
  const PayloadWriter writer(result.header, result.payload.data());
  tbb::parallel_for(std::size_t{0}, bands.size(), [&](std::size_t i) {
    std::size_t index = bands[i].first_run, pixel = bands[i].first_pixel;
    for (const Run& run : bands[i].runs) {
      writer.Write(index++, run, pixel, image, row_start(first_row + run.row) + run.column);
      pixel += run.pixel_count;
    }
  });
  return result;
}

// ValidateRuns, but for the values of pixels.
Status ValidateTable(const RunImageHeader& header, std::span<const std::byte> payload, const PixelBounds& frame) {
  if (header.format < PixelFormat::kRgba || header.format > PixelFormat::kRgbaDepth) {
    return Invalid("format is " + std::to_string(int(header.format)) + ", but must be 1 (rgba), 2 (depth) or 3 (rgba and depth)");
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
  return Status::Ok();
}

constexpr std::uint32_t kRunsPerTask = 16;  // the pixels of a row each, mostly: they stay in a core's cache

// For each task the number of pixels of all runs in front of its first one. One task at least.
std::vector<std::size_t> FirstPixels(const RunPayload& runs, std::uint32_t run_count) {
  std::vector<std::size_t> first = {0};
  std::size_t pixels = 0;
  for (std::uint32_t i = 0; i < run_count; ++i) {
    if (i > 0 && i % kRunsPerTask == 0) first.push_back(pixels);
    pixels += runs.ReadRun(i).pixel_count;
  }
  return first;
}

// The dense form of runs whose table is valid. look(first, count) is called for pixels [first, first + count) of all runs just before they
// are copied.
template <class Look>
LocalImage Decode(const RunImageHeader& header, const RunPayload& runs, Look&& look) {
  LocalImage image = MakeUnwrittenImage(header.format, header.bounds);
  const auto place_of = [&](const Run& run) { return std::size_t{run.row} * std::size_t(header.bounds.width()) + run.column; };
  const std::vector<std::size_t> first_pixels = FirstPixels(runs, header.run_count);
  tbb::parallel_for(std::size_t{0}, first_pixels.size(), [&](std::size_t task) {
    const std::size_t begin = task * kRunsPerTask, end = std::min<std::size_t>(begin + kRunsPerTask, header.run_count);
    std::size_t source = first_pixels[task], written = 0;
    if (begin > 0) {
      const Run before = runs.ReadRun(begin - 1);
      written = place_of(before) + before.pixel_count;
    }
    for (std::size_t i = begin; i < end; ++i) {
      const Run run = runs.ReadRun(i);
      const std::size_t target = place_of(run);
      look(source, run.pixel_count);
      MakeEmpty(image, written, target);
      written = target + run.pixel_count;
      runs.ReadRgba(source, run.pixel_count, &image.rgba[4 * target]);
      if (HasDepth(header.format)) runs.ReadDepth(source, run.pixel_count, &image.depth[target]);
      if (HasVoxel(header.format)) runs.ReadVoxel(source, run.pixel_count, &image.voxel[target]);
      source += run.pixel_count;
    }
    if (end == header.run_count) MakeEmpty(image, written, std::size_t(header.bounds.pixel_count()));
  });
  return image;
}

}  // namespace

std::size_t PayloadBytes(const RunImageHeader& header) {
  return sizeof(Run) * std::size_t{header.run_count} + PixelBytes(header.format) * std::size_t(header.pixel_count);
}

RunImage EncodeRuns(const LocalImage& image, PixelRange range, std::int32_t frame_width) {
  return Encode(image, range, frame_width, image.format);
}

RunImage EncodePicture(const LocalImage& image) {
  // Any frame width does that holds the bounds: the range is all pixels.
  const std::int32_t width = std::max(image.bounds.x_end, 1);
  const PixelRange all = {0, std::uint64_t(std::max(image.bounds.y_end, 0)) * std::uint64_t(width)};
  return Encode(image, all, width, HasDepth(image.format) ? PixelFormat::kRgbaDepth : PixelFormat::kRgba);
}

Status ValidateRuns(const RunImageHeader& header, std::span<const std::byte> payload, const PixelBounds& frame) {
  if (Status status = ValidateTable(header, payload, frame); !status.ok()) return status;
  const RunPayload runs(header, payload);
  if (!AllFinite(runs.rgba(0, header.pixel_count))) return ColourNotFinite();
  if (HasDepth(header.format) && !AllFinite(runs.depth(0, header.pixel_count))) return DepthNotFinite();
  return Status::Ok();
}

LocalImage DecodeRuns(const RunImageHeader& header, std::span<const std::byte> payload) {
  return Decode(header, RunPayload(header, payload), [](std::size_t, std::size_t) {});
}

Result<LocalImage> ReadRuns(const RunImageHeader& header, std::span<const std::byte> payload, const PixelBounds& frame) {
  if (Status status = ValidateTable(header, payload, frame); !status.ok()) return status;
  const RunPayload runs(header, payload);
  std::atomic<bool> colour_finite = true, depth_finite = true;
  LocalImage image = Decode(header, runs, [&](std::size_t first, std::size_t count) {
    if (!AllFinite(runs.rgba(first, count))) colour_finite = false;
    if (HasDepth(header.format) && !AllFinite(runs.depth(first, count))) depth_finite = false;
  });
  if (!colour_finite) return ColourNotFinite();
  if (!depth_finite) return DepthNotFinite();
  return image;
}

}  // namespace slabstream
