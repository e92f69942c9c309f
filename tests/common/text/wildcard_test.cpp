#include "common/text/wildcard.h"

#include <gtest/gtest.h>

#include <string>

namespace slabstream {
namespace {

TEST(Wildcard, StarsStandForAnyCharactersAndQuestionMarksForOne) {
  for (const char* pattern : {"Precentral_L", "Precentral_*", "*", "*_L", "Pre*al_?", "P*r*c*L", "????????????", "*Precentral_L*", "**"}) {
    EXPECT_TRUE(MatchesPattern("Precentral_L", pattern)) << pattern;
  }
  for (const char* pattern : {"", "Precentral", "precentral_L", "*_R", "Precentral_L?", "?", "*x*", "*_L?", "[P]*"}) {
    EXPECT_FALSE(MatchesPattern("Precentral_L", pattern)) << pattern;
  }
  EXPECT_TRUE(MatchesPattern("", "*"));
  EXPECT_TRUE(MatchesPattern("", ""));
  EXPECT_FALSE(MatchesPattern("", "?"));
}

TEST(Wildcard, CharactersHaveAnyNumberOfBytes) {
  EXPECT_TRUE(MatchesPattern("H\u00f6hle", "H?hle"));
  EXPECT_TRUE(MatchesPattern("H\u00f6hle", "*?hle"));
  EXPECT_FALSE(MatchesPattern("H\u00f6hle", "H??hle"));
  EXPECT_TRUE(MatchesPattern("\xff\xfe", "??")) << "bytes that begin no character";
}

TEST(Wildcard, ManyStarsAreNoTrouble) {
  std::string pattern, name(250, 'a');
  for (int i = 0; i < 120; ++i) pattern.append("*a");
  EXPECT_TRUE(MatchesPattern(name, pattern));
  name.back() = 'b';
  EXPECT_FALSE(MatchesPattern(name, pattern));
}

}  // namespace
}  // namespace slabstream
