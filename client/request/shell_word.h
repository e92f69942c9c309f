// Words of a shell's command line.
#pragma once

#include <string>
#include <string_view>

namespace slabstream {

// The text as one word of bash, in quotes.
inline std::string ShellWord(std::string_view text) {
  std::string word = "'";
  for (const char c : text) c == '\'' ? word += "'\\''" : word += c;
  return word + "'";
}

}  // namespace slabstream
