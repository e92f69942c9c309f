// Sets of segments of one row of pixels, as bits: segments that are open, or that hold something. A segment is kSegment pixels, starting at
// a multiple of kSegment. Skipping empty and hidden parts of a row costs a few instructions for 64 segments.
#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>

namespace slabstream {

inline constexpr std::int32_t kSegment = 8;  // pixels

using SegmentWord = std::uint64_t;
inline constexpr std::int32_t kWordSegments = 64;
constexpr std::int32_t SegmentWords(std::int32_t segments) { return (segments + kWordSegments - 1) / kWordSegments; }

// Bits [begin, end) of a word, 0 <= begin <= end <= 64, begin < 64.
constexpr SegmentWord WordBits(std::int32_t begin, std::int32_t end) {
  const SegmentWord below_end = end == kWordSegments ? ~SegmentWord{0} : (SegmentWord{1} << end) - 1;
  return below_end & ~((SegmentWord{1} << begin) - 1);
}

// Calls function(word number, bits) for the words that hold bits of [begin, end).
template <class Function>
void ForEachWord(std::int32_t begin, std::int32_t end, Function&& function) {
  for (std::int32_t word = begin / kWordSegments; word * kWordSegments < end; ++word) {
    const std::int32_t origin = word * kWordSegments;
    function(word, WordBits(std::max(begin - origin, 0), std::min(end - origin, kWordSegments)));
  }
}

inline bool AnyOf(const SegmentWord* set, std::int32_t begin, std::int32_t end) {
  SegmentWord any = 0;
  ForEachWord(begin, end, [&](std::int32_t word, SegmentWord bits) { any |= set[word] & bits; });
  return any != 0;
}

inline void Insert(SegmentWord* set, std::int32_t begin, std::int32_t end) {
  ForEachWord(begin, end, [&](std::int32_t word, SegmentWord bits) { set[word] |= bits; });
}

inline void Remove(SegmentWord* set, std::int32_t begin, std::int32_t end) {
  ForEachWord(begin, end, [&](std::int32_t word, SegmentWord bits) { set[word] &= ~bits; });
}

// At most 64 neighbouring segments: bits of a word and of the next one.
struct SegmentSpan {
  std::uint32_t word = 0;
  SegmentWord first = 0, second = 0;
};
// Of segments [begin, end), begin < end.
constexpr SegmentSpan MakeSpan(std::int32_t begin, std::int32_t end) {
  const auto shift = std::uint32_t(begin) % std::uint32_t{kWordSegments};
  const SegmentWord bits = ~SegmentWord{0} >> (kWordSegments - (end - begin));
  return {std::uint32_t(begin) / std::uint32_t{kWordSegments}, bits << shift, bits >> 1 >> (kWordSegments - 1 - shift)};
}

// `set` has one word more than the row.
inline bool AnyOf(const SegmentWord* set, const SegmentSpan& span) {
  return ((set[span.word] & span.first) | (set[span.word + 1] & span.second)) != 0;
}
inline void Insert(SegmentWord* set, const SegmentSpan& span) {
  set[span.word] |= span.first;
  set[span.word + 1] |= span.second;
}

// The first segment of a word that is not 0.
inline std::int32_t FirstSegment(SegmentWord bits, std::int32_t word) { return word * kWordSegments + std::countr_zero(bits); }

}  // namespace slabstream
