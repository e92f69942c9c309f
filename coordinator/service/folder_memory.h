// FolderMemory: which watched folders have not changed since they were last searched, by their modification times. So a folder of many
// files that does not change costs one look a round. It remembers only folders that hold nothing but files: the contents of subfolders, and
// what links lead to, may change without changing the folder's time. One thread at a time.
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

  // `search` searches the folder. What comes during the search, or at about that time, counts as a change at the next one.
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
