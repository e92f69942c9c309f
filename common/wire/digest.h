// The digest of payloads: XXH3-64 with seed 0, by the widest vectors that this processor has.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace slabstream {

std::uint64_t Digest(std::span<const std::byte> bytes);

}  // namespace slabstream
