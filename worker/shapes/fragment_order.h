// FragmentOrder: where the fragments of shapes lie among the samples of a frame's rays. One in the volume belongs to the box that holds it,
// which composites it among its samples. Whoever finishes the picture composites those in front of the volume and behind it.
//
// In a frame along slices a fragment lies in front of the next slice behind it, and belongs to the box that owns that slice's sample.
//
// All is computed in double precision from pixel and depth alone, so all boxes agree whose a fragment is.
#pragma once

#include <cstdint>

#include "common/frame/frame_setup.h"

namespace slabstream {

class FragmentOrder {
 public:
  explicit FragmentOrder(const FrameSetup& setup);

  enum class Side : std::uint8_t { kFront, kInside, kBehind };
  struct Place {
    Vec3 at;  // data space; not in a frame along slices
    Side side = Side::kInside;
  };
  Place Of(std::int32_t x, std::int32_t y, float depth) const;

 private:
  const Camera& camera_;
  const bool along_slices_;
  double first_slice_ = 0, last_slice_ = 0;  // as depths
  const Vec3 low_, high_;                    // of the volume: low <= p < high
};

}  // namespace slabstream
