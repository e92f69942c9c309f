// From the supersampled frame to final pixels: each final pixel is the mean of supersample x supersample fine ones (premultiplied RGBA),
// its depth the smallest. Sums run in a fixed order, so the result is the same wherever it is computed.
#pragma once

namespace slabstream {

struct LocalImage;

// `supersample` is a power of two; 1 returns the image unchanged. Bounds of the result are in final pixels, grown to whole ones.
LocalImage Resolve(const LocalImage& image, int supersample);

}  // namespace slabstream
