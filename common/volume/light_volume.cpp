#include "common/volume/light_volume.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <type_traits>
#include <vector>

#include "common/parallel/parallel.h"

namespace slabstream {
namespace {

Index3 BlockOf(const Index3& size) { return CubesOver(size, kMaxLightSide); }

// Adds samples to columns, and counts the finite ones. Lengths that the compiler knows let it take whole registers.
template <class T, class Sum>
void AddRow(const T* __restrict row, std::size_t count, Sum* __restrict columns, std::uint32_t* __restrict counts) {
  const auto add = [&](std::size_t x) {
    if constexpr (std::is_same_v<T, float>) {
      const bool finite = std::isfinite(row[x]);
      columns[x] += finite ? row[x] : 0;
      counts[x] += finite ? 1 : 0;
    } else {
      columns[x] += row[x];
    }
  };
  constexpr std::size_t kAtOnce = 16;
  std::size_t x = 0;
  for (; x + kAtOnce <= count; x += kAtOnce) {
    for (std::size_t i = 0; i < kAtOnce; ++i) add(x + i);
  }
  for (; x < count; ++x) add(x);
}

// Means of one slice of blocks, from the samples of `slab`, the voxels in it. Columns of a block are added up first, which whole registers
// do.
template <class T>
void AverageBlocks(const T* samples, const Index3& slab, const Index3& block, const Index3& blocks, T* means) {
  constexpr bool kFloat = std::is_same_v<T, float>;
  // Of integers exact: the slice has at most 512 slices, and a block as many rows.
  using Sum = std::conditional_t<kFloat, double, std::uint32_t>;
  std::vector<Sum> columns(std::size_t(slab.x));
  std::vector<std::uint32_t> counts(kFloat ? columns.size() : 0);  // of finite samples
  for (std::int32_t j = 0; j < blocks.y; ++j) {
    std::ranges::fill(columns, Sum{});
    std::ranges::fill(counts, 0U);
    const std::int32_t y_begin = j * block.y, y_end = std::min(y_begin + block.y, slab.y);
    for (std::int32_t z = 0; z < slab.z; ++z) {
      for (std::int32_t y = y_begin; y < y_end; ++y) {
        const T* const row = samples + (std::size_t(z) * std::size_t(slab.y) + std::size_t(y)) * columns.size();
        AddRow(row, columns.size(), columns.data(), counts.data());
      }
    }
    const auto column_voxels = std::uint64_t(y_end - y_begin) * std::uint64_t(slab.z);
    for (std::int32_t i = 0; i < blocks.x; ++i, ++means) {
      const auto begin = std::size_t(i) * std::size_t(block.x), end = std::min(begin + std::size_t(block.x), columns.size());
      std::conditional_t<kFloat, double, std::uint64_t> sum{};
      std::uint64_t count = kFloat ? 0 : (end - begin) * column_voxels;
      for (std::size_t x = begin; x < end; ++x) {
        sum += columns[x];
        if constexpr (kFloat) count += counts[x];
      }
      if constexpr (kFloat) {
        *means = count == 0 ? std::numeric_limits<float>::quiet_NaN() : float(sum / double(count));
      } else {
        *means = T(double(sum + count / 2) / double(count));  // cut to a whole number: exact, and faster than a division of integers
      }
    }
  }
}

// samples_of(slices of the volume, room that it may use): their samples.
template <class SamplesOf>
Volume FromSlabs(const VolumeDescription& description, SamplesOf&& samples_of) {
  Volume light{.description = description, .block = {}};
  const Index3& size = description.geometry.size;
  const Index3 block = BlockOf(size);
  light.description.geometry = LightGeometry(description.geometry);
  const Index3& blocks = light.description.geometry.size;
  light.block = MakeVoxelBlock(light.description.geometry.bounds(), description.type);
  VisitScalarType(description.type, [&]<class T>(const T*) {
    ParallelFor(0, blocks.z, [&](std::int32_t k) {
      const Box slab = {{0, 0, k * block.z}, {size.x, size.y, std::min((k + 1) * block.z, size.z)}};
      std::vector<std::byte> room;
      const std::byte* const samples = samples_of(slab, room);
      AverageBlocks(reinterpret_cast<const T*>(samples), slab.size(), block, blocks,
                    light.block.samples<T>() + std::size_t(k) * std::size_t(blocks.x) * std::size_t(blocks.y));
    });
  });
  return light;
}

}  // namespace

VolumeGeometry LightGeometry(const VolumeGeometry& geometry) {
  const Index3 block = BlockOf(geometry.size);
  VolumeGeometry light = geometry;
  light.size = (geometry.size + block - Uniform(1)) / block;
  light.spacing = geometry.spacing * ToVec3(block);
  light.orientation.origin = geometry.ToWorld(0.5 * (ToVec3(block) - Vec3{1, 1, 1}));
  return light;
}

Volume MakeLightVolume(const VoxelBlock& voxels, const VolumeDescription& description) {
  const std::size_t slice_bytes =
      CountIn(description.geometry.size) / std::size_t(description.geometry.size.z) * BytesPerSample(description.type);
  return FromSlabs(description,
                   [&](const Box& slab, std::vector<std::byte>&) { return voxels.bytes.data() + std::size_t(slab.begin.z) * slice_bytes; });
}

Volume MakeLightVolume(const BrickedVoxels& voxels, const VolumeDescription& description) {
  return FromSlabs(description, [&](const Box& slab, std::vector<std::byte>& room) {
    room.resize(std::size_t(slab.voxel_count()) * BytesPerSample(description.type));
    VoxelBricks(voxels).Read(slab, 0, room);
    return static_cast<const std::byte*>(room.data());
  });
}

}  // namespace slabstream
