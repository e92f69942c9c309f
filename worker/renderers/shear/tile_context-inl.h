// TileContext: what all passes of a tile know. Included once for each instruction set, hence the unusual include guard.
#include <hwy/highway.h>

#include "worker/rays/ray_packet-inl.h"
#include "worker/renderers/shear/tile_room.h"

#if defined(SLABSTREAM_WORKER_RENDERERS_SHEAR_TILE_CONTEXT_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef SLABSTREAM_WORKER_RENDERERS_SHEAR_TILE_CONTEXT_INL_H_
#undef SLABSTREAM_WORKER_RENDERERS_SHEAR_TILE_CONTEXT_INL_H_
#else
#define SLABSTREAM_WORKER_RENDERERS_SHEAR_TILE_CONTEXT_INL_H_
#endif

HWY_BEFORE_NAMESPACE();
namespace slabstream::HWY_NAMESPACE {
namespace {

using namespace slabstream::shear;  // NOLINT(google-build-using-namespace): one namespace for each instruction set

constexpr std::int32_t kVector = std::int32_t(kLanes);
static_assert(kChunk % kVector == 0);

class TileContext {
 public:
  TileContext(const ShearWork& work, const TilePixels& tile, TileRoom& room)
      : work_(work),
        passes_(*work.passes),
        rays_(*work.rays),
        tile_(tile),
        room_(room),
        centre_u_(passes_.turned ? rays_.centre_y : rays_.centre_x),
        centre_v_(passes_.turned ? rays_.centre_x : rays_.centre_y),
        scale_(work.supersampling),
        clipped_(!rays_.clip.empty()),
        parts_(rays_.clip.cut_away ? 2 : 1),
        gradients_(work.look->phong || !work.look->gradient_factors.empty()) {
    const std::size_t z_axis = std::size_t(Number(passes_.axes[2]));
    z_move_ = rays_.step * rays_.forward[z_axis];
    z_inverse_ = 1 / z_move_;
    for (std::size_t place = 0; place < 3; ++place) places_[std::size_t(Number(passes_.axes[place]))] = place;
  }

 protected:
  static constexpr float kFar = 1e9F;

  float U(std::int32_t column) const { return float(tile_.u_begin + column) - centre_u_; }
  float V(std::int32_t row) const { return float(tile_.v_begin + row) - centre_v_; }
  static HWY_INLINE Floats Columns(float first) { return hn::Add(Set(first), hn::ConvertTo(FloatTag(), hn::Iota(IntTag(), 0))); }

  // z of sample k, in slices.
  HWY_INLINE Floats SliceOf(Floats z_of_first, Floats k) const {
    return hn::Mul(hn::Add(z_of_first, hn::Mul(k, Set(z_move_))), Set(float(scale_)));
  }

  static std::int32_t FloorDiv(std::int32_t a, std::int32_t b) { return a >= 0 ? a / b : -((b - 1 - a) / b); }

  const ShearWork& work_;
  const ShearPasses& passes_;
  const ViewRays& rays_;
  const TilePixels& tile_;
  TileRoom& room_;
  const float centre_u_, centre_v_;
  const int scale_;  // beams, and slices, for each of the volume
  const bool clipped_;
  const int parts_;
  const bool gradients_;
  float z_move_ = 1, z_inverse_ = 1;  // voxels along z from sample to sample
  std::size_t places_[3] = {};        // in GradientRoom, by axis of the volume
};

}  // namespace
}  // namespace slabstream::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
