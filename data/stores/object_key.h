// Names of objects: parts with slashes between them, none of which leads to another folder than the one it names.
#pragma once

#include <string_view>

#include "common/base/status.h"

namespace slabstream {

// InvalidArgument, naming the key: it is empty, begins or ends with a slash, holds a zero byte, is longer than a path can be, or has a part
// that is empty, "." or "..".
Status CheckObjectKey(std::string_view store, std::string_view key);
// The same for a folder; "" is the store itself.
Status CheckFolderKey(std::string_view store, std::string_view folder);

}  // namespace slabstream
