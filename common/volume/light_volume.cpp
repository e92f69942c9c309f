#include "common/volume/light_volume.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "common/volume/light_volume.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <type_traits>
#include <vector>

#include "common/parallel/parallel.h"

#ifndef SLABSTREAM_COMMON_VOLUME_LIGHT_VOLUME_CPP_  // shared by all instruction sets
#define SLABSTREAM_COMMON_VOLUME_LIGHT_VOLUME_CPP_
namespace slabstream {

inline constexpr std::size_t kMostLanes = 16;  // numbers that kernels may write beyond a row

// Rows along x that are added up, column by column.
template <class T>
struct ColumnsOfRows {
  const T* first = nullptr;
  std::size_t width = 0;
  std::int32_t rows = 0, slices = 0;  // rows in a slice
  std::ptrdiff_t slice = 0;           // samples from slice to slice; rows follow each other
};

}  // namespace slabstream
#endif

HWY_BEFORE_NAMESPACE();
namespace slabstream::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

// add(x, load) for columns from x on, a register at a time; load(row) reads those of a row, which begin there, and 0 beyond the width.
template <class D, class Add>
void ForEachRegister(D d, std::size_t width, Add&& add) {
  using T = hn::TFromD<D>;
  std::size_t x = 0;
  for (; x + hn::Lanes(d) <= width; x += hn::Lanes(d)) add(x, [&](const T* from) HWY_ATTR { return hn::LoadU(d, from); });
  if (x == width) return;
  add(x, [&](const T* from) HWY_ATTR {
    HWY_ALIGN T rest[kMostLanes] = {};
    std::copy_n(from, width - x, rest);
    return hn::Load(d, rest);
  });
}

// Sums of columns of integers, which are exact: a slice has less than 2^15 rows.
template <class T>
void AddIntegers(const ColumnsOfRows<T>& columns, double* sums) {
  const hn::CappedTag<std::int32_t, kMostLanes> di;
  const hn::Half<decltype(di)> dh;
  const hn::Rebind<T, decltype(di)> dt;
  const hn::Rebind<double, decltype(dh)> dd;
  ForEachRegister(dt, columns.width, [&](std::size_t x, auto&& load) HWY_ATTR {
    auto low = hn::Zero(dd), high = low;
    for (std::int32_t slice = 0; slice < columns.slices; ++slice) {
      const T* row = columns.first + slice * columns.slice + x;
      auto sum = hn::Zero(di);
      for (std::int32_t i = 0; i < columns.rows; ++i, row += columns.width) sum = hn::Add(sum, hn::PromoteTo(di, load(row)));
      low = hn::Add(low, hn::PromoteTo(dd, hn::LowerHalf(dh, sum)));
      high = hn::Add(high, hn::PromoteTo(dd, hn::UpperHalf(dh, sum)));
    }
    hn::StoreU(low, dd, sums + x);
    hn::StoreU(high, dd, sums + x + hn::Lanes(dd));
  });
}
void AddBytes(const ColumnsOfRows<std::uint8_t>& columns, double* sums) { AddIntegers(columns, sums); }
void AddShorts(const ColumnsOfRows<std::uint16_t>& columns, double* sums) { AddIntegers(columns, sums); }

// Means of `count` integers each, from their sums; halves round up.
template <class T>
void MeansOfIntegers(const double* sums, std::size_t blocks, double count, T* means) {
  const hn::CappedTag<double, kMostLanes / 2> dd;
  const hn::Rebind<std::int32_t, decltype(dd)> di;
  const hn::Rebind<T, decltype(dd)> dt;
  // What is cut off a whole number lies at least half of 1 / count below the next one, far more than what the factor is off by.
  const auto half = hn::Set(dd, std::floor(count / 2) + 0.5), factor = hn::Set(dd, 1 / count);
  for (std::size_t i = 0; i < blocks; i += hn::Lanes(dd)) {
    const auto mean = hn::Mul(hn::Add(hn::LoadU(dd, sums + i), half), factor);
    hn::StoreU(hn::DemoteTo(dt, hn::DemoteTo(di, mean)), dt, means + i);
  }
}
void MeansOfBytes(const double* sums, std::size_t blocks, double count, std::uint8_t* means) {
  MeansOfIntegers(sums, blocks, count, means);
}
void MeansOfShorts(const double* sums, std::size_t blocks, double count, std::uint16_t* means) {
  MeansOfIntegers(sums, blocks, count, means);
}

// Sums of the finite samples of columns, and how many there are.
void AddFloats(const ColumnsOfRows<float>& columns, double* sums, double* counts) {
  const hn::CappedTag<double, kMostLanes / 2> dd;
  const hn::Rebind<float, decltype(dd)> df;
  ForEachRegister(df, columns.width, [&](std::size_t x, auto&& load) HWY_ATTR {
    auto sum = hn::Zero(dd), count = sum;
    for (std::int32_t slice = 0; slice < columns.slices; ++slice) {
      const float* row = columns.first + slice * columns.slice + x;
      for (std::int32_t i = 0; i < columns.rows; ++i, row += columns.width) {
        const auto each = load(row);
        const auto finite = hn::IsFinite(each);
        sum = hn::Add(sum, hn::PromoteTo(dd, hn::IfThenElseZero(finite, each)));
        count = hn::Add(count, hn::PromoteTo(dd, hn::IfThenElseZero(finite, hn::Set(df, 1))));
      }
    }
    hn::StoreU(sum, dd, sums + x);
    hn::StoreU(count, dd, counts + x);
  });
}

}  // namespace slabstream::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace slabstream {
namespace {

HWY_EXPORT(AddBytes);
HWY_EXPORT(AddShorts);
HWY_EXPORT(AddFloats);
HWY_EXPORT(MeansOfBytes);
HWY_EXPORT(MeansOfShorts);

Index3 BlockOf(const Index3& size) { return CubesOver(size, kMaxLightSide); }

// Turns sums of columns into those of blocks, each of `length` columns, the last one perhaps of fewer.
void JoinColumns(std::size_t width, std::size_t length, std::vector<double>& sums) {
  if (length == 1) return;
  for (std::size_t i = 0; i * length < width; ++i) {
    double sum = 0;
    for (std::size_t x = i * length; x < std::min((i + 1) * length, width); ++x) sum += sums[x];
    sums[i] = sum;
  }
}

// Means of one slice of blocks, from the samples of `slab`, the voxels in it.
template <class T>
void AverageBlocks(const T* samples, const Index3& slab, const Index3& block, const Index3& blocks, T* means) {
  const auto width = std::size_t(slab.x), length = std::size_t(block.x), count = std::size_t(blocks.x);
  std::vector<double> sums(width + kMostLanes), counts(std::is_same_v<T, float> ? sums.size() : 0);
  std::vector<T> row(count + kMostLanes);
  for (std::int32_t j = 0; j < blocks.y; ++j, means += count) {
    const std::int32_t y_begin = j * block.y, y_end = std::min(y_begin + block.y, slab.y);
    const ColumnsOfRows<T> columns = {samples + std::size_t(y_begin) * width, width, y_end - y_begin, slab.z,
                                      std::ptrdiff_t{slab.x} * slab.y};
    if constexpr (std::is_same_v<T, float>) {
      HWY_DYNAMIC_DISPATCH(AddFloats)(columns, sums.data(), counts.data());
      JoinColumns(width, length, sums);
      JoinColumns(width, length, counts);
      for (std::size_t i = 0; i < count; ++i) {
        means[i] = counts[i] == 0 ? std::numeric_limits<float>::quiet_NaN() : float(sums[i] / counts[i]);
      }
    } else {
      const double column = double(columns.rows) * columns.slices;
      const auto divide = [&](const double* from, std::size_t many, double each, T* to) {
        if constexpr (std::is_same_v<T, std::uint8_t>) {
          HWY_DYNAMIC_DISPATCH(MeansOfBytes)(from, many, each, to);
        } else {
          HWY_DYNAMIC_DISPATCH(MeansOfShorts)(from, many, each, to);
        }
      };
      if constexpr (std::is_same_v<T, std::uint8_t>) {
        HWY_DYNAMIC_DISPATCH(AddBytes)(columns, sums.data());
      } else {
        HWY_DYNAMIC_DISPATCH(AddShorts)(columns, sums.data());
      }
      JoinColumns(width, length, sums);
      divide(sums.data(), count, column * double(length), row.data());
      divide(&sums[count - 1], 1, column * double(width - (count - 1) * length), &row[count - 1]);  // the last block may have fewer columns
      std::copy_n(row.data(), count, means);
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
#endif
