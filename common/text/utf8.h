// UTF-8, as RFC 3629 defines it.
#pragma once

#include <cstddef>
#include <string_view>

namespace slabstream {

// Length of the valid character that `text` begins with, 1 to 4 bytes; 0: it begins with none, or is empty.
std::size_t Utf8CharacterBytes(std::string_view text);

// The code point of one valid character, all of its bytes; of anything else something.
char32_t Utf8Character(std::string_view character);

}  // namespace slabstream
