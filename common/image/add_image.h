// Shares of a picture that several workers have finished, put together.
#pragma once

namespace slabstream {

struct LocalImage;

// Adds the pixels of `share` to `sum`, which has the same format and whose bounds contain those of the share. Where
// both have a pixel, colours are added and the smaller depth stays. Both store all their pixels and have no voxel
// plane, as pictures do. Rows are added in parallel, within the caller's task arena.
void AddImage(LocalImage& sum, const LocalImage& share);

}  // namespace slabstream
