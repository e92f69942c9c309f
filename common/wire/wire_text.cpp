#include "common/wire/wire_text.h"

#include <algorithm>

#include "common/text/utf8.h"

namespace slabstream {

std::string WireText(std::string_view text, std::size_t max_bytes) {
  std::string out;
  while (!text.empty()) {
    const std::size_t bytes = Utf8CharacterBytes(text);
    if (out.size() + std::max<std::size_t>(bytes, 1) > max_bytes) break;
    if (bytes == 0) {
      out += '?';
      text.remove_prefix(1);
    } else {
      out += text.substr(0, bytes);
      text.remove_prefix(bytes);
    }
  }
  return out;
}

}  // namespace slabstream
