#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "laboratory/measure/transform_vector.cpp"
#include <hwy/foreach_target.h>
// Highway wants this order.
#include <hwy/highway.h>

#include "laboratory/measure/transform_loops.h"

HWY_BEFORE_NAMESPACE();
namespace slabstream {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using FloatTag = hn::ScalableTag<float>;

// A full product a voxel: nothing is kept from voxel to voxel.
template <class Use>
HWY_INLINE void Products(const TransformMatrix& matrix, const Index3& size, Use&& use) {
  const FloatTag d;
  const int lanes = int(hn::Lanes(d));
  for (int z = 0; z < size.z; ++z) {
    for (int y = 0; y < size.y; ++y) {
      for (int x = 0; x < size.x; x += lanes) {
        const auto vx = hn::Iota(d, float(x)), vy = hn::Set(d, float(y)), vz = hn::Set(d, float(z));
        for (std::size_t c = 0; c < 3; ++c) {
          const auto sum =
              hn::MulAdd(hn::Set(d, matrix[c][0]), vx,
                         hn::MulAdd(hn::Set(d, matrix[c][1]), vy, hn::MulAdd(hn::Set(d, matrix[c][2]), vz, hn::Set(d, matrix[c][3]))));
          use(c, (std::size_t(z) * std::size_t(size.y) + std::size_t(y)) * std::size_t(size.x) + std::size_t(x), sum);
        }
      }
    }
  }
}

// A vector of neighbours along the beam, moved on by one addition.
template <class Use>
HWY_INLINE void Increments(const TransformMatrix& matrix, const Index3& size, Use&& use) {
  const FloatTag d;
  const int lanes = int(hn::Lanes(d));
  for (std::size_t c = 0; c < 3; ++c) {
    const auto step = hn::Set(d, matrix[c][0] * float(lanes)), first = hn::Mul(hn::Iota(d, 0.0F), hn::Set(d, matrix[c][0]));
    float slice = matrix[c][3];
    std::size_t i = 0;
    for (int z = 0; z < size.z; ++z, slice += matrix[c][2]) {
      float beam = slice;
      for (int y = 0; y < size.y; ++y, beam += matrix[c][1], i += std::size_t(size.x)) {
        auto voxels = hn::Add(first, hn::Set(d, beam));
        for (int x = 0; x < size.x; x += lanes, voxels = hn::Add(voxels, step)) use(c, i + std::size_t(x), voxels);
      }
    }
  }
}

// Vectors may run over the end of a beam. The next beam overwrites the excess, and there is room after the last one.
void StoreProduct(const TransformMatrix& matrix, const Index3& size, TransformedPoints& points) {
  Products(matrix, size, [&](std::size_t c, std::size_t i, auto v) HWY_ATTR { hn::StoreU(v, FloatTag(), &points.components[c][i]); });
}
void StoreIncrements(const TransformMatrix& matrix, const Index3& size, TransformedPoints& points) {
  Increments(matrix, size, [&](std::size_t c, std::size_t i, auto v) HWY_ATTR { hn::StoreU(v, FloatTag(), &points.components[c][i]); });
}

std::uint32_t FuseProduct(const TransformMatrix& matrix, const Index3& size) {
  const hn::RebindToUnsigned<FloatTag> du;
  auto used = hn::Zero(du);
  Products(matrix, size, [&](std::size_t, std::size_t, auto v) HWY_ATTR { used = hn::Xor(used, hn::BitCast(du, v)); });
  return hn::GetLane(hn::SumOfLanes(du, used));
}
std::uint32_t FuseIncrements(const TransformMatrix& matrix, const Index3& size) {
  const hn::RebindToUnsigned<FloatTag> du;
  auto used = hn::Zero(du);
  Increments(matrix, size, [&](std::size_t, std::size_t, auto v) HWY_ATTR { used = hn::Xor(used, hn::BitCast(du, v)); });
  return hn::GetLane(hn::SumOfLanes(du, used));
}

}  // namespace HWY_NAMESPACE
}  // namespace slabstream
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace slabstream {
HWY_EXPORT(StoreProduct);
HWY_EXPORT(StoreIncrements);
HWY_EXPORT(FuseProduct);
HWY_EXPORT(FuseIncrements);

void StoreProductVector(const TransformMatrix& matrix, const Index3& size, TransformedPoints& points) {
  HWY_DYNAMIC_DISPATCH(StoreProduct)(matrix, size, points);
}
void StoreIncrementsVector(const TransformMatrix& matrix, const Index3& size, TransformedPoints& points) {
  HWY_DYNAMIC_DISPATCH(StoreIncrements)(matrix, size, points);
}
std::uint32_t FuseProductVector(const TransformMatrix& matrix, const Index3& size) {
  return HWY_DYNAMIC_DISPATCH(FuseProduct)(matrix, size);
}
std::uint32_t FuseIncrementsVector(const TransformMatrix& matrix, const Index3& size) {
  return HWY_DYNAMIC_DISPATCH(FuseIncrements)(matrix, size);
}

}  // namespace slabstream
#endif
