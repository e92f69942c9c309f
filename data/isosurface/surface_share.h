// Which part of a surface a process makes.
#pragma once

namespace slabstream {

inline constexpr int kMostSurfaceParts = 4096;
inline constexpr int kLeastPartSlices = 16;  // of a level, so that no part is all border

struct SurfaceShare {
  int part = 1, parts = 1;  // `part` in [1, parts], the first slices along z first
};

}  // namespace slabstream
