#include "common/text/base64.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <optional>
#include <span>
#include <string>

namespace slabstream {
namespace {

std::optional<std::string> Decoded(const std::string& letters) {
  std::string out(letters.size() / 4 * 3, '?');
  const auto bytes = DecodeBase64(std::as_bytes(std::span(letters)), std::as_writable_bytes(std::span(out)));
  if (!bytes) return std::nullopt;
  out.resize(*bytes);
  return out;
}

// The test vectors of RFC 4648, section 10.
TEST(Base64, LettersStandForBytes) {
  EXPECT_EQ(Decoded(""), "");
  EXPECT_EQ(Decoded("Zg=="), "f");
  EXPECT_EQ(Decoded("Zm8="), "fo");
  EXPECT_EQ(Decoded("Zm9v"), "foo");
  EXPECT_EQ(Decoded("Zm9vYg=="), "foob");
  EXPECT_EQ(Decoded("Zm9vYmFy"), "foobar");
  EXPECT_EQ(Decoded("+/+/"), "\xfb\xff\xbf");
}

TEST(Base64, WhatIsNoLetterIsRefused) {
  const std::string letters = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  for (int code = 0; code < 256; ++code) {
    const bool known = letters.find(char(code)) != std::string::npos;
    EXPECT_EQ(Base64Digit(char(code)), known ? int(letters.find(char(code))) : -1) << code;
    for (std::size_t at = 0; at < 8; ++at) {
      std::string text = "Zm9vYmFy";
      text[at] = char(code);
      EXPECT_EQ(Decoded(text).has_value(), known || (code == '=' && at == 7)) << code << " at " << at;
    }
  }
  for (const char* const part : {"Z", "Zg", "Zg=", "Zm9vY", "Z===", "====", "Zg==Zg==", "Zm9 v"}) EXPECT_FALSE(Decoded(part)) << part;
}

}  // namespace
}  // namespace slabstream
