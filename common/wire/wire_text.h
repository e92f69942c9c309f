// Texts of outgoing messages. Protobuf strings must be UTF-8 and our receivers bound their length, but a file name in an error message or a
// host's name may be anything. A message that nobody can decode would be worse than a mangled letter.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace slabstream {

// `text` with bytes that are not part of valid UTF-8 replaced by '?', cut to at most max_bytes between two characters.
std::string WireText(std::string_view text, std::size_t max_bytes);

}  // namespace slabstream
