#include "client/request/shell_word.h"

namespace slabstream {

std::string ShellWord(std::string_view text) {
  std::string word = "'";
  for (const char c : text) c == '\'' ? word += "'\\''" : word += c;
  return word + "'";
}

}  // namespace slabstream
