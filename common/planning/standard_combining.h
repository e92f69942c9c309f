// The combining scheme of frames whose policy names none. docs/tuning.md has its table and says how it was measured.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>

namespace slabstream {

// Pure. `pixels` of the picture. ParseCombining takes the name.
std::string_view StandardCombining(std::size_t workers, std::int64_t pixels);

}  // namespace slabstream
