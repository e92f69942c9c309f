#include "common/text/base64.h"

#include <array>
#include <cstdint>
#include <string_view>

namespace slabstream {
namespace {

constexpr std::string_view kLetters = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";

constexpr auto kDigits = [] {
  std::array<std::int8_t, 256> digits{};
  digits.fill(-1);
  for (std::size_t i = 0; i < kLetters.size(); ++i) digits[std::uint8_t(kLetters[i])] = std::int8_t(i);
  return digits;
}();

}  // namespace

int Base64Digit(char letter) { return kDigits[std::uint8_t(letter)]; }

std::optional<std::size_t> DecodeBase64(std::span<const std::byte> letters, std::span<std::byte> out) {
  if (letters.size() % 4 != 0) return std::nullopt;
  std::size_t padding = 0;
  while (padding < 2 && padding < letters.size() && char(letters[letters.size() - 1 - padding]) == '=') ++padding;
  int signs = 0;  // below 0 as soon as a digit is
  for (std::size_t group = 0; group < letters.size() / 4; ++group) {
    int bits = 0;
    for (std::size_t i = 4 * group; i < 4 * group + 4; ++i) {
      const int digit = i < letters.size() - padding ? Base64Digit(char(letters[i])) : 0;
      signs |= digit;
      bits = bits << 6 | (digit & 63);
    }
    for (std::size_t i = 0; i < 3; ++i) out[3 * group + i] = std::byte(bits >> (16 - 8 * i) & 0xff);
  }
  return signs < 0 ? std::nullopt : std::optional(letters.size() / 4 * 3 - padding);
}

}  // namespace slabstream
