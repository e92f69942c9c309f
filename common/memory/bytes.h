// Bytes: an immutable run of bytes with shared ownership, so that payloads pass between threads, sockets and images without a copy.
#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "common/memory/pooled_vector.h"

namespace slabstream {

class Bytes {
 public:
  Bytes() = default;
  // `owner` keeps `data` alive.
  Bytes(std::shared_ptr<const void> owner, std::span<const std::byte> data) : owner_(std::move(owner)), data_(data) {}
  template <class Allocator>
  explicit Bytes(std::vector<std::byte, Allocator> data) {
    auto owned = std::make_shared<const std::vector<std::byte, Allocator>>(std::move(data));
    data_ = *owned;
    owner_ = std::move(owned);
  }

  std::span<const std::byte> span() const { return data_; }
  std::size_t size() const { return data_.size(); }
  // The part must lie inside.
  Bytes Part(std::size_t begin, std::size_t bytes) const { return {owner_, data_.subspan(begin, bytes)}; }
  bool empty() const { return data_.empty(); }

 private:
  std::shared_ptr<const void> owner_;
  std::span<const std::byte> data_;
};

// One after the other; a single one is not copied.
inline Bytes Concatenated(std::span<const Bytes> parts) {
  if (parts.size() == 1) return parts.front();
  std::size_t size = 0;
  for (const Bytes& part : parts) size += part.size();
  PooledVector<std::byte> all;
  all.reserve(size);
  for (const Bytes& part : parts) all.insert(all.end(), part.span().begin(), part.span().end());
  return Bytes(std::move(all));
}

}  // namespace slabstream
