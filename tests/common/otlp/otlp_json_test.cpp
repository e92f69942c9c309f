#include "common/otlp/otlp_json.h"
#include "common/json/json.h"

#include <gtest/gtest.h>

namespace slabstream {
namespace {

Json Attribute(const char* key, const Json& value) { return {{"key", key}, {"value", value}}; }

TEST(OtlpJsonTest, IsAnExportRequestInOtlpsJson) {
  TraceSpan root;
  root.trace = {0x4b, 0xf9, 0x2f, 0x35, 0x77, 0xb3, 0x4d, 0xa6, 0xa3, 0xce, 0x92, 0x9d, 0x0e, 0x0e, 0x47, 0x36};
  root.id = {0x00, 0xf0, 0x67, 0xaa, 0x0b, 0xa9, 0x02, 0xb7};
  root.name = "GET /api/v1/render.png";
  root.kind = SpanKind::kServer;
  root.begin_ns = 1'700'000'000'123'456'789;
  root.end_ns = 1'700'000'001'000'000'000;
  root.attributes = {{"http.route", std::string("/a")}, {"http.response.status_code", std::int64_t{503}}, {"truth", true}};
  root.error = "no worker";
  TraceSpan child;
  child.trace = root.trace;
  child.id = {1, 2, 3, 4, 5, 6, 7, 8};
  child.parent = root.id;
  child.name = "frame";
  child.kind = SpanKind::kClient;
  child.begin_ns = child.end_ns = root.begin_ns;

  const std::vector<TraceSpan> spans = {root, child};
  const Json traces = Json::Parse(OtlpTraces({.program = "slabstream-gateway", .version = "1.2.3", .instance = "here"}, spans)).value();
  const Json expected_root = {{"traceId", "4bf92f3577b34da6a3ce929d0e0e4736"},
                              {"spanId", "00f067aa0ba902b7"},
                              {"name", "GET /api/v1/render.png"},
                              {"kind", 2},
                              {"startTimeUnixNano", "1700000000123456789"},
                              {"endTimeUnixNano", "1700000001000000000"},
                              {"attributes", Json::array({Attribute("http.route", {{"stringValue", "/a"}}),
                                                          Attribute("http.response.status_code", {{"intValue", "503"}}),
                                                          Attribute("truth", {{"boolValue", true}})})},
                              {"status", {{"code", 2}, {"message", "no worker"}}}};
  const Json expected_child = {{"traceId", "4bf92f3577b34da6a3ce929d0e0e4736"},
                               {"spanId", "0102030405060708"},
                               {"parentSpanId", "00f067aa0ba902b7"},
                               {"name", "frame"},
                               {"kind", 3},
                               {"startTimeUnixNano", "1700000000123456789"},
                               {"endTimeUnixNano", "1700000000123456789"},
                               {"attributes", Json::array()}};
  const Json resource = {{"attributes", Json::array({Attribute("service.name", {{"stringValue", "slabstream"}}),
                                                     Attribute("service.version", {{"stringValue", "1.2.3"}}),
                                                     Attribute("service.instance.id", {{"stringValue", "here"}}),
                                                     Attribute("process.executable.name", {{"stringValue", "slabstream-gateway"}})})}};
  const Json scope_spans = {{"scope", {{"name", "slabstream-gateway"}, {"version", "1.2.3"}}},
                            {"spans", Json::array({expected_root, expected_child})}};
  const Json resource_spans = {{"resource", resource}, {"scopeSpans", Json::array({scope_spans})}};
  EXPECT_EQ(traces, Json({{"resourceSpans", Json::array({resource_spans})}}));
}

TEST(OtlpJsonTest, OneSpanAndNoneAreListsToo) {
  const Json one = Json::Parse(OtlpTraces({}, std::vector<TraceSpan>(1))).value();
  EXPECT_EQ(one["resourceSpans"][0]["scopeSpans"][0]["spans"].size(), 1U);
  const Json none = Json::Parse(OtlpTraces({}, {})).value();
  EXPECT_EQ(none["resourceSpans"][0]["scopeSpans"][0]["spans"], Json::array());
}

TEST(OtlpJsonTest, TextThatIsNotUtf8DoesNotBreakIt) {
  std::vector<TraceSpan> spans(1);
  spans[0].name = "\xff\xfe";
  EXPECT_TRUE(Json::Parse(OtlpTraces({}, spans)).ok());
}

TEST(OtlpJsonTest, EachProcessHasAnInstanceThatIsAUuid) {
  const std::string a = ThisProcess("slabstream").instance, b = ThisProcess("slabstream").instance;
  EXPECT_NE(a, b);
  ASSERT_EQ(a.size(), 36U);
  for (std::size_t i = 0; i < a.size(); ++i) EXPECT_EQ(a[i] == '-', i == 8 || i == 13 || i == 18 || i == 23) << a;
}

TEST(OtlpJsonTest, FindsWhatACollectorRejects) {
  EXPECT_EQ(RejectionIn(""), "");
  EXPECT_EQ(RejectionIn("{}"), "");
  EXPECT_EQ(RejectionIn("[]"), "");
  EXPECT_EQ(RejectionIn("nonsense"), "");
  EXPECT_EQ(RejectionIn(R"({"partialSuccess":{}})"), "");
  EXPECT_EQ(RejectionIn(R"({"partialSuccess":7})"), "");
  EXPECT_EQ(RejectionIn(R"({"partialSuccess":{"rejectedSpans":"0","errorMessage":"a hint"}})"), "");
  EXPECT_EQ(RejectionIn(R"({"partialSuccess":{"rejectedSpans":"5","errorMessage":"too old"}})"), "rejects 5 spans: too old");
  EXPECT_EQ(RejectionIn(R"({"partialSuccess":{"rejectedSpans":5}})"), "rejects 5 spans: ");
}

}  // namespace
}  // namespace slabstream
