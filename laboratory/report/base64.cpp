#include "laboratory/report/base64.h"

#include <algorithm>
#include <cstdint>

namespace slabstream {

std::string Base64(std::string_view bytes) {
  constexpr std::string_view kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const std::size_t count = std::min<std::size_t>(3, bytes.size() - i);
    std::uint32_t bits = 0;
    for (std::size_t b = 0; b < 3; ++b) bits = bits << 8U | (b < count ? std::uint32_t(static_cast<unsigned char>(bytes[i + b])) : 0U);
    for (std::size_t d = 0; d < 4; ++d) text += d <= count ? kDigits[bits >> (18 - 6 * d) & 63U] : '=';
  }
  return text;
}

}  // namespace slabstream
