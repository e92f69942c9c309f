// FolderMemory: which watched folders are as they were when they were searched last, by the times that the file system gives them. So a
// folder of many files that nobody touches costs one question a round. It knows folders of nothing but files: what is in their subfolders
// may change without a trace in them, and so may what their links lead to. One thread at a time.
#pragma once

#include <sys/stat.h>

#include <map>
#include <optional>
#include <string>

namespace slabstream {

class FolderMemory {
 public:
  // Nothing came, went or was renamed.
  bool IsUnchanged(const std::string& folder) const;

  // `search` searches the folder: what comes meanwhile, or at about the same time, counts as a change later.
  template <class Search>
  auto Remember(const std::string& folder, Search&& search) {
    const std::optional<Stamp> before = StampOf(folder);
    auto found = search();
    if (before && found.ok() && IsOld(*before) && HasOnlyFiles(folder)) {
      stamps_.insert_or_assign(folder, *before);
    } else {
      stamps_.erase(folder);
    }
    return found;
  }

 private:
  struct Stamp {
    dev_t device{};
    ino_t number{};
    timespec changed{};
    bool operator==(const Stamp& other) const {
      return device == other.device && number == other.number && changed.tv_sec == other.changed.tv_sec &&
             changed.tv_nsec == other.changed.tv_nsec;
    }
  };
  static std::optional<Stamp> StampOf(const std::string& folder);  // nullopt: it cannot be looked at
  static bool IsOld(const Stamp& stamp);                           // so that another change would have another time
  static bool HasOnlyFiles(const std::string& folder);

  std::map<std::string, Stamp> stamps_;
};

}  // namespace slabstream
