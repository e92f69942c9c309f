// Volumes for tests, from lists or at random.
#pragma once

#include <cstdint>

#include "common/volume/volume.h"
#include "tests/support/random.h"

namespace slabstream {

inline constexpr ScalarType kTypes[] = {ScalarType::kUint8, ScalarType::kUint16, ScalarType::kFloat32};

// A volume whose sample at voxel v is value(v), converted to the type.
template <class Value>
Volume MakeVolume(const VolumeGeometry& geometry, ScalarType type, const Value& value) {
  Volume volume;
  volume.description = {geometry, type, {}};
  volume.block = MakeVoxelBlock(geometry.bounds(), type);
  const Index3& size = geometry.size;
  VisitStoredType(type, [&]<class T>(const T*) {
    T* sample = volume.block.samples<T>();
    for (std::int32_t z = 0; z < size.z; ++z) {
      for (std::int32_t y = 0; y < size.y; ++y) {
        for (std::int32_t x = 0; x < size.x; ++x) *sample++ = T(value(Index3{x, y, z}));
      }
    }
  });
  return volume;
}

template <class Value>
Volume MakeTestVolume(const Index3& size, ScalarType type, const Value& value) {
  return MakeVolume({size}, type, value);
}

// Integers over the type's whole range, floats in [-1000, 1000).
inline Volume RandomVolume(Random& random, const Index3& size, ScalarType type) {
  return MakeTestVolume(size, type, [&](const Index3&) -> double {
    switch (type) {
      case ScalarType::kUint8: return random.Integer(0, 255);
      case ScalarType::kUint16: return random.Integer(0, 65535);
      default: break;
    }
    return random.Real(-1000, 1000);
  });
}

}  // namespace slabstream
