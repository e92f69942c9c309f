// UploadBuffer: the bytes of a dataset that a client sends, as they come.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "common/base/status.h"
#include "common/memory/aligned_buffer.h"
#include "common/wire/client_messages.h"
#include "data/catalogue/data_source.h"

namespace slabstream {

class UploadBuffer {
 public:
  // Takes the memory, which may take long. ResourceExhausted: there is not enough.
  static Result<std::shared_ptr<UploadBuffer>> Make(const AddVolume& order);

  // Bytes from `begin` on, within the dataset.
  void Store(std::uint64_t begin, std::span<const std::byte> bytes);
  // Once all bytes are stored; the buffer is empty then. InvalidArgument: a number of a label that the order does not have. Unavailable: a
  // file cannot be written.
  Result<DataSource> Finish();

 private:
  explicit UploadBuffer(AddVolume order) : order_(std::move(order)) {}

  Result<std::shared_ptr<const Volume>> ValuesOf(const Volume& numbers) const;

  const AddVolume order_;
  // The volume, the numbers of labels if there are any, and the overlay if there is one.
  std::vector<std::shared_ptr<Volume>> parts_;
  AlignedVector<std::byte> file_;  // instead of them
};

}  // namespace slabstream
