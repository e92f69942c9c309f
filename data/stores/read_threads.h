// The threads on which the stores of this process read files.
#pragma once

#include <functional>

#include "common/base/status.h"
#include "data/stores/store.h"

namespace slabstream {

// Calls `done` exactly once with what `read` returns, on one of these threads. What throws is a failure that begins with `what`. Any
// thread.
void ReadOnThread(std::string what, std::function<Result<Bytes>()> read, Store::Done done);

}  // namespace slabstream
