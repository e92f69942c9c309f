// The threads on which this process reads files: a disk wants several requests at a time.
#pragma once

#include <functional>

#include "common/base/status.h"
#include "data/stores/store.h"

namespace slabstream {

// Runs `task`, which reports its own failures, on one of these threads. Any thread. Throws if there is no memory for it.
void PostRead(std::function<void()> task);

// Calls `done` exactly once with what `read` returns, on one of these threads. What throws is a failure that begins with `what`. Any
// thread.
void ReadOnThread(std::string what, std::function<Result<Bytes>()> read, Store::Done done);

}  // namespace slabstream
