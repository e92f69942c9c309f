#include "common/json/json.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <stdexcept>
#include <string>
#include <vector>

namespace slabstream {
namespace {

using testing::HasSubstr;
using testing::StartsWith;

TEST(JsonTest, BracesMakeListsAndObjectsThatKeepTheirOrder) {
  const Json json = {{"z", {1, -2, 3U}}, {"a", {{"inner", true}}}, {"none", nullptr}, {"texts", {"a", "b"}}, {"empty", Json::array()}};
  EXPECT_EQ(json.dump(), R"({"z":[1,-2,3],"a":{"inner":true},"none":null,"texts":["a","b"],"empty":[]})");
  EXPECT_EQ(Json(std::vector<double>{0.5, 2}).dump(), "[0.5,2.0]");
  EXPECT_EQ(Json(std::map<std::string, int>{{"a", 1}}).dump(), R"({"a":1})");
}

TEST(JsonTest, NumbersAreWrittenAsTheyAre) {
  EXPECT_EQ(Json({0.1, 1e20, 1e-7, 3.0, 0.1F, std::nan("")}).dump(), "[0.1,1e+20,1e-07,3.0,0.10000000149011612,null]");
  EXPECT_EQ(Json::Parse("[18446744073709551615, -9223372036854775808, 1e2]")->dump(), "[18446744073709551615,-9223372036854775808,100.0]");
}

TEST(JsonTest, TextIsEscapedAndBecomesUtf8) {
  EXPECT_EQ(Json("a\"\n\xff").dump(), "\"a\\\"\\n\xef\xbf\xbd\"");
  EXPECT_EQ(Json("\xc2\xb5").dump(-1, true), "\"\\u00b5\"");
  EXPECT_EQ(Json({{"a", {1}}}).dump(1), "{\n \"a\": [\n  1\n ]\n}");
}

TEST(JsonTest, ReadsWhatItWrites) {
  const std::string text = R"({"a":[1,2.5,"x",null,false,{"b":{}}],"c":-3})";
  const Result<Json> json = Json::Parse(text);
  ASSERT_TRUE(json.ok()) << json.status().message();
  EXPECT_EQ(json->dump(), text);
  EXPECT_TRUE(json->at("a").at(0).is_number_unsigned());
  EXPECT_FALSE(json->at("c").is_number_unsigned());
}

TEST(JsonTest, SaysWhatIsWrongInOneLine) {
  EXPECT_THAT(Json::Parse("{\"a\": }").status().message(), StartsWith("not JSON: parse error at line 1, column 7"));
  EXPECT_THAT(Json::Parse("[1e999]").status().message(), HasSubstr("number overflow"));
  for (const char* text : {"", "{", "[1,]", "{} {}", "\"\n\"", "\xff", "nul"}) {
    const Status status = Json::Parse(text).status();
    EXPECT_EQ(status.code(), StatusCode::kInvalidArgument) << text;
    EXPECT_EQ(status.message().find('\n'), std::string::npos) << text;
  }
}

TEST(JsonTest, DepthIsLimitedBeforeAnythingIsMadeOfIt) {
  EXPECT_TRUE(Json::Parse(std::string(64, '[') + std::string(64, ']')).ok());
  EXPECT_EQ(Json::Parse(std::string(65, '[') + std::string(65, ']')).status().message(), "values nest more than 64 deep");
  EXPECT_FALSE(Json::Parse(std::string(10'000'000, '[')).ok());
  EXPECT_FALSE(Json::Parse("{\"a\": {\"b\": 1}}", {.depth = 1}).ok());
}

TEST(JsonTest, OfANameThatIsGivenTwiceTheLastCounts) {
  constexpr const char* kTwice = R"({"a": 1, "b": {"a": 3}, "a": 2})";
  EXPECT_EQ(Json::Parse(kTwice)->at("a"), 2);
  EXPECT_EQ(Json::Parse(kTwice, {.names_differ = true}).status().message(), "field 'a' is given twice");
  EXPECT_TRUE(Json::Parse(R"({"a": {"a": 1}, "b": {"a": 1}})", {.names_differ = true}).ok());
}

TEST(JsonTest, WhatIsMissingIsNull) {
  const Json json = {{"a", 1}};
  EXPECT_NE(json.find("a"), nullptr);
  EXPECT_EQ(json.find("b"), nullptr);
  EXPECT_EQ(Json(1).find("a"), nullptr);
  EXPECT_EQ(json.value("b", 7), 7);
  EXPECT_EQ(json.value("b", "x"), "x");
  EXPECT_THROW((void)json.at("b"), std::runtime_error);
  EXPECT_THROW((void)json.at("a").text(), std::runtime_error);
  EXPECT_THROW((void)Json({1, 2}).at(2), std::runtime_error);
  EXPECT_TRUE(Json("text").items().empty());
  EXPECT_EQ(Json("text").begin(), Json("text").end());
}

TEST(JsonTest, GrowsFromNull) {
  Json json;
  json["list"].push_back(1);
  json["list"].push_back({{"a", 2}});
  json["object"].update({{"x", 1}, {"y", 2}});
  json["object"].update({{"y", 3}});
  json["gone"] = 1;
  json.erase("gone");
  EXPECT_EQ(json.dump(), R"({"list":[1,{"a":2}],"object":{"x":1,"y":3}})");
  EXPECT_THROW(json.push_back(1), std::runtime_error);
}

TEST(JsonTest, ValuesAreEqualWhateverTheirTypeAndOrder) {
  EXPECT_EQ(Json(1), Json(1U));
  EXPECT_EQ(Json(1), Json(1.0));
  EXPECT_NE(Json(-1), Json(18446744073709551615U));
  EXPECT_NE(Json(1), Json(true));
  EXPECT_EQ(Json({{"a", 1}, {"b", 2.0}}), Json({{"b", 2}, {"a", 1}}));
  EXPECT_NE(Json({{"a", 1}}), Json({{"a", 1}, {"b", 2}}));
}

TEST(JsonTest, ValuesBecomeThoseOfOurs) {
  const Json json = {{"list", {1, 2}}, {"names", {{"a", 1}}}};
  EXPECT_EQ(json["list"].get<std::vector<int>>(), (std::vector<int>{1, 2}));
  EXPECT_EQ((json["names"].get<std::map<std::string, int>>()), (std::map<std::string, int>{{"a", 1}}));
  EXPECT_THROW((void)json["list"].get<double>(), std::runtime_error);
}

}  // namespace
}  // namespace slabstream
