// StoredSamples: an open file whose samples lie one after the other, and how its boxes are read: in as few reads as it takes to leave out
// what lies between the rows of a box.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "common/base/status.h"
#include "common/files/file_descriptor.h"
#include "common/volume/box.h"
#include "data/positional/turned_box.h"
#include "data/volume_io/raw_volume.h"

namespace slabstream {

class StoredSamples {
 public:
  // `payload`: of this volume alone. `component`: which of the header's components, in [0, components). Unavailable: it cannot be opened.
  static Result<std::shared_ptr<StoredSamples>> Open(const RawHeader& header, const Payload& payload, int component);
  // The same of a payload whose file is open already.
  StoredSamples(const RawHeader& header, const Payload& payload, int component, std::shared_ptr<const FileDescriptor> file);

  // A box, by the stored axes, cut into parts that are read on their own, each with little memory.
  std::vector<Box> Parts(const Box& box) const;
  // Bytes of memory that reading a part takes: at most kPartBytes, or those of one voxel.
  std::int64_t MemoryFor(const Box& part, const TurnedBox& to) const;
  // Fills in the samples of a part. Any thread. DataLoss: the file has become shorter. Unavailable: it cannot be read.
  // Throws std::bad_alloc.
  Status Read(const Box& part, const TurnedBox& to);

  std::uint64_t read_bytes() const { return read_bytes_; }

  static constexpr std::int64_t kPartBytes = std::int64_t{2} << 20;

 private:
  // Bytes from one row to the next, and from one slice to the next, where samples of a box are read to.
  struct Pitch {
    std::int64_t row = 0, slice = 0;
  };

  Pitch PitchFor(const Index3& size) const;
  bool CanReadInto(const Box& part, const TurnedBox& to) const;
  std::int64_t RowBytes(const Index3& size) const { return (size.x - 1) * voxel_ + sample_; }
  Status ReadRows(const Box& part, std::byte* to, const Pitch& pitch);
  Status ReadApart(std::int64_t offset, std::byte* to, std::int64_t rows, std::int64_t pitch);
  Status ReadAt(std::int64_t offset, std::byte* to, std::int64_t bytes);
  Result<std::int64_t> Got(std::int64_t bytes, std::int64_t offset);

  const std::string name_;
  const std::shared_ptr<const FileDescriptor> file_;
  const SampleType type_;
  const bool big_endian_;
  const std::int64_t first_;                         // byte of the file
  const std::int64_t sample_, voxel_, row_, slice_;  // bytes
  std::atomic<std::uint64_t> read_bytes_ = 0;
};

}  // namespace slabstream
