// Of a volume whose voxels lie in processes (OwnedBox), some of which are gone.
#pragma once

#include <cstdint>

namespace slabstream {

inline constexpr std::uint32_t kNoOwner = ~std::uint32_t{0};  // OwnedBox::owner: it is gone, and its voxels show nothing

// What a picture shows then: nothing, so that it fails; nothing of their voxels; the last time that was shown while all were there.
enum class Missing : std::uint8_t { kFail = 1, kSkip = 2, kLast = 3 };

}  // namespace slabstream
