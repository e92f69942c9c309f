// The folder of what programs keep for later runs and could make again: slabstream/ in $XDG_CACHE_HOME, or else in ~/.cache.
#pragma once

#include <string>

#include "common/base/status.h"

namespace slabstream {

// Looks at no file. NotFound: neither XDG_CACHE_HOME nor HOME is an absolute path.
Result<std::string> CacheFolder();

}  // namespace slabstream
