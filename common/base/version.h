// The version of Slabstream. Its only source is the project line in CMakeLists.txt.
#pragma once

#include <string_view>

namespace slabstream {

std::string_view Version();  // "0.2.0"

}  // namespace slabstream
