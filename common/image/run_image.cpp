#include "common/image/run_image.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cstring>
#include <limits>
#include <vector>

#include "common/base/check.h"
#include "common/image/finite.h"
#include "common/image/image_view.h"
#include "common/image/run_payload.h"
#include "common/image/sample_codes.h"
#include "common/parallel/parallel.h"

namespace slabstream {
namespace {

constexpr std::size_t kBandRows = 32;  // of one task

// The contents of one band of rows, and what lies in front of it in the payload.
struct Band {
  std::vector<Run> runs;
  std::uint64_t pixel_count = 0;
  std::size_t first_run = 0, first_pixel = 0;
};

// Writes the payload of a run image: the counterpart of RunPayload.
class PayloadWriter {
 public:
  // `payload` has room for PayloadBytes(header); the header must outlive this. `behind`: kStraight8.
  PayloadWriter(const RunImageHeader& header, const Premultiplied& behind, std::byte* payload)
      : header_(header), behind_(behind), layout_(header), payload_(payload) {}

  // Run number `index`, whose pixels are those of `view` from `source` on and come after `first` others. False: a colour cannot be coded.
  bool Write(std::size_t index, const Run& run, std::size_t first, const ImageView& view, std::size_t source) const {
    const std::size_t count = run.pixel_count;
    std::memcpy(payload_ + sizeof(Run) * index, &run, sizeof(Run));
    if (HasDepth(header_.format)) std::memcpy(payload_ + layout_.depth + sizeof(float) * first, view.depth + source, sizeof(float) * count);
    if (HasVoxel(header_.format)) {
      std::memcpy(payload_ + layout_.voxel + sizeof(std::uint32_t) * first, view.voxel + source, sizeof(std::uint32_t) * count);
    }
    std::byte* const color = payload_ + layout_.rgba + 4 * BytesPerChannel(header_.color) * first;
    if (header_.color == ColorCoding::kFloat32) {
      std::memcpy(color, view.rgba + 4 * source, kRgbaBytes * count);
      return true;
    }
    if (header_.color == ColorCoding::kStraight8) {
      StraightCodes(view.rgba + 4 * source, count, reinterpret_cast<std::uint8_t*>(color), behind_);
      return true;
    }
    return ToCodes(header_.color, view.rgba + 4 * source, reinterpret_cast<std::uint16_t*>(color), 4 * count);
  }

 private:
  const RunImageHeader& header_;
  const Premultiplied behind_;
  const PayloadLayout layout_;
  std::byte* const payload_;
};

template <class... Values>
Status Invalid(fmt::format_string<const Values&...> message, const Values&... values) {
  return Status::InvalidArgument("run image: " + fmt::format(message, values...));
}
Status BadColour(ColorCoding color) {
  return Invalid("a pixel's colour {}", color == ColorCoding::kFloat32 ? "is not finite" : "does not lie in [0, 1]");
}
Status DepthNotFinite() { return Invalid("a pixel's depth is not finite"); }

// `codes`: the bytes of codes, at any address.
bool NoneAbove(std::uint16_t largest, std::span<const std::byte> codes) {
  bool above = false;
  for (std::size_t i = 0; i + sizeof(std::uint16_t) <= codes.size(); i += sizeof(std::uint16_t)) {
    std::uint16_t code;
    std::memcpy(&code, codes.data() + i, sizeof(code));
    above |= code > largest;
  }
  return !above;
}

// `colours`: bytes of some pixels.
bool ColoursAreValid(ColorCoding color, std::span<const std::byte> colours) {
  switch (color) {
    case ColorCoding::kFloat32: return AllFinite(colours);
    case ColorCoding::kHalf:
    case ColorCoding::kFixed16: return NoneAbove(LargestCode(color), colours);
    case ColorCoding::kStraight8: return true;
  }
  return false;
}

// Finds the pixels of one row, [begin, end), that are not empty, as maximal spans: found(begin, end) for each. `plane` has a value each
// `stride`; a pixel is empty if that is `empty`.
template <std::size_t stride, class Found>
void ForEachSpan(const float* plane, float empty, std::size_t begin, std::size_t end, Found&& found) {
  constexpr std::size_t kBlock = 16;
  const auto is_empty = [&](std::size_t x) { return plane[stride * x] == empty; };
  // The compiler vectorises the counting in whole blocks.
  const auto empty_ones = [&](std::size_t x) {
    std::size_t count = 0;
    for (std::size_t i = 0; i < kBlock; ++i) count += std::size_t(is_empty(x + i));
    return count;
  };
  for (std::size_t x = begin; x < end;) {
    while (x + kBlock <= end && empty_ones(x) == kBlock) x += kBlock;
    while (x < end && is_empty(x)) ++x;
    const std::size_t first = x;
    while (x + kBlock <= end && empty_ones(x) == 0) x += kBlock;
    while (x < end && !is_empty(x)) ++x;
    if (x > first) found(first, x);
  }
}

// Cuts the bounds to the runs.
void CutBounds(RunImage& image) {
  PixelBounds& bounds = image.header.bounds;
  PixelBounds cut;
  if (image.header.run_count == 0) {
    bounds = cut;
    return;
  }
  std::vector<Run> runs(image.header.run_count);
  std::memcpy(runs.data(), image.payload.data(), sizeof(Run) * runs.size());
  for (const Run& run : runs) {
    const auto x = std::int32_t(run.column) + bounds.x_begin, y = std::int32_t(run.row) + bounds.y_begin;
    cut = Union(cut, {x, y, x + std::int32_t(run.pixel_count), y + 1});
  }
  for (Run& run : runs) {
    run.row -= std::uint32_t(cut.y_begin - bounds.y_begin);
    run.column -= std::uint32_t(cut.x_begin - bounds.x_begin);
  }
  std::memcpy(image.payload.data(), runs.data(), sizeof(Run) * runs.size());
  bounds = cut;
}

constexpr std::uint32_t kRunsPerTask = 16;  // mostly a row each: their pixels stay in a core's cache

// For each task the number of pixels of all runs in front of its first one. One task at least.
std::vector<std::size_t> FirstPixels(const RunPayload& runs) {
  std::vector<std::size_t> first = {0};
  std::size_t pixels = 0;
  for (std::uint32_t i = 0; i < runs.run_count(); ++i) {
    if (i > 0 && i % kRunsPerTask == 0) first.push_back(pixels);
    pixels += runs.ReadRun(i).pixel_count;
  }
  return first;
}

// Of an image with bounds that contain those of the runs: calls write(source, target, count, before) for each run, in parallel. Its pixels
// are those from `source` on in the payload, and from `target` on in the image; the run before it ends at `before`, 0 for the first.
template <class Write>
void ForEachRun(const PixelBounds& runs_bounds, const RunPayload& runs, const PixelBounds& bounds, Write&& write) {
  const auto width = std::size_t(bounds.width());
  const std::size_t corner = std::size_t(runs_bounds.y_begin - bounds.y_begin) * width + std::size_t(runs_bounds.x_begin - bounds.x_begin);
  const auto place_of = [&](const Run& run) { return corner + std::size_t{run.row} * width + run.column; };
  const std::vector<std::size_t> first_pixels = FirstPixels(runs);
  ParallelFor(0, first_pixels.size(), [&](std::size_t task) {
    const std::size_t begin = task * kRunsPerTask, end = std::min<std::size_t>(begin + kRunsPerTask, runs.run_count());
    std::size_t source = first_pixels[task], before = 0;
    if (begin > 0) {
      const Run last = runs.ReadRun(begin - 1);
      before = place_of(last) + last.pixel_count;
    }
    for (std::size_t i = begin; i < end; ++i) {
      const Run run = runs.ReadRun(i);
      const std::size_t target = place_of(run), count = run.pixel_count;
      write(source, target, count, before);
      source += count;
      before = target + count;
    }
  });
}

// Where the last run ends in an image of these bounds; 0: there is none.
std::size_t EndOfRuns(const RunPayload& runs, const PixelBounds& bounds) {
  if (runs.run_count() == 0) return 0;
  const Run last = runs.ReadRun(runs.run_count() - 1);
  return std::size_t{last.row} * std::size_t(bounds.width()) + last.column + last.pixel_count;
}

// Writes all pixels of an image with the bounds of the header.
Status WriteRuns(const RunImageHeader& header, const RunPayload& runs, LocalImage& image) {
  std::atomic<bool> colours_valid = true, depth_finite = true;
  ForEachRun(header.bounds, runs, image.bounds, [&](std::size_t source, std::size_t target, std::size_t count, std::size_t before) {
    if (!ColoursAreValid(header.color, runs.rgba(source, count))) colours_valid = false;
    if (HasDepth(header.format) && !AllFinite(runs.depth(source, count))) depth_finite = false;
    MakeEmpty(image, before, target);
    runs.ReadRgba(source, count, &image.rgba[4 * target]);
    if (HasDepth(header.format)) runs.ReadDepth(source, count, &image.depth[target]);
    if (HasVoxel(header.format)) runs.ReadVoxel(source, count, &image.voxel[target]);
  });
  MakeEmpty(image, EndOfRuns(runs, image.bounds), std::size_t(image.bounds.pixel_count()));
  if (!colours_valid) return BadColour(header.color);
  if (!depth_finite) return DepthNotFinite();
  return Status::Ok();
}

}  // namespace

std::size_t PayloadBytes(const RunImageHeader& header) { return PayloadLayout(header).end; }

RunImage EncodeRuns(const ImageView& view, ColorCoding color, const Premultiplied& behind) {
  RunImage result;
  result.header.format = view.format;
  result.header.bounds = view.bounds;

  std::vector<Band> bands((view.rows.size() + kBandRows - 1) / kBandRows);
  ParallelFor(0, bands.size(), [&](std::size_t i) {
    Band& band = bands[i];
    for (std::size_t y = i * kBandRows; y < std::min((i + 1) * kBandRows, view.rows.size()); ++y) {
      const std::size_t row = y * view.stride;
      const auto found = [&](std::size_t begin, std::size_t end) {
        band.runs.push_back({std::uint32_t(y), std::uint32_t(begin), std::uint32_t(end - begin)});
        band.pixel_count += end - begin;
      };
      const auto [begin, end] = view.rows[y];
      if (HasDepth(view.format)) {
        ForEachSpan<1>(view.depth + row, std::numeric_limits<float>::infinity(), begin, end, found);
      } else {
        ForEachSpan<4>(view.rgba + 4 * row + 3, 0, begin, end, found);
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
  if (MayCode(view.format, color)) result.header.color = color;

  result.payload.resize(PayloadBytes(result.header));
  const PayloadWriter writer(result.header, behind, result.payload.data());
  std::atomic<bool> coded = true;
  ParallelFor(0, bands.size(), [&](std::size_t i) {
    std::size_t index = bands[i].first_run, pixel = bands[i].first_pixel;
    for (const Run& run : bands[i].runs) {
      if (!writer.Write(index++, run, pixel, view, run.row * view.stride + run.column)) coded = false;
      pixel += run.pixel_count;
    }
  });
  if (!coded) return EncodeRuns(view, ColorCoding::kFloat32);
  return result;
}

RunImage EncodeRuns(const LocalImage& image, PixelRange range, std::int32_t frame_width) {
  return EncodeRuns(ViewOf(image, range, frame_width));
}

RunImage EncodePicture(const LocalImage& image, ColorCoding color, const Premultiplied& behind) {
  ImageView view = ViewOf(image);
  if (HasVoxel(view.format)) view.format = PixelFormat::kRgbaDepth;
  if (color == ColorCoding::kStraight8) view.format = PixelFormat::kRgba;
  RunImage runs = EncodeRuns(view, color, behind);
  CutBounds(runs);
  return runs;
}

Status ValidateRunHeader(const RunImageHeader& header, const PixelBounds& frame) {
  if (header.format < PixelFormat::kRgba || header.format > PixelFormat::kSum) {
    return Invalid("format is {}, but must be 1 (rgba), 2 (depth), 3 (rgba and depth), 4 (maximum) or 5 (sum)", int(header.format));
  }
  const bool known = header.color >= ColorCoding::kFloat32 && header.color <= ColorCoding::kStraight8;
  if (!known || !MayCode(header.format, header.color)) {
    return Invalid("color is {}, but must be 1 (float32), for colours alone 2 (half), 3 (fixed16) or 4 (straight8), with voxels 4",
                   int(header.color));
  }
  const PixelBounds& bounds = header.bounds;
  // Nothing is computed from the bounds before this: differences of hostile numbers may overflow.
  if (!frame.Contains(bounds) || (bounds.empty() && bounds != PixelBounds{})) {
    return Invalid("bounds [{}, {}) x [{}, {}) do not lie in the frame of {} x {} pixels", bounds.x_begin, bounds.x_end, bounds.y_begin,
                   bounds.y_end, frame.width(), frame.height());
  }
  const auto limit = std::uint64_t(bounds.pixel_count());
  if (header.pixel_count > limit) {
    return Invalid("pixel_count is {}, but the bounds have {} pixels", header.pixel_count, limit);
  }
  if (IsDense(header) && header.pixel_count != limit) {
    return Invalid("run_count is 0, but there are {} of the bounds' {} pixels", header.pixel_count, limit);
  }
  if (header.run_count > header.pixel_count) {
    return Invalid("run_count is {}, but there are only {} pixels", header.run_count, header.pixel_count);
  }
  return Status::Ok();
}

Status ValidateRunTable(const RunImageHeader& header, std::span<const std::byte> payload, const PixelBounds& frame) {
  if (Status status = ValidateRunHeader(header, frame); !status.ok()) return status;
  if (payload.size() != PayloadBytes(header)) {
    return Invalid("the payload has {} bytes, but the header says {}", payload.size(), PayloadBytes(header));
  }

  if (IsDense(header)) return Status::Ok();
  const RunPayload runs(header, payload);
  std::uint64_t pixels = 0;
  std::uint64_t next_row = 0, next_column = 0;  // first place where the next run may begin
  for (std::uint32_t i = 0; i < header.run_count; ++i) {
    const Run run = runs.ReadRun(i);
    const std::uint64_t end_column = std::uint64_t{run.column} + run.pixel_count;
    if (run.pixel_count == 0 || run.row >= std::uint32_t(header.bounds.height()) || end_column > std::uint64_t(header.bounds.width())) {
      return Invalid("run {} (row {}, column {}, {} pixels) is empty or leaves the bounds", i, run.row, run.column, run.pixel_count);
    }
    if (run.row < next_row || (run.row == next_row && run.column < next_column)) {
      return Invalid("run {} (row {}, column {}) overlaps, touches or precedes the run before it", i, run.row, run.column);
    }
    next_row = run.row;
    next_column = end_column + 1;
    pixels += run.pixel_count;
  }
  if (pixels != header.pixel_count) {
    return Invalid("runs hold {} pixels, but pixel_count is {}", pixels, header.pixel_count);
  }
  return Status::Ok();
}

Status ValidatePixels(const RunImageHeader& header, const RunPayload& runs, std::size_t first, std::size_t count) {
  if (!ColoursAreValid(header.color, runs.rgba(first, count))) return BadColour(header.color);
  if (HasDepth(header.format) && !AllFinite(runs.depth(first, count))) return DepthNotFinite();
  return Status::Ok();
}

Result<LocalImage> ReadRuns(const RunImageHeader& header, std::span<const std::byte> payload, const PixelBounds& frame) {
  if (Status status = ValidateRunTable(header, payload, frame); !status.ok()) return status;
  LocalImage image = MakeUnwrittenImage(header.format, header.bounds);
  if (Status status = WriteRuns(header, RunPayload(header, payload), image); !status.ok()) return status;
  return image;
}

Status ReadCodesInto(const RunImageHeader& header, std::span<const std::byte> payload, const PixelBounds& frame, StraightImage& image) {
  if (Status status = ValidateRunTable(header, payload, frame); !status.ok()) return status;
  if (header.bounds.empty()) return Status::Ok();
  CHECK(header.color == ColorCoding::kStraight8);
  CHECK(image.bounds.Contains(header.bounds));
  const RunPayload runs(header, payload);
  ForEachRun(header.bounds, runs, image.bounds, [&](std::size_t source, std::size_t target, std::size_t count, std::size_t) {
    const std::span<const std::byte> codes = runs.rgba(source, count);
    std::memcpy(&image.codes[4 * target], codes.data(), codes.size());
  });
  return Status::Ok();
}

}  // namespace slabstream
