// What decoders share: refusals, and numbers beside the bytes.
#pragma once

#include <fmt/format.h>

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

#include "common/base/status.h"
#include "common/memory/bytes.h"

namespace slabstream {

inline Status DamagedBytes(std::string_view codec) { return Status::DataLoss(fmt::format("damaged: these are no bytes of {}", codec)); }

inline Status TooManyBytes(std::string_view codec, std::uint64_t bytes, std::uint64_t most) {
  return Status::ResourceExhausted(fmt::format("{} says that it holds {} bytes, at most {} are expected", codec, bytes, most));
}

// That there are as many bytes as whole elements have, and no more than `most`.
inline Status CheckElements(const Bytes& packed, std::size_t element_bytes, std::uint64_t most) {
  if (packed.size() > most) return TooManyBytes("a chunk", packed.size(), most);
  if (packed.size() % element_bytes == 0) return Status::Ok();
  return Status::DataLoss(fmt::format("has {} bytes, must have a multiple of {}", packed.size(), element_bytes));
}

// The number in the first four bytes, the lowest one first.
inline std::uint32_t Little32(std::span<const std::byte> bytes) {
  std::uint32_t number = 0;
  for (std::size_t i = 0; i < 4; ++i) number |= std::to_integer<std::uint32_t>(bytes[i]) << (8 * i);
  return number;
}

// Bytes with a checksum of 32 bits behind them or in front of them, its lowest byte first.
struct SummedBytes {
  Bytes bytes;
  std::uint32_t sum = 0;  // as it stands there
};
// `codec`: for messages. DataLoss: there is no room for a checksum; ResourceExhausted: more than `most` bytes are beside it.
inline Result<SummedBytes> TakeSum(std::string_view codec, const Bytes& packed, std::uint64_t most, bool in_front = false) {
  constexpr std::size_t kSumBytes = 4;
  if (packed.size() < kSumBytes) return DamagedBytes(codec);
  const std::size_t count = packed.size() - kSumBytes;
  if (count > most) return TooManyBytes(codec, count, most);
  const std::uint32_t sum = Little32(packed.span().subspan(in_front ? 0 : count));
  return SummedBytes{packed.Part(in_front ? kSumBytes : 0, count), sum};
}

}  // namespace slabstream
