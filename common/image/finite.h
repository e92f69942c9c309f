// Whether values that another process wrote can be those of a picture.
#pragma once

#include <cstddef>
#include <span>

namespace slabstream {

// True if no float is NaN or infinite. `floats`: the bytes of floats, at any address.
bool AllFinite(std::span<const std::byte> floats);

// True if no depth is NaN or -infinity. A depth of +infinity marks an empty pixel.
bool AllDepths(std::span<const float> depths);

}  // namespace slabstream
