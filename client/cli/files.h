// Small text files: read within a limit, written whole or not at all.
#pragma once

#include <cstddef>
#include <string>

#include "common/base/status.h"

namespace slabstream {

// NotFound: no such file. ResourceExhausted: longer than `max_bytes`. Messages name the path.
Result<std::string> ReadTextFile(const std::string& path, std::size_t max_bytes);

// Writes beside the final place and renames. Unavailable, naming the path, if that fails.
Status WriteTextFile(const std::string& path, const std::string& text);

// NotFound naming the directory unless the one that will hold `path` exists: told before work begins. `option` begins the message.
Status CheckOutputDirectory(const std::string& option, const std::string& path);

}  // namespace slabstream
