// A stamp of an object behind an address, which changes when a volume grows.
#pragma once

#include <chrono>
#include <memory>
#include <string>

#include "common/base/time.h"
#include "common/files/file_stamp.h"
#include "data/stores/store.h"

namespace slabstream {

inline constexpr Duration kLookAgain = std::chrono::seconds(5);  // between two looks at an object

// FileStamp::ask looks at the object if it was not looked at for kLookAgain, and waits for the answer for a second at most; one that comes
// later counts the next time. A server that does not answer says nothing of a change. `key`: of an object that was just read. Any thread.
std::shared_ptr<const FileStamp> WatchObject(std::shared_ptr<Store> store, std::string key);

}  // namespace slabstream
