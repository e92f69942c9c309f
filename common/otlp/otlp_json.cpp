#include "common/otlp/otlp_json.h"

#include <fmt/format.h>

#include "common/base/version.h"
#include "common/json/json.h"

namespace slabstream {
namespace {

// 64-bit integers are strings, as in all JSON of Protobuf.
std::string Decimal(std::int64_t number) { return std::to_string(number); }

Json ValueJson(const std::string& text) { return {{"stringValue", text}}; }
Json ValueJson(std::int64_t number) { return {{"intValue", Decimal(number)}}; }
Json ValueJson(bool truth) { return {{"boolValue", truth}}; }

Json AttributesJson(std::span<const TraceAttribute> attributes) {
  Json list = Json::array();
  for (const auto& [key, value] : attributes) {
    list.push_back({{"key", key}, {"value", std::visit([](const auto& v) { return ValueJson(v); }, value)}});
  }
  return list;
}

Json SpanJson(const TraceSpan& span) {
  Json json = {{"traceId", Hex(span.trace)}, {"spanId", Hex(span.id)}};
  if (span.parent) json["parentSpanId"] = Hex(*span.parent);
  json["name"] = span.name;
  json["kind"] = int(span.kind);
  json["startTimeUnixNano"] = Decimal(span.begin_ns);
  json["endTimeUnixNano"] = Decimal(span.end_ns);
  json["attributes"] = AttributesJson(span.attributes);
  constexpr int kError = 2;
  if (span.error) json["status"] = {{"code", kError}, {"message", *span.error}};
  return json;
}

}  // namespace

TraceSource ThisProcess(std::string program) {
  std::string id = Hex(NewTraceId());  // as a UUID
  for (const std::size_t dash : {20, 16, 12, 8}) id.insert(dash, "-");
  return {.program = std::move(program), .version = std::string(Version()), .instance = std::move(id)};
}

std::string OtlpTraces(const TraceSource& source, std::span<const TraceSpan> spans) {
  Json list = Json::array();
  for (const TraceSpan& span : spans) list.push_back(SpanJson(span));
  const std::vector<TraceAttribute> resource = {{"service.name", std::string("slabstream")},
                                                {"service.version", source.version},
                                                {"service.instance.id", source.instance},
                                                {"process.executable.name", source.program}};
  const Json scope = {{"name", source.program}, {"version", source.version}};
  const Json json = {
      {"resourceSpans",
       {{{"resource", {{"attributes", AttributesJson(resource)}}}, {"scopeSpans", {{{"scope", scope}, {"spans", std::move(list)}}}}}}}};
  return json.dump();
}

std::string RejectionIn(std::string_view answer) {
  const Result<Json> json = Json::Parse(answer);
  const Json* const partial = json.ok() ? json->find("partialSuccess") : nullptr;
  if (partial == nullptr) return {};
  const auto text = [&](const char* field) {
    const Json found = partial->value(field, Json());
    return found.is_string() ? found.text() : found.is_number() ? found.dump() : std::string();
  };
  const std::string rejected = text("rejectedSpans");
  if (rejected.empty() || rejected == "0") return {};
  return fmt::format("rejects {} spans: {}", rejected, text("errorMessage"));
}

}  // namespace slabstream
