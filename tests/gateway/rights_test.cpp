#include "gateway/rights.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "client/request/picture_fields.h"
#include "gateway/service_link.h"

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

TEST(AccessTokenTest, ExtensionsOfAHeaderAreRefused) {
  const auto checked = [](std::string_view header, std::string_view claims = R"({"exp": 1764450060})") {
    return CheckAccess(SignedToken(header, claims, kSecret), kSecret, kNow);
  };
  for (const char* header :
       {R"({"alg":"HS256"})", R"({"alg":"HS256","typ":"JWT"})", R"({"typ":"jwt","alg":"HS256","kid":"7","cty":"x"})"}) {
    EXPECT_TRUE(checked(header).ok()) << header;
  }
  for (const auto& [header, why] : std::initializer_list<std::pair<const char*, const char*>>{
           {R"({"alg":"HS256","crit":["exp"],"exp":1})", "'crit'"},
           {R"({"alg":"HS256","crit":["b64"],"b64":true})", "'crit'"},
           {R"({"alg":"HS256","crit":[]})", "'crit'"},
           {R"({"alg":"HS256","crit":null})", "'crit'"},
           {R"({"alg":"HS256","crit":"exp"})", "'crit'"},
           {R"({"alg":"HS256","crit":[1]})", "'crit'"},
           {R"({"alg":"HS256","\u0063rit":["exp"]})", "'crit'"},
           {R"({"alg":"HS256","b64":false})", "'b64'"},
           {R"({"alg":"HS256","typ":"at+jwt"})", "'typ'"},
           {R"({"alg":"HS256","typ":null})", "'typ'"},
           {R"({"alg":"HS256","typ":["JWT"]})", "'typ'"},
           {R"({"alg":"hs256"})", "HS256"},
           {R"({"alg":"none"})", "HS256"},
           {R"({"alg":"HS384"})", "HS256"},
           {R"({"alg":["HS256"]})", "HS256"},
           {R"({"alg":"none","alg":"HS256"})", "HS256"},
           {R"({"alg":"HS256","alg":"HS256"})", "HS256"},
           {R"({"alg":"HS256","kid":1,"kid":1})", "HS256"},
           {R"(["alg","HS256"])", "HS256"},
           {"", "HS256"},
       }) {
    const Status status = checked(header).status();
    EXPECT_EQ(status.code(), StatusCode::kInvalidArgument) << header;
    EXPECT_NE(status.message().find(why), std::string::npos) << header << " " << status.message();
  }
  for (const char* claims :
       {R"({"exp":"1764450060"})", R"({"exp":true})", R"({"exp":null})", R"({"exp":[1764450060]})", R"({"exp":1e999})", R"({"exp":-1e300})",
        R"({"exp":1764450060,"nbf":1})", R"({"exp":1764450060,"iat":"now"})", R"({"exp":1764450060,"aud":"x"})",
        R"({"exp":1764450060,"datasets":"head"})", R"({"exp":1764450060,"datasets":{"head":1}})",
        R"({"exp":1764450060,"datasets":[["head"]]})", R"({"exp":1764450060,"datasets":null})",
        R"({"exp":1764450060,"datasets":["a"],"datasets":["b"]})", R"({"exp":1764450060,"datasets":["a"],"d\u0061tasets":["b"]})",
        R"({"exp":1,"exp":1764450060})", R"({"exp":1764450060,"view_only":0})", R"({"exp":1764450060,"view_only":true,"view_only":false})",
        R"({"exp":1764450060,"Datasets":["a"]})"}) {
    EXPECT_FALSE(checked(R"({"alg":"HS256"})", claims).ok()) << claims;
  }
}

// Whether those who may see `shown` alone may read what a question reads.
bool MayRead(const ServiceLink::Inquiry& question, std::vector<std::string> shown) {
  return Asker{.access = {.datasets = std::move(shown)}}.MayRead(DatasetsOf(question)).ok();
}

TEST(RightsTest, ShapesAreReadInWhateverWordsTheyAreAskedFor) {
  for (const char* name : {"shape", "mesh", "lines", "points"}) {
    const PictureFields fields = {{"dataset", "head"}, {"size", "32"}, {name, "lung,color=red"}, {name, "bone"}};
    const FrameRequest frame = ParseRenderFields(fields).value().frame;
    EXPECT_EQ(DatasetsOf(frame), (std::vector<std::string>{"head", "lung", "bone"})) << name;
    for (const ServiceLink::Inquiry& question :
         {ServiceLink::Inquiry(PickQuery{.frame = frame}), ServiceLink::Inquiry(ViewQuery{.frame = frame})}) {
      EXPECT_TRUE(MayRead(question, {"head", "lung", "bone", "other"}));
      EXPECT_FALSE(MayRead(question, {"head", "lung"}));
      EXPECT_FALSE(MayRead(question, {"lung", "bone"}));
    }
  }
}

// A new option that names data must be told by DatasetsOf: this finds those whose text may be any name.
TEST(RightsTest, NoOptionNamesADatasetUnseen) {
  const std::set<std::string> no_dataset = {"channel", "labels-shown", "time", "title", "color-bar"};
  for (const bool slices : {false, true}) {
    for (const Json& option : slices ? SliceFields() : RenderFields()) {
      const auto name = option["name"].get<std::string>();
      PictureFields fields = {{"dataset", "head"}, {"size", "32"}};
      if (name != "dataset") fields.push_back({name, "secret"});
      if (name == "dataset") fields.front().text = "secret";
      std::vector<FrameRequest> frames;
      if (slices) {
        const Result<SliceRequest> slice = ParseSliceFields(fields);
        if (slice.ok()) frames = FramesOf(*slice).value();
      } else if (const Result<RenderRequest> render = ParseRenderFields(fields); render.ok()) {
        frames = {render->frame};
      }
      for (const FrameRequest& frame : frames) {
        EXPECT_TRUE(no_dataset.contains(name) || !MayRead(PickQuery{.frame = frame}, {"head"})) << name;
      }
    }
  }
}

TEST(RightsTest, EveryQuestionSaysWhatItReads) {
  for (const ServiceLink::Inquiry& question :
       {ServiceLink::Inquiry(SummaryQuery{.dataset = "a"}), ServiceLink::Inquiry(SampleQuery{.dataset = "a"}),
        ServiceLink::Inquiry(StatisticsQuery{.dataset = "a"}), ServiceLink::Inquiry(JointHistogramQuery{.dataset = "a"}),
        ServiceLink::Inquiry(SteerDataset{.dataset = "a"})}) {
    EXPECT_TRUE(MayRead(question, {"a"}));
    EXPECT_FALSE(MayRead(question, {"b"}));
  }
  EXPECT_TRUE(MayRead(StatusQuery{}, {}));
}

TEST(RightsTest, WhatIsForbiddenReadsAsWhatIsNotThere) {
  std::vector<std::string> read;
  const Asker asker{.access = {.datasets = {{"a", "gone"}}}, .reading = [&](const std::string& name) { read.push_back(name); }};
  const Status forbidden = asker.MayRead({"a", "b"});
  EXPECT_EQ(forbidden, ShownStatus(Status::NotFound("no dataset \"gone\": the catalogue has a, b"), asker.access));
  EXPECT_EQ(forbidden, asker.MayRead({"none"}));
  EXPECT_EQ(forbidden.message(), "there is no such dataset");
  EXPECT_TRUE(read.empty());
  EXPECT_TRUE(asker.MayRead({"a", "gone"}).ok());
  EXPECT_EQ(read, (std::vector<std::string>{"a", "gone"}));
}

TEST(SessionPlacesTest, WhoIsIdleMakesRoomAndWhoHasMost) {
  const Time now = Time{} + std::chrono::hours(1);
  const auto unused = [&](std::string_view holder, int seconds) { return SessionPlace{holder, now - std::chrono::seconds(seconds)}; };
  const auto who = [&](const std::vector<SessionPlace>& places, std::string_view holder) { return WhoMakesRoom(places, holder, now); };
  EXPECT_EQ(who({}, "a"), std::nullopt);
  EXPECT_EQ(who({unused("a", 0), unused("a", 59), unused("a", 3)}, "a"), std::nullopt);
  EXPECT_EQ(who({unused("a", 0), unused("a", 60), unused("a", 61)}, "a"), 2U);
  EXPECT_EQ(who({unused("a", 70), unused("b", 60), unused("b", 1)}, "c"), 1U);  // of those that are idle, one of the holder with most
  EXPECT_EQ(who({unused("a", 0), unused("b", 1), unused("b", 5)}, "c"), 2U);    // none is idle: b has two, c nothing
  EXPECT_EQ(who({unused("a", 9), unused("b", 1), unused("b", 5)}, "a"), std::nullopt);
  EXPECT_EQ(who({unused("a", 9), unused("b", 1)}, "c"), std::nullopt);
}

// Whoever comes first, all get their part, and nobody who has no more than it is thrown out by those who have more.
TEST(SessionPlacesTest, OneHolderDoesNotKeepOthersOut) {
  std::vector<SessionPlace> places;
  const auto has = [&](std::string_view holder) { return std::ranges::count(places, holder, &SessionPlace::holder); };
  Time now = Time{} + std::chrono::hours(1);
  const auto open = [&](std::string_view holder) {
    now += std::chrono::milliseconds(1);
    if (places.size() == 64) {
      const auto leaving = WhoMakesRoom(places, holder, now);
      if (!leaving) return false;
      places.erase(places.begin() + std::ptrdiff_t(*leaving));
    }
    places.push_back({holder, now});
    return true;
  };
  for (int i = 0; i < 200; ++i) EXPECT_EQ(open("greedy"), i < 64);
  for (int i = 0; i < 200; ++i) {
    EXPECT_EQ(open("b"), i < 32);
    EXPECT_FALSE(open("greedy") && has("greedy") > has("b") + 1);
  }
  EXPECT_EQ(has("b"), 32);
  EXPECT_TRUE(open("c"));
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
