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

// A full product a voxel: nothing is kept from voxel to voxel. Vectors may run over the end of a beam. The next beam overwrites the excess,
// and there is room after the last one.
void StoreProduct(const TransformMatrix& matrix, const Index3& size, TransformedPoints& points) {
  const FloatTag d;
  const int lanes = int(hn::Lanes(d));
  for (int z = 0; z < size.z; ++z) {
    for (int y = 0; y < size.y; ++y) {
      for (int x = 0; x < size.x; x += lanes) {
        const auto vx = hn::Iota(d, float(x)), vy = hn::Set(d, float(y)), vz = hn::Set(d, float(z));
        const std::size_t i = (std::size_t(z) * std::size_t(size.y) + std::size_t(y)) * std::size_t(size.x) + std::size_t(x);
        for (std::size_t c = 0; c < 3; ++c) {
          const auto sum =
              hn::MulAdd(hn::Set(d, matrix[c][0]), vx,
                         hn::MulAdd(hn::Set(d, matrix[c][1]), vy, hn::MulAdd(hn::Set(d, matrix[c][2]), vz, hn::Set(d, matrix[c][3]))));
          hn::StoreU(sum, d, &points.components[c][i]);
        }
      }
    }
  }
}

// A vector of neighbours along the beam, moved on by one addition.
void RunningBeams(const TransformMatrix& matrix, const Index3& size, TransformedPoints& points) {
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
        for (int x = 0; x < size.x; x += lanes, voxels = hn::Add(voxels, step)) {
          hn::StoreU(voxels, d, &points.components[c][i + std::size_t(x)]);
        }
      }
    }
  }
}

// Vectors may run over the end here too: what lies behind `to` is not written yet, or there is room.
void AddStepTo(const float* from, float* to, std::size_t count, float step) {
  const FloatTag d;
  const auto steps = hn::Set(d, step);
  for (std::size_t i = 0; i < count; i += hn::Lanes(d)) hn::StoreU(hn::Add(hn::LoadU(d, from + i), steps), d, to + i);
}

// `vectors` vectors of this length, each from the one before it.
void AddVectors(float* values, int vectors, std::size_t length, float step) {
  for (int i = 1; i < vectors; ++i, values += length) AddStepTo(values, values + length, length, step);
}

void BeamPhase(const TransformMatrix& matrix, const Index3& size, TransformedPoints& points) {
  for (std::size_t c = 0; c < 3; ++c) AddVectors(points.components[c].data(), size.y, std::size_t(size.x), matrix[c][1]);
}

void SlicePhase(const TransformMatrix& matrix, const Index3& size, TransformedPoints& points) {
  const std::size_t slice = std::size_t(size.x) * std::size_t(size.y);
  for (std::size_t c = 0; c < 3; ++c) AddVectors(points.components[c].data(), size.z, slice, matrix[c][2]);
}

}  // namespace HWY_NAMESPACE
}  // namespace slabstream
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace slabstream {
HWY_EXPORT(StoreProduct);
HWY_EXPORT(RunningBeams);
HWY_EXPORT(AddStepTo);
HWY_EXPORT(BeamPhase);
HWY_EXPORT(SlicePhase);

void ProductVector(const TransformMatrix& matrix, const Index3& size, TransformedPoints& points) {
  HWY_DYNAMIC_DISPATCH(StoreProduct)(matrix, size, points);
}
void RunningBeamsVector(const TransformMatrix& matrix, const Index3& size, TransformedPoints& points) {
  HWY_DYNAMIC_DISPATCH(RunningBeams)(matrix, size, points);
}
void BeamPhaseVector(const TransformMatrix& matrix, const Index3& size, TransformedPoints& points) {
  HWY_DYNAMIC_DISPATCH(BeamPhase)(matrix, size, points);
}
void SlicePhaseVector(const TransformMatrix& matrix, const Index3& size, TransformedPoints& points) {
  HWY_DYNAMIC_DISPATCH(SlicePhase)(matrix, size, points);
}
void AddStep(const float* from, float* to, std::size_t count, float step) { HWY_DYNAMIC_DISPATCH(AddStepTo)(from, to, count, step); }

}  // namespace slabstream
#endif
