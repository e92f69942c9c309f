// The ids of traces and spans, and the header by which a caller says which span its request belongs to
// (https://www.w3.org/TR/trace-context/).
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace slabstream {

using TraceId = std::array<std::uint8_t, 16>;
using SpanId = std::array<std::uint8_t, 8>;

// Random, never all zeros.
TraceId NewTraceId();
SpanId NewSpanId();
// Lower case.
std::string Hex(std::span<const std::uint8_t> bytes);

struct TraceParent {
  TraceId trace{};
  SpanId span{};
  bool sampled = false;  // whether the caller records its spans
  friend bool operator==(const TraceParent&, const TraceParent&) = default;
};

// "00-4bf92f3577b34da6a3ce929d0e0e4736-00f067aa0ba902b7-01"; more may follow in later versions. nullopt: anything else, which the standard
// wants ignored.
std::optional<TraceParent> ParseTraceParent(std::string_view text);

}  // namespace slabstream
