// The records of a file, one after the other.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "data/cell_store/record_file.h"

namespace slabstream {

template <class T>
class RecordStream {
 public:
  explicit RecordStream(Records<T> file) : file_(std::move(file)) {}
  // Null: there is no other, or it cannot be read.
  const T* Next() {
    if (at_ == buffer_.size()) {
      buffer_.resize(std::size_t(std::min<std::uint64_t>(kBlockRecords, file_.size() - read_)));
      status_ = file_.Read(read_, std::span(buffer_));
      if (!status_.ok()) return nullptr;
      read_ += buffer_.size();
      at_ = 0;
    }
    return buffer_.empty() ? nullptr : &buffer_[at_++];
  }
  const Status& status() const { return status_; }

 private:
  Records<T> file_;
  std::vector<T> buffer_;
  std::size_t at_ = 0;
  std::uint64_t read_ = 0;
  Status status_;
};

}  // namespace slabstream
