// The version of Slabstream, which is said in one place: the project's line in CMakeLists.txt.
#pragma once

#include <string_view>

namespace slabstream {

std::string_view Version();  // "0.2.0"

}  // namespace slabstream
