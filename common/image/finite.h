// Whether what another process wrote can be a picture at all.
#pragma once

#include <cstddef>
#include <span>

namespace slabstream {

// No NaN and no infinity. `floats`: the bytes of floats, at any address.
bool AllFinite(std::span<const std::byte> floats);

// No NaN and nothing below the least float: depths, of which +infinity says that a pixel is empty.
bool AllDepths(std::span<const float> depths);

}  // namespace slabstream
