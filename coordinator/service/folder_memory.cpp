#include "coordinator/service/folder_memory.h"

#include <chrono>
#include <filesystem>
#include <system_error>

namespace slabstream {

bool FolderMemory::IsUnchanged(const std::string& folder) const {
  const auto known = stamps_.find(folder);
  return known != stamps_.end() && StampOf(folder) == known->second;
}

std::optional<FolderMemory::Stamp> FolderMemory::StampOf(const std::string& folder) {
  struct stat status {};
  if (::stat(folder.c_str(), &status) != 0) return std::nullopt;
  return Stamp{status.st_dev, status.st_ino, status.st_mtim};
}

bool FolderMemory::IsOld(const Stamp& stamp) {
  constexpr std::time_t kSeconds = 2;  // the coarsest clock of a file system
  return stamp.changed.tv_sec < std::chrono::system_clock::to_time_t(std::chrono::system_clock::now()) - kSeconds;
}

bool FolderMemory::HasOnlyFiles(const std::string& folder) {
  std::error_code error, ignored;
  for (std::filesystem::directory_iterator entry(folder, error), end; !error && entry != end; entry.increment(error)) {
    if (entry->is_symlink(ignored) || !entry->is_regular_file(ignored)) return false;
  }
  return !error;
}

}  // namespace slabstream
