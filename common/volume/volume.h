// What a volume is: geometry (dimensions, spacing, orientation), how stored samples map to data values, and the voxels of a box.
//
// Order: x fastest, then y, then z. The volume fills [-0.5, size - 0.5) of data space along each axis. A voxel's centre has integer
// coordinates there, unless the grid is rectilinear (stretch.h). Spacing is the distance of neighbouring centres, or the mean of them, in
// the unit of the world (mm for scans).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string_view>

#include "common/memory/aligned_buffer.h"
#include "common/volume/box.h"
#include "common/volume/orientation.h"
#include "common/volume/stretch.h"

namespace slabstream {

inline constexpr std::int32_t kMaxVolumeSide = 65535;  // voxels along an axis: in-slice positions fit 16 bits
// Voxels along an axis of a brick: a cube at a global multiple of this, for ranges of values (summary.h) and for storage (bricks.h).
inline constexpr std::int32_t kBrick = 16;

// kUint32 and kUint64 are of labels alone (labels.h): whoever draws or summarizes values never meets them.
enum class ScalarType : std::uint8_t { kUint8 = 1, kUint16 = 2, kFloat32 = 3, kUint32 = 4, kUint64 = 5 };
constexpr bool IsOfLabels(ScalarType type) { return type == ScalarType::kUint32 || type == ScalarType::kUint64; }

constexpr std::size_t BytesPerSample(ScalarType type) {
  return type == ScalarType::kUint8 ? 1 : type == ScalarType::kUint16 ? 2 : type == ScalarType::kUint64 ? 8 : 4;
}
constexpr std::string_view NameOf(ScalarType type) {
  constexpr std::array<std::string_view, 5> kNames = {"uint8", "uint16", "float32", "uint32", "uint64"};
  return kNames.at(std::size_t(type) - 1);
}

struct VolumeGeometry {
  Index3 size;               // voxels, each in [1, kMaxVolumeSide]
  Vec3 spacing = {1, 1, 1};  // > 0, finite
  Orientation orientation = {};
  Stretch stretch = {};

  bool rectilinear() const { return !stretch.even(); }
  Box bounds() const { return {{0, 0, 0}, size}; }
  Vec3 centre() const { return 0.5 * (ToVec3(size) - Vec3{1, 1, 1}); }  // data space
  // A point of data space, in the world.
  Vec3 ToWorld(const Vec3& p) const { return orientation.origin + orientation.ToWorld(spacing * p); }
  // The least distance of neighbouring voxels, in the unit of the spacing.
  double least_distance() const { return Least(rectilinear() ? stretch.LeastSteps() * spacing : spacing); }
  // The box of data space that holds the voxels of `box`, with whole corners: of an even grid, `box`.
  Box InDataSpace(const Box& box) const;
  friend bool operator==(const VolumeGeometry&, const VolumeGeometry&) = default;
};

// Data value = scale * stored sample + offset. Transfer functions, ranges and histograms are in data values.
struct ValueMapping {
  double scale = 1;
  double offset = 0;

  double FromStored(double stored) const { return scale * stored + offset; }
  friend bool operator==(const ValueMapping&, const ValueMapping&) = default;
};

// Everything about a volume but its voxels.
struct VolumeDescription {
  VolumeGeometry geometry;
  ScalarType type = ScalarType::kUint8;
  ValueMapping mapping;

  std::int64_t voxel_bytes() const { return geometry.bounds().voxel_count() * std::int64_t(BytesPerSample(type)); }
  friend bool operator==(const VolumeDescription&, const VolumeDescription&) = default;
};

// The samples of one box, owned. Sample of voxel v: byte offset BytesPerSample(type) * (((v.z - b.z) * sy + (v.y - b.y)) * sx + v.x - b.x)
// with b = box.begin and (sx, sy, sz) = box.size(). Immutable once shared between threads.
struct VoxelBlock {
  Box box;
  ScalarType type = ScalarType::kUint8;
  AlignedVector<std::byte> bytes;

  // Sample offset (in samples) of a voxel inside `box`.
  std::int64_t Offset(const Index3& v) const { return std::int64_t(NumberIn(box.size(), v - box.begin)); }
  template <class T>
  const T* samples() const {
    return reinterpret_cast<const T*>(bytes.data());
  }
  template <class T>
  T* samples() {
    return reinterpret_cast<T*>(bytes.data());
  }
};

// A block with zeroed samples.
VoxelBlock MakeVoxelBlock(const Box& box, ScalarType type);

// The samples of `box`, which lies inside the block and is not empty.
VoxelBlock CutBlock(const VoxelBlock& block, const Box& box);

// Calls `function` with a null pointer of the sample's C++ type: const std::uint8_t*, const std::uint16_t* or const float*.
template <class Function>
decltype(auto) VisitScalarType(ScalarType type, Function&& function) {
  switch (type) {
    case ScalarType::kUint8: return function(static_cast<const std::uint8_t*>(nullptr));
    case ScalarType::kUint16: return function(static_cast<const std::uint16_t*>(nullptr));
    default: break;
  }
  return function(static_cast<const float*>(nullptr));
}
// The same of labels: const std::uint8_t* ... const std::uint64_t*.
template <class Function>
decltype(auto) VisitLabelType(ScalarType type, Function&& function) {
  switch (type) {
    case ScalarType::kUint8: return function(static_cast<const std::uint8_t*>(nullptr));
    case ScalarType::kUint16: return function(static_cast<const std::uint16_t*>(nullptr));
    case ScalarType::kUint32: return function(static_cast<const std::uint32_t*>(nullptr));
    default: break;
  }
  return function(static_cast<const std::uint64_t*>(nullptr));
}

// The same of any samples.
template <class Function>
decltype(auto) VisitStoredType(ScalarType type, Function&& function) {
  if (type == ScalarType::kFloat32) return function(static_cast<const float*>(nullptr));
  return VisitLabelType(type, function);
}

struct Mesh;  // common/mesh/mesh.h

// A whole volume in memory: block.box is the geometry's bounds.
struct Volume {
  VolumeDescription description;
  VoxelBlock block;
  // The cells of an unstructured grid, in data space; the voxels are its values on a lattice.
  std::shared_ptr<const Mesh> cells = nullptr;
};

}  // namespace slabstream
