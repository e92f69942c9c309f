// Words of a shell's command line.
#pragma once

#include <string>
#include <string_view>

namespace slabstream {

// The text as one word of bash, in quotes.
std::string ShellWord(std::string_view text);

}  // namespace slabstream
