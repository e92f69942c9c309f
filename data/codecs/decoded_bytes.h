// What decoders share: parts of bytes, and refusals.
#pragma once

#include <fmt/format.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string_view>
#include <utility>

#include "common/base/bytes.h"
#include "common/base/status.h"

namespace slabstream {

// The first bytes, without a copy.
inline Bytes FirstBytes(Bytes bytes, std::size_t count) {
  auto whole = std::make_shared<const Bytes>(std::move(bytes));
  const std::span<const std::byte> first = whole->span().first(count);
  return {std::move(whole), first};
}

inline Status DamagedBytes(std::string_view codec) { return Status::DataLoss(fmt::format("damaged: these are no bytes of {}", codec)); }

inline Status TooManyBytes(std::string_view codec, std::uint64_t bytes, std::uint64_t most) {
  return Status::ResourceExhausted(fmt::format("{} says that it holds {} bytes, at most {} are expected", codec, bytes, most));
}

}  // namespace slabstream
