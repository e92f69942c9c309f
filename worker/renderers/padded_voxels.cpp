#include "worker/renderers/padded_voxels.h"

#include <algorithm>
#include <cstring>
#include <limits>
#include <span>
#include <type_traits>

#include "common/base/check.h"
#include "common/parallel/parallel.h"

namespace slabstream {
namespace {

// Row y of slice z of `inside`, with the padding at its ends.
template <class T>
void FillRow(const VoxelBricks& voxels, const Box& inside, std::int32_t y, std::int32_t z, std::int32_t left, std::int32_t count, T* row) {
  const Box read = {{inside.begin.x, y, z}, {inside.end.x, y + 1, z + 1}};
  const std::int32_t width = inside.size().x;
  voxels.Read(read, 0, std::as_writable_bytes(std::span(row + left, std::size_t(width))));
  std::fill_n(row, left, row[left]);
  std::fill_n(row + left + width, count - left - width, row[left + width - 1]);
}

// `to` is 0.
template <class T>
void RepeatRow(const T* from, std::int32_t count, T* to) {
  if (std::any_of(from, from + count, [](T sample) { return sample != 0; })) std::memcpy(to, from, std::size_t(count) * sizeof(T));
}

}  // namespace

PaddedVoxels MakePaddedVoxels(const Box& box, ScalarType type) {
  PaddedVoxels padded;
  padded.box = box;
  padded.type = type;
  const Index3 size = box.size();
  padded.row = size.x + 2 * kPad;
  padded.slice = std::int64_t{padded.row} * (size.y + 2 * kPad);
  constexpr std::size_t kRegister = 16;  // bytes: ray kernels read so many from the last voxels on
  padded.samples = MakeLargeArray<std::byte>(padded.bytes() + kRegister);
  return padded;
}

void FillBox(const PaddedVoxels& voxels, const Box& box, float sample) {
  VisitStoredType(voxels.type, [&](auto* type) {
    using T = std::remove_cvref_t<decltype(*type)>;
    const T value = T(std::clamp(sample, float(std::numeric_limits<T>::lowest()), float(std::numeric_limits<T>::max())));
    if (value == 0) return;
    ParallelFor(box.begin.z, box.end.z, [&](std::int32_t z) {
      for (std::int32_t y = box.begin.y; y < box.end.y; ++y) {
        std::fill_n(reinterpret_cast<T*>(voxels.At({box.begin.x, y, z})), box.size().x, value);
      }
    });
  });
}

void FillPadding(const PaddedVoxels& voxels) {
  VisitStoredType(voxels.type, [&](auto* type) {
    using T = std::remove_cvref_t<decltype(*type)>;
    const Box& box = voxels.box;
    const std::int32_t width = box.size().x;
    const auto row_of = [&](std::int32_t y, std::int32_t z) { return reinterpret_cast<T*>(voxels.At({box.begin.x - kPad, y, z})); };
    ParallelFor(box.begin.z, box.end.z, [&](std::int32_t z) {
      for (std::int32_t y = box.begin.y; y < box.end.y; ++y) {
        T* const row = row_of(y, z);
        if (row[kPad] != 0) std::fill_n(row, kPad, row[kPad]);
        if (row[kPad + width - 1] != 0) std::fill_n(row + kPad + width, kPad, row[kPad + width - 1]);
      }
      for (std::int32_t i = 1; i <= kPad; ++i) {
        RepeatRow(row_of(box.begin.y, z), voxels.row, row_of(box.begin.y - i, z));
        RepeatRow(row_of(box.end.y - 1, z), voxels.row, row_of(box.end.y - 1 + i, z));
      }
    });
    ParallelFor(box.begin.y - kPad, box.end.y + kPad, [&](std::int32_t y) {
      for (std::int32_t i = 1; i <= kPad; ++i) {
        RepeatRow(row_of(y, box.begin.z), voxels.row, row_of(y, box.begin.z - i));
        RepeatRow(row_of(y, box.end.z - 1), voxels.row, row_of(y, box.end.z - 1 + i));
      }
    });
  });
}

PaddedVoxels Pad(const VoxelBricks& voxels, const Box& box) {
  CHECK(!box.empty() && voxels.box().Contains(box));
  const PaddedVoxels padded = MakePaddedVoxels(box, voxels.type());
  const Box inside = Grown(box, kPad, voxels.box());
  VisitStoredType(voxels.type(), [&](auto* type) {
    using T = std::remove_cvref_t<decltype(*type)>;
    T* const samples = reinterpret_cast<T*>(padded.samples.get());
    const auto row_of = [&](std::int32_t y, std::int32_t z) {
      return samples + (z - (box.begin.z - kPad)) * padded.slice + std::ptrdiff_t{y - (box.begin.y - kPad)} * padded.row;
    };
    ParallelFor(box.begin.z - kPad, box.end.z + kPad, [&](std::int32_t z) {
      const std::int32_t from_z = std::clamp(z, inside.begin.z, inside.end.z - 1);
      for (std::int32_t y = inside.begin.y; y < inside.end.y; ++y) {
        FillRow(voxels, inside, y, from_z, inside.begin.x - (box.begin.x - kPad), padded.row, row_of(y, z));
      }
      const std::size_t row_bytes = std::size_t(padded.row) * sizeof(T);
      for (std::int32_t y = box.begin.y - kPad; y < inside.begin.y; ++y) std::memcpy(row_of(y, z), row_of(inside.begin.y, z), row_bytes);
      for (std::int32_t y = inside.end.y; y < box.end.y + kPad; ++y) std::memcpy(row_of(y, z), row_of(inside.end.y - 1, z), row_bytes);
    });
  });
  return padded;
}

}  // namespace slabstream
