// ObjectCache: a folder on disk with what servers have sent. The processes of a host share it, within a budget.
//
// An entry is a file of whole blocks of the disk: whose part it is, which version that was, and the bytes, with a checksum of it all. It is
// written beside its place and then renamed, so it is there as a whole or not at all. What is damaged all the same, after a crash of the
// machine, is not used and goes. An entry does not tell whether the server still has that version: whoever uses it asks the server
// (HttpGet::known).
//
// The budget is of blocks, so it limits the number of files, too. Entries that were used longest ago go first, until seven eighths of it
// are left. A process looks after that each time that it has
// written a sixteenth of the budget, so that two processes that write at a time stay within it.
//
// Copies are the same cache.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "common/base/status.h"
#include "common/memory/bytes.h"

namespace slabstream {

class ObjectCache {
 public:
  struct Entry {
    std::string version;     // as the server named it (ETag), not empty
    std::uint64_t size = 0;  // size of the whole object
    Bytes bytes;
  };

  // The folder need not exist. Unavailable: it cannot be made or written, or is not its user's own (MakeOwnFolder). Waits for the disk, as
  // the other functions do.
  static Result<ObjectCache> Open(std::string folder, std::uint64_t budget);

  // `name`: of a part of an object, unique among all servers. Any thread.
  std::optional<Entry> Find(const std::string& name) const;
  // Entries of more than a sixteenth of the budget are not kept. What cannot be written is not kept either, and one line of the log says
  // so.
  void Keep(const std::string& name, const Entry& entry) const;

 private:
  struct State;
  explicit ObjectCache(std::shared_ptr<State> state);
  std::shared_ptr<State> state_;
};

// That of this process; null: it has none.
ObjectCache* ProcessObjectCache();
// From now on this process keeps what servers send, in the cache folder of its user. 0: nothing. Before anything is read. Errors of Open.
Status KeepObjects(std::uint64_t budget);

}  // namespace slabstream
