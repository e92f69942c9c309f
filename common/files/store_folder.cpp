#include "common/files/store_folder.h"

#include <fmt/format.h>
#include <sys/statvfs.h>

#include <algorithm>
#include <filesystem>
#include <system_error>
#include <vector>

#include "common/files/cache_folder.h"
#include "common/files/files.h"

namespace slabstream {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kLockEnding = ".lock";

// Of the nearest folder that there is.
struct statvfs DiskOf(const std::string& path) {
  struct statvfs disk {};
  for (fs::path each = path;; each = each.parent_path()) {
    if (::statvfs(each.c_str(), &disk) == 0) return disk;
    if (!each.has_relative_path()) return {};
  }
}

constexpr const char* kSeal = ".slabstream-store";

struct Contents {
  std::uint64_t files = 0, bytes = 0;
  std::string Text() const { return fmt::format("{} files, {} bytes\n", files, bytes); }
};

// But for the seal.
Contents In(const fs::path& folder) {
  Contents found;
  std::error_code error;
  for (fs::recursive_directory_iterator each(folder, error), end; !error && each != end; each.increment(error)) {
    std::error_code unreadable;
    if (!each->is_regular_file(unreadable) || each->path().filename() == kSeal) continue;
    ++found.files;
    found.bytes += std::uint64_t(each->file_size(unreadable));
  }
  return found;
}

}  // namespace

Result<StoreFolder> StoreFolder::Usual() {
  constexpr std::uint64_t kShareOfDisk = 4;
  const Result<std::string> cache = CacheFolder();
  if (!cache.ok()) return cache.status();
  const struct statvfs disk = DiskOf(*cache);
  return StoreFolder(*cache + "/streams", std::uint64_t(disk.f_blocks) * disk.f_frsize / kShareOfDisk);
}

std::string StoreFolder::LockOf(const std::string& name) const { return PathOf(name) + std::string(kLockEnding); }

Result<StoreFolder::Lock> StoreFolder::Wait(const std::string& name, LockMode mode, const std::stop_token& stop) const {
  if (Status made = MakeOwnFolder(path_); !made.ok()) return made;
  return LockFile(LockOf(name), mode, patience_, stop);
}

Result<StoreFolder::Lock> StoreFolder::LockShared(const std::string& name, const std::stop_token& stop) const {
  Result<Lock> lock = Wait(name, LockMode::kShared, stop);
  if (lock.ok()) TouchLock(*lock);
  return lock;
}

Result<StoreFolder::Lock> StoreFolder::LockAlone(const std::string& name, const std::stop_token& stop) const {
  return Wait(name, LockMode::kAlone, stop);
}

std::uint64_t StoreFolder::Room(std::uint64_t own, std::uint64_t others) const {
  const struct statvfs disk = DiskOf(path_);
  const std::uint64_t free = std::uint64_t(disk.f_bavail) * disk.f_frsize + own;
  return std::min(free, budget_ - std::min(budget_, others));
}

std::uint64_t StoreFolder::BytesOf(const std::string& name) const { return In(PathOf(name)).bytes; }

std::uint64_t StoreFolder::RoomFor(const std::string& name) const {
  std::uint64_t others = 0;
  std::error_code error;
  for (fs::directory_iterator each(path_, error), end; !error && each != end; each.increment(error)) {
    if (each->path().filename() != name && each->is_directory(error)) others += In(each->path()).bytes;
  }
  return Room(BytesOf(name), others);
}

void StoreFolder::MakeRoom(const std::string& name, std::uint64_t bytes) const {
  struct OtherStore {
    std::string name;
    fs::file_time_type used;
  };
  std::vector<OtherStore> stores;
  std::error_code error;
  for (fs::directory_iterator each(path_, error), end; !error && each != end; each.increment(error)) {
    const std::string file = each->path().filename().string();
    if (!each->is_directory(error) || file == name) continue;
    std::error_code without_lock;
    const fs::file_time_type used = fs::last_write_time(LockOf(file), without_lock);
    stores.push_back({file, without_lock ? fs::file_time_type::min() : used});
  }
  std::ranges::sort(stores, {}, &OtherStore::used);
  for (const OtherStore& store : stores) {
    if (RoomFor(name) >= bytes) return;
    const Result<Lock> lock = TryLockFile(LockOf(store.name), LockMode::kAlone);
    if (!lock.ok()) continue;  // it is in use
    Remove(store.name);
  }
}

bool StoreFolder::IsWhole(const std::string& name) const {
  constexpr std::size_t kMost = 1000;
  const Result<std::string> seal = ReadTextFile(PathOf(name) + "/" + kSeal, kMost);
  return seal.ok() && *seal == In(PathOf(name)).Text();
}

Status StoreFolder::Begin(const std::string& name) const { return MakeOwnFolder(PathOf(name)); }

Status StoreFolder::Seal(const std::string& name) const {
  TakeRightsOfOthers(PathOf(name));
  return WritePrivateTextFile(PathOf(name) + "/" + kSeal, In(PathOf(name)).Text());
}

void StoreFolder::Remove(const std::string& name) const {
  std::error_code ignored;
  fs::remove(fs::path(PathOf(name)) / kSeal, ignored);  // first, if this process ends meanwhile
  fs::remove_all(PathOf(name), ignored);
  fs::remove(LockOf(name), ignored);
}

}  // namespace slabstream
