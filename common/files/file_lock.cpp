#include "common/files/file_lock.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>

#include <cerrno>
#include <cstring>
#include <thread>
#include <utility>

#include "common/base/log.h"

namespace slabstream {
namespace {

// Whether the descriptor is still that of the path.
bool IsOf(const FileDescriptor& file, const std::string& path) {
  struct stat held {
  }, there{};
  return ::fstat(file.number(), &held) == 0 && ::stat(path.c_str(), &there) == 0 && held.st_ino == there.st_ino &&
         held.st_dev == there.st_dev;
}

// When it was touched last.
std::pair<std::int64_t, std::int64_t> TimeOf(const FileDescriptor& file) {
  struct stat found {};
  ::fstat(file.number(), &found);
  return {found.st_mtim.tv_sec, found.st_mtim.tv_nsec};
}

}  // namespace

Result<FileDescriptor> LockFile(const std::string& path, LockMode mode, Duration patience, const std::stop_token& stop) {
  constexpr auto kPause = std::chrono::milliseconds(20);
  const auto failure = [&] { return Status::Unavailable(fmt::format("cannot lock '{}': {}", path, std::strerror(errno))); };
  bool told = patience == Duration(0);
  while (true) {
    FileDescriptor lock(::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW, S_IRUSR | S_IWUSR));
    if (lock.number() < 0) return failure();
    Time touched = MonotonicNow();
    for (auto time = TimeOf(lock); ::flock(lock.number(), (mode == LockMode::kAlone ? LOCK_EX : LOCK_SH) | LOCK_NB) != 0;) {
      if (errno != EWOULDBLOCK && errno != EINTR) return failure();
      if (stop.stop_requested()) return Status::Cancelled(fmt::format("waiting for the lock '{}' was stopped", path));
      const Time now = MonotonicNow();
      if (const auto latest = TimeOf(lock); std::exchange(time, latest) != latest) touched = now;
      if (now >= touched + patience) {
        return Status::Unavailable(fmt::format("another process holds the lock '{}', and has done nothing with it for {} s", path,
                                               std::chrono::duration_cast<std::chrono::seconds>(patience).count()));
      }
      if (!std::exchange(told, true)) LogInfo(fmt::format("waits for another process, which holds the lock '{}'", path));
      std::this_thread::sleep_for(kPause);
    }
    if (IsOf(lock, path)) return lock;
  }
}

void TouchLock(const FileDescriptor& lock) { ::futimens(lock.number(), nullptr); }

}  // namespace slabstream
