// Bytes as text, for comparisons.
#pragma once

#include <cstddef>
#include <span>
#include <string>

namespace slabstream {

inline std::string TextOf(std::span<const std::byte> bytes) { return {reinterpret_cast<const char*>(bytes.data()), bytes.size()}; }

}  // namespace slabstream
