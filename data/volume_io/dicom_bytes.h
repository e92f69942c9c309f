// The bytes of a DICOM file, or of the deflated data set that it holds, of which a stretch is in memory.
//
// One thread at a time.
#pragma once

#include <cstddef>
#include <cstdint>
#include <fstream>
#include <memory>
#include <string>
#include <vector>

#include "data/volume_io/decompressor.h"

namespace slabstream {

inline constexpr std::int64_t kMaxInflated = std::int64_t{1} << 32;  // bytes of a deflated data set

class DicomBytes {
 public:
  explicit DicomBytes(const std::string& path);
  // The bytes that are deflated from `deflated_at` on; offsets are those of decompressed bytes. They are decompressed once to be counted,
  // up to kMaxInflated, and once more to be read.
  DicomBytes(const std::string& path, std::int64_t deflated_at);

  bool is_open() const { return size_ >= 0; }
  std::int64_t size() const { return size_; }

  // `bytes` from `offset` on; null: the file ends before them, or, of a deflated data set, they lie in front of an earlier stretch. Valid
  // until the next call.
  const std::byte* At(std::int64_t offset, std::int64_t bytes);

 private:
  bool Load(std::int64_t offset, std::size_t bytes);

  std::ifstream file_;
  std::unique_ptr<Decompressor> inflate_;  // decompresses a deflated data set
  std::int64_t size_ = -1, begin_ = 0;
  std::vector<std::byte> window_;  // bytes from begin_ on
};

}  // namespace slabstream
