#include "common/otlp/trace_context.h"

#include <sys/random.h>

#include "common/base/check.h"

namespace slabstream {
namespace {

constexpr std::string_view kDigits = "0123456789abcdef";

template <class Id>
Id Random() {
  Id id{};
  do {
    CHECK_EQ(::getrandom(id.data(), id.size(), 0), ssize_t(id.size()));
  } while (id == Id{});
  return id;
}

// Fills `bytes` from the digits at the beginning of `text`, and takes these off. False: there are too few, or one of them is none.
bool TakeHex(std::string_view& text, std::span<std::uint8_t> bytes) {
  if (text.size() < 2 * bytes.size()) return false;
  for (std::uint8_t& byte : bytes) {
    const std::size_t high = kDigits.find(text[0]), low = kDigits.find(text[1]);
    if (high == std::string_view::npos || low == std::string_view::npos) return false;
    byte = std::uint8_t(16 * high + low);
    text.remove_prefix(2);
  }
  return true;
}

bool TakeDash(std::string_view& text) {
  if (!text.starts_with('-')) return false;
  text.remove_prefix(1);
  return true;
}

}  // namespace

TraceId NewTraceId() { return Random<TraceId>(); }
SpanId NewSpanId() { return Random<SpanId>(); }

std::string Hex(std::span<const std::uint8_t> bytes) {
  std::string text;
  for (const std::uint8_t byte : bytes) {
    text += kDigits[byte / 16];
    text += kDigits[byte % 16];
  }
  return text;
}

std::optional<TraceParent> ParseTraceParent(std::string_view text) {
  std::array<std::uint8_t, 1> version{}, flags{};
  TraceParent parent;
  const bool read = TakeHex(text, version) && TakeDash(text) && TakeHex(text, parent.trace) && TakeDash(text) &&
                    TakeHex(text, parent.span) && TakeDash(text) && TakeHex(text, flags);
  if (!read || version[0] == 0xFF || parent.trace == TraceId{} || parent.span == SpanId{}) return std::nullopt;
  if (!text.empty() && (version[0] == 0 || !text.starts_with('-'))) return std::nullopt;
  parent.sampled = (flags[0] & 1) != 0;
  return parent;
}

}  // namespace slabstream
