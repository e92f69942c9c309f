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

namespace slabstream {

static_assert(std::endian::native == std::endian::little, "payloads are little endian and are copied as they are");

struct Run {
  std::uint32_t row = 0, column = 0;  // from the upper left corner of the bounds
  std::uint32_t pixel_count = 0;
};
static_assert(sizeof(Run) == 12);

inline constexpr std::size_t kRgbaBytes = 4 * sizeof(float);  // a pixel

class RunPayload {
 public:
  // payload.size() is PayloadBytes(header).
  RunPayload(const RunImageHeader& header, std::span<const std::byte> payload)
      : dense_width_(IsDense(header) ? std::uint32_t(header.bounds.width()) : 0),
        run_count_(dense_width_ > 0 ? std::uint32_t(header.bounds.height()) : header.run_count),
        color_(header.color),
        color_bytes_(4 * BytesPerChannel(header.color)),
        runs_(payload.data()),
        rgba_(runs_ + sizeof(Run) * header.run_count),
        depth_(rgba_ + color_bytes_ * header.pixel_count),
        voxel_(depth_ + sizeof(float) * header.pixel_count) {}

  std::uint32_t run_count() const { return run_count_; }  // dense image: its rows
  Run ReadRun(std::size_t index) const {
    if (dense_width_ > 0) return {std::uint32_t(index), 0, dense_width_};
    Run run;
    std::memcpy(&run, runs_ + sizeof(Run) * index, sizeof(Run));
    return run;
  }
  // Pixels [first, first + count) of all runs: here as bytes (a colour is four floats or codes), below as numbers.
  std::span<const std::byte> rgba(std::size_t first, std::size_t count) const {
    return {rgba_ + color_bytes_ * first, color_bytes_ * count};
  }
  std::span<const std::byte> depth(std::size_t first, std::size_t count) const {
    return {depth_ + sizeof(float) * first, sizeof(float) * count};
  }
  std::span<const std::byte> voxel(std::size_t first, std::size_t count) const {
    return {voxel_ + sizeof(std::uint32_t) * first, sizeof(std::uint32_t) * count};
  }
  // Whether the payload can be read in place: colours and depths as floats, voxels as words.
  bool AreFloats() const { return color_ == ColorCoding::kFloat32 && reinterpret_cast<std::uintptr_t>(runs_) % alignof(float) == 0; }
  void ReadRgba(std::size_t first, std::size_t count, float* out) const {
    const std::byte* const source = rgba_ + color_bytes_ * first;
    if (color_ == ColorCoding::kFloat32) {
      std::memcpy(out, source, kRgbaBytes * count);
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
    std::memcpy(out, depth_ + sizeof(float) * first, sizeof(float) * count);
  }
  void ReadVoxel(std::size_t first, std::size_t count, std::uint32_t* out) const {
    std::memcpy(out, voxel_ + sizeof(std::uint32_t) * first, sizeof(std::uint32_t) * count);
  }

 private:
  const std::uint32_t dense_width_;  // 0: the payload has runs
  const std::uint32_t run_count_;
  const ColorCoding color_;
  const std::size_t color_bytes_;  // a pixel
  const std::byte* runs_;
  const std::byte* rgba_;
  const std::byte* depth_;  // formats with depths only
  const std::byte* voxel_;  // formats with voxels only
};

// The part of ValidateRuns for the values of pixels [first, first + count) of all runs.
Status ValidatePixels(const RunImageHeader& header, const RunPayload& runs, std::size_t first, std::size_t count);

}  // namespace slabstream
