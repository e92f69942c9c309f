// Spans of traces as an OpenTelemetry collector takes them: an ExportTraceServiceRequest of OTLP in its JSON encoding
// (https://opentelemetry.io/docs/specs/otlp/#json-protobuf-encoding). Pure. The only place that writes it.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "common/otlp/trace_context.h"

namespace slabstream {

// The numbers are OTLP's.
enum class SpanKind : std::uint8_t { kInternal = 1, kServer = 2, kClient = 3 };

// Named by OpenTelemetry's semantic conventions where these have a name ("http.route"), else "slabstream.NAME".
using TraceAttribute = std::pair<std::string, std::variant<std::string, std::int64_t, bool>>;

struct TraceSpan {
  TraceId trace{};
  SpanId id = NewSpanId();
  std::optional<SpanId> parent;
  std::string name;  // one of few: attributes tell one frame from another
  SpanKind kind = SpanKind::kInternal;
  std::int64_t begin_ns = 0, end_ns = 0;  // since 1970
  std::vector<TraceAttribute> attributes;
  std::optional<std::string> error;  // it failed, and why
};

// Who made the spans.
struct TraceSource {
  std::string program;  // "slabstream-gateway"
  std::string version;
  std::string instance;  // names this process alone
};

// This process as a source: its version, and an instance that is random.
TraceSource ThisProcess(std::string program);

// Text that is not UTF-8 is repaired.
std::string OtlpTraces(const TraceSource& source, std::span<const TraceSpan> spans);

// What a collector says in an answer to spans that it has not taken all; empty: it took them.
std::string RejectionIn(std::string_view answer);

}  // namespace slabstream
