#include "common/text/utf8.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace slabstream {
namespace {

TEST(Utf8, CharactersAreTheirCodePoints) {
  const std::vector<std::pair<std::string, char32_t>> cases = {
      {std::string(1, '\0'), 0},
      {"a", 'a'},
      {"\x7F", 0x7F},
      {"\xC2\x80", 0x80},
      {"\xC3\xA4", 0xE4},
      {"\xDF\xBF", 0x7FF},
      {"\xE0\xA0\x80", 0x800},
      {"\xE2\x86\x92", 0x2192},
      {"\xEF\xBF\xBF", 0xFFFF},
      {"\xF0\x90\x80\x80", 0x10000},
      {"\xF4\x8F\xBF\xBF", 0x10FFFF},
  };
  for (const auto& [text, code] : cases) {
    EXPECT_EQ(Utf8CharacterBytes(text + "more"), text.size());
    EXPECT_EQ(std::uint32_t(Utf8Character(text)), std::uint32_t(code));
  }
}

TEST(Utf8, WhatIsNoCharacterHasNoLength) {
  // A following byte alone, a cut character, longer than need be, a surrogate, beyond the last one, bytes that never occur.
  for (const std::string text : {"", "\x80", "\xC3", "\xC3z", "\xC0\x80", "\xC1\xBF", "\xE0\x9F\xBF", "\xE2\x86", "\xED\xA0\x80",
                                 "\xF0\x8F\xBF\xBF", "\xF4\x90\x80\x80", "\xF5\x80\x80\x80", "\xFE", "\xFF"}) {
    EXPECT_EQ(Utf8CharacterBytes(text), 0U);
  }
}

}  // namespace
}  // namespace slabstream
