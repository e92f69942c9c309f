// SeenObjects: what a server has said of its objects, each by its key: its version (ETag, or when it was changed), or that there is no such
// object. Remembers the last kMost objects. Any thread.
#pragma once

#include <chrono>
#include <cstddef>
#include <deque>
#include <map>
#include <mutex>
#include <optional>
#include <string>

#include "common/base/time.h"

namespace slabstream {

class SeenObjects {
 public:
  static constexpr std::size_t kMost = 65536;
  static constexpr Duration kFresh = std::chrono::minutes(1);  // so long, what the server has said counts as if it said it now

  // False: the object had another version when it was seen first. A version that is empty agrees with all.
  bool Agrees(const std::string& key, const std::string& version);

  // The server says at `now` that an object has this version, or that there is none.
  void NoteVersion(const std::string& key, const std::string& version, Time now);
  void NoteMissing(const std::string& key, Time now);

  // Whether it said so less than kFresh before `now`.
  bool IsFresh(const std::string& key, const std::string& version, Time now) const;
  bool IsMissing(const std::string& key, Time now) const;

 private:
  struct Seen {
    std::string version;  // empty: none so far
    std::optional<Time> said, missed;
  };
  Seen& Of(const std::string& key);  // the lock is held

  mutable std::mutex mutex_;  // guards what follows
  std::map<std::string, Seen> seen_;
  std::deque<std::string> order_;  // keys of seen_, the oldest first
};

}  // namespace slabstream
