// Locks between processes: the kernel's (flock), so they end with the process that holds them.
#pragma once

#include <chrono>
#include <cstdint>
#include <stop_token>
#include <string>

#include "common/base/status.h"
#include "common/base/time.h"
#include "common/files/file_descriptor.h"

namespace slabstream {

enum class LockMode : std::uint8_t { kShared, kAlone };

// So long nobody waits for a lock that its holder does not touch.
inline constexpr Duration kLockPatience = std::chrono::minutes(5);

// Takes the lock of the file, which is made if need be, for this user alone; it is held until the descriptor is closed. Waits while others
// hold it, as long as one of them changes the time of the file at least once in `patience`: whoever works for long with a lock touches it
// (TouchLock). The file may be removed by whoever holds it alone. Unavailable, naming the file: it cannot be made, or others hold it too
// long. Cancelled. Any thread.
Result<FileDescriptor> LockFile(const std::string& path, LockMode mode, Duration patience = kLockPatience,
                                const std::stop_token& stop = {});
// Without waiting: Unavailable if others hold it.
inline Result<FileDescriptor> TryLockFile(const std::string& path, LockMode mode) { return LockFile(path, mode, Duration(0)); }

void TouchLock(const FileDescriptor& lock);

}  // namespace slabstream
