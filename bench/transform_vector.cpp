#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "bench/transform_vector.cpp"
#include <hwy/foreach_target.h>
// Highway wants this order.
#include <hwy/highway.h>

#include "bench/transform_loops.h"

HWY_BEFORE_NAMESPACE();
namespace slabstream::bench {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using FloatTag = hn::ScalableTag<float>;

// A full product a voxel: nothing is kept from voxel to voxel.
template <class Use>
HWY_INLINE void Products(const Matrix& matrix, int side, Use&& use) {
  const FloatTag d;
  const int lanes = int(hn::Lanes(d));
  for (int z = 0; z < side; ++z) {
    for (int y = 0; y < side; ++y) {
      for (int x = 0; x < side; x += lanes) {
        const auto vx = hn::Iota(d, float(x)), vy = hn::Set(d, float(y)), vz = hn::Set(d, float(z));
        for (std::size_t c = 0; c < 3; ++c) {
          const auto sum =
              hn::MulAdd(hn::Set(d, matrix[c][0]), vx,
                         hn::MulAdd(hn::Set(d, matrix[c][1]), vy, hn::MulAdd(hn::Set(d, matrix[c][2]), vz, hn::Set(d, matrix[c][3]))));
          use(c, (std::size_t(z) * std::size_t(side) + std::size_t(y)) * std::size_t(side) + std::size_t(x), sum);
        }
      }
    }
  }
}

// A vector of neighbours along the beam, moved on by one addition.
template <class Use>
HWY_INLINE void Increments(const Matrix& matrix, int side, Use&& use) {
  const FloatTag d;
  const int lanes = int(hn::Lanes(d));
  for (std::size_t c = 0; c < 3; ++c) {
    const auto step = hn::Set(d, matrix[c][0] * float(lanes)), first = hn::Mul(hn::Iota(d, 0.0F), hn::Set(d, matrix[c][0]));
    float slice = matrix[c][3];
    std::size_t i = 0;
    for (int z = 0; z < side; ++z, slice += matrix[c][2]) {
      float beam = slice;
      for (int y = 0; y < side; ++y, beam += matrix[c][1], i += std::size_t(side)) {
        auto voxels = hn::Add(first, hn::Set(d, beam));
        for (int x = 0; x < side; x += lanes, voxels = hn::Add(voxels, step)) use(c, i + std::size_t(x), voxels);
      }
    }
  }
}

// Vectors may run over the end of a beam; the next one overwrites that, and behind the last one there is room.
void StoreProduct(const Matrix& matrix, int side, Points& points) {
  Products(matrix, side, [&](std::size_t c, std::size_t i, auto v) HWY_ATTR { hn::StoreU(v, FloatTag(), &points.components[c][i]); });
}
void StoreIncrements(const Matrix& matrix, int side, Points& points) {
  Increments(matrix, side, [&](std::size_t c, std::size_t i, auto v) HWY_ATTR { hn::StoreU(v, FloatTag(), &points.components[c][i]); });
}

std::uint32_t FuseProduct(const Matrix& matrix, int side) {
  const hn::RebindToUnsigned<FloatTag> du;
  auto used = hn::Zero(du);
  Products(matrix, side, [&](std::size_t, std::size_t, auto v) HWY_ATTR { used = hn::Xor(used, hn::BitCast(du, v)); });
  return hn::GetLane(hn::SumOfLanes(du, used));
}
std::uint32_t FuseIncrements(const Matrix& matrix, int side) {
  const hn::RebindToUnsigned<FloatTag> du;
  auto used = hn::Zero(du);
  Increments(matrix, side, [&](std::size_t, std::size_t, auto v) HWY_ATTR { used = hn::Xor(used, hn::BitCast(du, v)); });
  return hn::GetLane(hn::SumOfLanes(du, used));
}

}  // namespace HWY_NAMESPACE
}  // namespace slabstream::bench
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace slabstream::bench {
HWY_EXPORT(StoreProduct);
HWY_EXPORT(StoreIncrements);
HWY_EXPORT(FuseProduct);
HWY_EXPORT(FuseIncrements);

void StoreProductVector(const Matrix& matrix, int side, Points& points) { HWY_DYNAMIC_DISPATCH(StoreProduct)(matrix, side, points); }
void StoreIncrementsVector(const Matrix& matrix, int side, Points& points) { HWY_DYNAMIC_DISPATCH(StoreIncrements)(matrix, side, points); }
std::uint32_t FuseProductVector(const Matrix& matrix, int side) { return HWY_DYNAMIC_DISPATCH(FuseProduct)(matrix, side); }
std::uint32_t FuseIncrementsVector(const Matrix& matrix, int side) { return HWY_DYNAMIC_DISPATCH(FuseIncrements)(matrix, side); }

}  // namespace slabstream::bench
#endif
