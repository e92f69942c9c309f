#include "common/base/cache_folder.h"

#include <cstdlib>

namespace slabstream {

Result<std::string> CacheFolder() {
  const auto absolute = [](const char* path) { return path != nullptr && path[0] == '/'; };
  if (const char* const cache = std::getenv("XDG_CACHE_HOME"); absolute(cache)) return std::string(cache) + "/slabstream";
  if (const char* const home = std::getenv("HOME"); absolute(home)) return std::string(home) + "/.cache/slabstream";
  return Status::NotFound("there is no folder for what is kept: set XDG_CACHE_HOME to an absolute path");
}

}  // namespace slabstream
