#include "gateway/rights.h"

#include <gtest/gtest.h>

#include <set>

namespace slabstream {
namespace {

constexpr char kSecret[] = "Jb8fXqkz3mYw0nT5sVQy1A";
constexpr std::int64_t kNow = 1764450000;

// jwt.encode({"exp": 1764450060, "iat": 1764450000, "datasets": ["head"], "view_only": True}, kSecret, algorithm="HS256") of PyJWT.
constexpr char kByOthers[] =
    "eyJhbGciOiJIUzI1NiIsInR5cCI6IkpXVCJ9.eyJleHAiOjE3NjQ0NTAwNjAsImlhdCI6MTc2NDQ1MDAwMCwiZGF0YXNldHMiOls"
    "iaGVhZCJdLCJ2aWV3X29ubHkiOnRydWV9.UXeUxXWSn3kJLl-oOZSsVbGXHPZlKOXnMxCioCDzjzc";

std::string Signed(const Access& access) { return SignAccess(access, kSecret).value(); }

TEST(AccessTokenTest, SaysWhatItsHolderMayUntilItExpires) {
  for (const Access& access : {Access{.until = kNow + 1}, Access{.until = kNow + 1, .view_only = true},
                               Access{.until = kNow + 3600, .datasets = {{"head", "a.b_c-d"}}},
                               Access{.until = kNow + 3600, .datasets = {{"head"}}, .view_only = true}}) {
    const std::string token = Signed(access);
    EXPECT_EQ(token.find_first_not_of("ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-_."), std::string::npos) << token;
    EXPECT_EQ(CheckAccess(token, kSecret, kNow).value(), access);
    EXPECT_TRUE(CheckAccess(token, kSecret, access.until - 1).ok());
    EXPECT_FALSE(CheckAccess(token, kSecret, access.until).ok());
    EXPECT_FALSE(CheckAccess(token, "Jb8fXqkz3mYw0nT5sVQy1B", kNow).ok());
  }
  EXPECT_EQ(CheckAccess(kSecret, kSecret, kNow).value(), Access());
  EXPECT_EQ(CheckAccess(Signed({.until = 0}), kSecret, kNow).status().message(), "the token expired at 1970-01-01T00:00:00Z");
  EXPECT_EQ(CheckAccess(kByOthers, kSecret, kNow).value(), (Access{.until = kNow + 60, .datasets = {{"head"}}, .view_only = true}));
}

TEST(RightsTest, ShapesAreDatasetsThatRequestsName) {
  const PictureFields fields = {{"dataset", "head"}, {"size", "32"},     {"shape", "lung,color=red"},
                                {"shape", "a\\,b"},  {"plane", "axial"}, {"shape", "x,colour=red"}};
  EXPECT_EQ(NamedDatasets(fields), (std::vector<std::string>{"head", "lung", "a,b"}));
}

TEST(AccessTokenTest, AnyOtherByteMakesItWrong) {
  const std::string token = Signed({.until = kNow + 9, .datasets = {{"head"}}, .view_only = true});
  const std::string why = CheckAccess("", kSecret, kNow).status().message();
  for (std::size_t i = 0; i < token.size(); ++i) {
    for (const char other : {'A', 'B', '.', '=', '\0'}) {
      std::string altered = token;
      if (altered[i] == other) continue;
      altered[i] = other;
      EXPECT_EQ(CheckAccess(altered, kSecret, kNow).status().message(), why) << altered;
    }
    EXPECT_EQ(CheckAccess(token.substr(0, i), kSecret, kNow).status().message(), why);
    EXPECT_EQ(CheckAccess(token.substr(i + 1), kSecret, kNow).status().message(), why);
  }
  for (const std::string& other :
       {token + "A", token + ".", "." + token, token.substr(0, token.rfind('.') + 1), std::string(".."), std::string(5000, 'A') + ".A.A"}) {
    EXPECT_EQ(CheckAccess(other, kSecret, kNow).status().message(), why) << other;
  }
}

TEST(AccessTokenTest, AShortSecretSignsNothing) {
  const std::string secret = "0123456789abcdef", token = Signed({.until = kNow + 9});
  EXPECT_EQ(SignAccess({.until = kNow}, secret).status().message(),
            "the gateway's own token has 16 characters; to sign others it needs at least 22, at random");
  EXPECT_TRUE(CheckAccess(secret, secret, kNow).ok());
  EXPECT_FALSE(SignAccess({.until = kNow, .datasets = {{std::string(5000, 'a')}}}, kSecret).ok());
}

TEST(AccessTest, DatasetsMeanTheirTimes) {
  const Access access{.until = kNow, .datasets = {{"fmri", "run@2"}}};
  for (const char* name : {"fmri", "fmri@0", "fmri@17", "run@2"}) EXPECT_TRUE(access.Shows(name)) << name;
  for (const char* name : {"", "fmri2", "fmr", "run", "run@3", "run@22", "FMRI", "@fmri", "other@fmri"})
    EXPECT_FALSE(access.Shows(name)) << name;
  EXPECT_TRUE(Access().Shows("any"));
  EXPECT_FALSE((Access{.datasets = std::vector<std::string>()}).Shows("any"));
}

TEST(RightsTest, TokensGiveWhatTheySay) {
  const Access all, view{.view_only = true}, one{.datasets = {{"head"}}}, least{.datasets = {{"head"}}, .view_only = true};
  using enum Right;
  const auto given = [](const Access& access) {
    std::set<Right> rights;
    for (const Right right : {kNone, kView, kWatch, kSteer, kSend}) {
      if (!WhyNot(right, access)) rights.insert(right);
    }
    return rights;
  };
  EXPECT_EQ(given(all), (std::set<Right>{kNone, kView, kWatch, kSteer, kSend}));
  EXPECT_EQ(given(view), (std::set<Right>{kNone, kView, kWatch}));
  EXPECT_EQ(given(one), (std::set<Right>{kNone, kView, kSteer}));
  EXPECT_EQ(given(least), (std::set<Right>{kNone, kView}));
}

TEST(RightsTest, HoldersAreToldWhatTheyMay) {
  EXPECT_EQ(AccessJson(Access(), true).dump(), R"({"rights":["view","watch","steer","send"],"datasets":null,"exp":null})");
  EXPECT_EQ(AccessJson(Access(), false)["rights"].dump(), R"(["view","watch","steer"])");
  EXPECT_EQ(AccessJson({.until = kNow, .datasets = {{"head"}}, .view_only = true}, true).dump(),
            R"({"rights":["view"],"datasets":["head"],"exp":1764450000})");
}

}  // namespace
}  // namespace slabstream
