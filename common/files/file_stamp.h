// FileStamp: whether files are still what they were when they were read. Compares what the file system says of them, not their bytes, so it
// works on every file system, those of other hosts included. Of what lies behind an address a function tells it.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "common/base/status.h"
#include "common/base/time.h"

namespace slabstream {

struct FileStamp {
  std::vector<std::string> paths;
  std::uint64_t digest = 0;                      // the digest of device, number, size and times of each file
  std::chrono::system_clock::time_point newest;  // when one of them was changed last, by the file system's clock
  std::function<bool(Time now)> ask = {};        // whether an object behind an address has changed; null: there is none
};

// The state of these files, and of everything in those that are folders. Takes as long as the file system takes to
// answer. NotFound, Unavailable: a path cannot be looked at; the message names it.
Result<FileStamp> StampFiles(std::vector<std::string> paths);

// Whether a file was written, replaced, added or removed since, or had its times changed. Changes within one tick of the file system's
// clock (10 ms at most, but on old file systems) are seen as one: a stamp is to be trusted if `newest` was longer ago when it was taken.
// Errors: as StampFiles.
Result<bool> HaveChanged(const FileStamp& stamp, Time now = MonotonicNow());

}  // namespace slabstream
