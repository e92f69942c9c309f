// SeenObjects: what a server has said and sent of its objects, each by its key: its versions (ETag, or when it was changed), its size and
// the digests of some parts of it; or that there is no such object. Remembers the last kMost objects. Any thread.
//
// A server may be several that have another version each for the same bytes, or may make up a new version for each answer. So another
// version alone is no change: parts that were read before are read again and compared.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "common/base/time.h"
#include "data/stores/range_reader.h"

namespace slabstream {

class SeenObjects {
 public:
  static constexpr std::size_t kMost = 65536;
  static constexpr Duration kFresh = std::chrono::minutes(1);  // so long, what the server has said counts as if it said it now

  // Part of an object that was asked for, and what came.
  struct Part {
    std::optional<ByteSpan> span;  // none: all of it
    std::uint64_t bytes = 0, digest = 0;
  };
  // An object that came.
  struct News {
    std::string version;       // empty: the server tells none
    std::uint64_t size = 0;    // size of the whole object; 0: the server tells none
    std::optional<Part> part;  // the part that was read; none: only the size was asked for
  };
  enum class Verdict { kSame, kChanged, kMustBeCompared };

  // kSame: the news are remembered. kMustBeCompared: the version is another one; parts(key) tell whether that means anything.
  Verdict Judge(const std::string& key, const News& news, Time now);
  // Parts of the object that were read before: the first one, and the last ones.
  std::vector<Part> parts(const std::string& key) const;
  // These parts are what they were at `now`, so the news, which had to be compared, are those of the same object.
  void Accept(const std::string& key, const News& news, Time now);

  // The server says at `now` that an object has this version, or that there is none.
  void NoteVersion(const std::string& key, const std::string& version, Time now);
  void NoteMissing(const std::string& key, Time now);

  // Whether it said so less than kFresh before `now`.
  bool IsFresh(const std::string& key, const std::string& version, Time now) const;
  bool IsMissing(const std::string& key, Time now) const;
  // The ETag that it has had last, unless that is a weak one; "": there is none.
  std::string StrongVersionOf(const std::string& key) const;

 private:
  struct Seen {
    std::deque<std::string> versions;  // the last ones of the same object; none: none so far
    std::uint64_t size = 0;
    std::vector<Part> parts;
    std::optional<Time> compared, said, missed;
  };
  Seen& Of(const std::string& key);  // the lock is held
  void Take(Seen& seen, const News& news);

  mutable std::mutex mutex_;  // guards what follows
  std::map<std::string, Seen> seen_;
  std::deque<std::string> order_;  // keys of seen_, the oldest first
  std::size_t meaningless_ = 0;    // versions that were others of the same object
};

}  // namespace slabstream
