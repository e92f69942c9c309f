// IndexFile: where the index of a source is kept (BrickIndex): a file in the cache folder (cache_folder.h) that is named after the source.
// It is written whole or not at all, so several processes may read and write it at a time; the last one that writes is kept.
//
// Any thread.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "common/base/status.h"
#include "data/survey/brick_index.h"

namespace slabstream {

class IndexFile {
 public:
  // The index file of the source at `path`, opened with `options` ("?channel=1", "" without). Looks at no file.
  // NotFound: there is no cache folder.
  static Result<IndexFile> Of(const std::string& path, std::string_view options);

  const std::string& path() const { return path_; }

  struct Facts {
    std::uint64_t bytes = 0;
    std::chrono::system_clock::time_point written;
  };
  std::optional<Facts> facts() const;  // nothing: there is no such file

  // What tells the source's files as they are now from what they were: `files_version`, of SourceInfo::files, and the sizes and times of
  // all files in SourceInfo::folder, which takes some microseconds for each. Unavailable: the folder cannot be looked through.
  Result<std::string> NameNow(std::uint64_t files_version, const SourceInfo& source) const;

  // Nothing: there is none. Errors, which name the file: NotFound: it has another name; DataLoss: it is damaged; Unavailable;
  // ResourceExhausted.
  Result<std::optional<BrickIndex>> Read(const std::string& name, const SourceInfo& source) const;
  // Makes the folder if need be. Unavailable, naming the file or the folder.
  Status Write(const std::string& name, const BrickIndex& index, const SourceInfo& source) const;
  // Adds what is known there already, from whoever has written it meanwhile, and writes it. One process at a time does this.
  Status Merge(const std::string& name, BrickIndex index, const SourceInfo& source) const;

 private:
  IndexFile(std::string path, std::string place) : path_(std::move(path)), place_(std::move(place)) {}

  std::string path_, place_;
};

}  // namespace slabstream
