// How codecs decode streams that do not say how many bytes they hold: the memory for them grows as they come.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <string_view>
#include <utility>

#include "common/memory/pooled_vector.h"
#include "data/codecs/decoded_bytes.h"

namespace slabstream {

enum class StreamState : std::uint8_t { kGoesOn, kEnded, kDamaged };

// Calls `step` until the stream ends. It takes bytes from the front of `in` and writes to the front of `out`, and moves both to what is
// left. `codec`: for messages. DataLoss: the stream is damaged, cut off, or followed by other bytes. ResourceExhausted: it holds more than
// `most` bytes.
template <class Step>
Result<Bytes> DecodeGrowing(std::string_view codec, std::span<const std::byte> in, std::uint64_t most, Step&& step) {
  constexpr std::uint64_t kLeast = 65536;
  UnwrittenVector<std::byte> bytes(std::min(most, std::max<std::uint64_t>(4 * in.size(), kLeast)) + 1);
  std::span<std::byte> out = bytes;
  while (true) {
    const StreamState state = step(in, out);
    if (state == StreamState::kDamaged || (state == StreamState::kGoesOn && !out.empty())) return DamagedBytes(codec);
    if (bytes.size() - out.size() > most) return TooManyBytes(codec, most + 1, most);
    if (state == StreamState::kEnded) break;
    const std::size_t done = bytes.size();
    bytes.resize(std::min<std::uint64_t>(2 * done, most + 1));
    out = std::span(bytes).subspan(done);
  }
  if (!in.empty()) return DamagedBytes(codec);
  bytes.resize(bytes.size() - out.size());
  return Bytes(std::move(bytes));
}

// Libraries count in types of their own.
template <class Count, class Element>
Count CountFor(std::span<Element> bytes) {
  return Count(std::min<std::uint64_t>(bytes.size(), std::numeric_limits<Count>::max()));
}

}  // namespace slabstream
