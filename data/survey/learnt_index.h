// LearntIndex: the ranges of the bricks that a process happens to read while it renders. They go into the index of the source, so that
// whoever opens it next knows them.
//
// Any thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <string_view>

#include "common/base/status.h"
#include "data/survey/brick_index.h"
#include "data/survey/index_file.h"

namespace slabstream {

class LearntIndex {
 public:
  // Of the source at `path`, opened with `options`, whose files have this version. Null: there is nothing to learn, or no place to keep it,
  // or an index would take more than 64 MiB of memory.
  static std::unique_ptr<LearntIndex> Begin(const std::string& path, std::string_view options, std::uint64_t files_version,
                                            std::shared_ptr<VolumeSource> source);
  ~LearntIndex();  // keeps what is new, unless that fails
  LearntIndex(const LearntIndex&) = delete;
  LearntIndex& operator=(const LearntIndex&) = delete;

  // The samples of a box of a level, x fastest. Of bricks that are partly outside the box nothing is learnt.
  void Learn(int level, const Box& box, std::span<const std::byte> samples);

 private:
  LearntIndex(IndexFile file, std::string name, std::shared_ptr<VolumeSource> source, BrickIndex known)
      : file_(std::move(file)), name_(std::move(name)), source_(std::move(source)), index_(std::move(known)) {}

  const IndexFile file_;
  const std::string name_;
  const std::shared_ptr<VolumeSource> source_;
  std::mutex mutex_;  // guards what follows
  BrickIndex index_;
  bool any_ = false;  // something was learnt
};

}  // namespace slabstream
