#pragma once

#include <cstdint>

namespace slabstream {

using WorkerId = std::uint32_t;  // unique within one coordinator's life, never reused. 0: nobody

}  // namespace slabstream
