// Pictures as browsers take them, quickly: from the rows of a composed picture to the bytes of a JPEG or PNG. Any thread.
#pragma once

#include <atomic>
#include <cstddef>
#include <optional>
#include <vector>

#include "client/image_io/composed_picture.h"
#include "common/image/pixel_bounds.h"

namespace slabstream {

// JPEG of the pixels in `bounds`, which lies within the picture and is not empty, over black as far as the picture is transparent.
// `quality` in [1, 100]; from 85 colours have the full resolution.
std::vector<std::byte> EncodeJpeg(const ComposedPicture& picture, const PixelBounds& bounds, int quality);

// PNG of those pixels: the same codes as WritePicture stores, 8 bits a channel, straight alpha, packed for speed. nullopt: `given_up`
// became true meanwhile.
std::optional<std::vector<std::byte>> EncodePng(const ComposedPicture& picture, const PixelBounds& bounds,
                                                const std::atomic<bool>& given_up);

}  // namespace slabstream
