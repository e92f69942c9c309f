#include "common/base/version.h"

namespace slabstream {

std::string_view Version() { return SLABSTREAM_VERSION; }

}  // namespace slabstream
