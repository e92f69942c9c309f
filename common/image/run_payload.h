// RunPayload: reads the payload of a run image whose header fits it (run_image.h has the layout). Payload bytes arrive in message buffers
// of any alignment: they are copied out, unless AreFloats allows reading them in place.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>

#include "common/image/run_image.h"
#include "common/image/sample_codes.h"

namespace slabstream {

static_assert(std::endian::native == std::endian::little, "payloads are little endian and are copied as they are");

struct Run {
  std::uint32_t row = 0, column = 0;  // from the upper left corner of the bounds
  std::uint32_t pixel_count = 0;
};
static_assert(sizeof(Run) == 12);

inline constexpr std::size_t kRgbaBytes = 4 * sizeof(float);  // a pixel

// Where the parts of a payload begin and where it ends, in bytes; the runs come first.
struct PayloadLayout {
  explicit PayloadLayout(const RunImageHeader& header)
      : rgba(sizeof(Run) * header.run_count),
        depth(rgba + 4 * BytesPerChannel(header.color) * header.pixel_count),
        voxel(depth + (HasDepth(header.format) ? sizeof(float) * header.pixel_count : 0)),
        end(voxel + (HasVoxel(header.format) ? sizeof(std::uint32_t) * header.pixel_count : 0)) {}

  std::size_t rgba, depth, voxel, end;
};

class RunPayload {
 public:
  // payload.size() is PayloadBytes(header).
  RunPayload(const RunImageHeader& header, std::span<const std::byte> payload)
      : dense_width_(IsDense(header) ? std::uint32_t(header.bounds.width()) : 0),
        run_count_(dense_width_ > 0 ? std::uint32_t(header.bounds.height()) : header.run_count),
        color_(header.color),
        color_bytes_(4 * BytesPerChannel(header.color)),
        layout_(header),
        runs_(payload.data()) {}

  std::uint32_t run_count() const { return run_count_; }  // dense image: its rows
  Run ReadRun(std::size_t index) const {
    if (dense_width_ > 0) return {std::uint32_t(index), 0, dense_width_};
    Run run;
    std::memcpy(&run, runs_ + sizeof(Run) * index, sizeof(Run));
    return run;
  }
  // Pixels [first, first + count) of all runs: here as bytes (a colour is four floats or codes), below as numbers.
  std::span<const std::byte> rgba(std::size_t first, std::size_t count) const {
    return {runs_ + layout_.rgba + color_bytes_ * first, color_bytes_ * count};
  }
  std::span<const std::byte> depth(std::size_t first, std::size_t count) const {
    return {runs_ + layout_.depth + sizeof(float) * first, sizeof(float) * count};
  }
  std::span<const std::byte> voxel(std::size_t first, std::size_t count) const {
    return {runs_ + layout_.voxel + sizeof(std::uint32_t) * first, sizeof(std::uint32_t) * count};
  }
  // Whether the payload can be read in place: colours and depths as floats, voxels as words.
  bool AreFloats() const { return color_ == ColorCoding::kFloat32 && reinterpret_cast<std::uintptr_t>(runs_) % alignof(float) == 0; }
  void ReadRgba(std::size_t first, std::size_t count, float* out) const {
    const std::byte* const source = rgba(first, count).data();
    if (color_ == ColorCoding::kFloat32) {
      std::memcpy(out, source, kRgbaBytes * count);
      return;
    }
    if (color_ == ColorCoding::kStraight8) {
      FromStraightCodes(reinterpret_cast<const std::uint8_t*>(source), count, out);
      return;
    }
    constexpr std::size_t kBatch = 4096;  // channels that are copied out at a time
    std::array<std::uint16_t, kBatch> codes;
    for (std::size_t done = 0; done < 4 * count; done += kBatch) {
      const std::size_t channels = std::min(kBatch, 4 * count - done);
      std::memcpy(codes.data(), source + sizeof(std::uint16_t) * done, sizeof(std::uint16_t) * channels);
      FromCodes(color_, codes.data(), out + done, channels);
    }
  }
  void ReadDepth(std::size_t first, std::size_t count, float* out) const {
    std::memcpy(out, depth(first, count).data(), sizeof(float) * count);
  }
  void ReadVoxel(std::size_t first, std::size_t count, std::uint32_t* out) const {
    std::memcpy(out, voxel(first, count).data(), sizeof(std::uint32_t) * count);
  }

 private:
  const std::uint32_t dense_width_;  // 0: the payload has runs
  const std::uint32_t run_count_;
  const ColorCoding color_;
  const std::size_t color_bytes_;  // a pixel
  const PayloadLayout layout_;
  const std::byte* const runs_;
};

// The part of the checks of ReadRuns for the values of pixels [first, first + count) of all runs.
Status ValidatePixels(const RunImageHeader& header, const RunPayload& runs, std::size_t first, std::size_t count);

}  // namespace slabstream
