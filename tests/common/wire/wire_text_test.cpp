#include "common/wire/wire_text.h"

#include <gtest/gtest.h>

#include <string>

namespace slabstream {
namespace {

TEST(WireText, KeepsValidUtf8AndReplacesTheRest) {
  const struct {
    std::string in, out;
  } cases[] = {
      {"", ""},
      {"plain", "plain"},
      {std::string("a\0b", 3), std::string("a\0b", 3)},
      {"\xC3\xA9\xE2\x82\xAC\xF0\x9F\xA7\xA0", "\xC3\xA9\xE2\x82\xAC\xF0\x9F\xA7\xA0"},
      {"\xEF\xBF\xBF\xF4\x8F\xBF\xBF", "\xEF\xBF\xBF\xF4\x8F\xBF\xBF"},  // the last characters of three and four bytes
      {"\xE9t\xE9", "?t?"},                                              // Latin-1
      {"\xC0\xAF", "??"},                                                // overlong
      {"\xE0\x80\xAF", "???"},
      {"\xF0\x80\x80\xAF", "????"},
      {"\xED\xA0\x80", "???"},       // a surrogate
      {"\xF4\x90\x80\x80", "????"},  // beyond Unicode
      {"\xF5\x80\x80\x80", "????"},
      {"\x80\xBF", "??"},  // continuation without a beginning
      {"\xE2\x82", "??"},  // cut off
  };
  for (const auto& [in, out] : cases) EXPECT_EQ(WireText(in, 100), out);
}

TEST(WireText, CutsBetweenCharacters) {
  const std::string text = "a\xE2\x82\xAC\xE2\x82\xAC";
  const std::string cut[] = {"", "a", "a", "a", "a\xE2\x82\xAC", "a\xE2\x82\xAC", "a\xE2\x82\xAC", text, text};
  for (std::size_t bytes = 0; bytes < std::size(cut); ++bytes) EXPECT_EQ(WireText(text, bytes), cut[bytes]) << bytes;
}

}  // namespace
}  // namespace slabstream
