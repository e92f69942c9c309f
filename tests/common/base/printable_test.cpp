#include "common/base/printable.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace slabstream {
namespace {

using testing::EndsWith;
using testing::StartsWith;

TEST(Printable, OneLineStaysAsItIs) {
  EXPECT_EQ(Printable("size is '\xc3\xa4', must be a number"), "size is '\xc3\xa4', must be a number");
  const std::string longest(kMaxPrintableBytes, 'x');
  EXPECT_EQ(Printable(longest), longest);
  EXPECT_EQ(Printable(Status::Ok()), Status::Ok());
}

TEST(Printable, ControlCharactersBecomeQuestionMarks) {
  EXPECT_EQ(Printable(std::string("a\nb\r\x1b[31m\x7f\0c", 12)), "a?b??[31m??c");
  EXPECT_EQ(Printable(Status::NotFound("no\nfile")), Status::NotFound("no?file"));
}

TEST(Printable, LongTextsKeepTheirEnds) {
  const std::string shown = Printable("field is '" + std::string(1 << 20, 'x') + "', must be a number");
  EXPECT_EQ(shown.size(), kMaxPrintableBytes);
  EXPECT_THAT(shown, StartsWith("field is 'xxx"));
  EXPECT_THAT(shown, EndsWith("xxx', must be a number"));
}

}  // namespace
}  // namespace slabstream
