// How far away points of the world may be named.
#pragma once

namespace slabstream {

// The limit of coordinates and distances, either sign: practically any number is allowed. A bound of a clip box there
// does not clip.
inline constexpr double kMaxCoordinate = 1e300;

}  // namespace slabstream
