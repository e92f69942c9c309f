#include "data/sources/copy_samples.h"

#include <cstdlib>
#include <cstring>
#include <type_traits>

namespace slabstream {
namespace {

template <class From>
using Kept = std::conditional_t<sizeof(From) == 1, std::uint8_t,
                                std::conditional_t<sizeof(From) == 2 && std::is_integral_v<From>, std::uint16_t, float>>;

template <class From, class To>
To Converted(From value) {
  if constexpr (std::is_same_v<From, To>) {
    return value;
  } else if constexpr (std::is_integral_v<To> && std::is_signed_v<From>) {
    return To(To(value) ^ To(To{1} << (8 * sizeof(To) - 1)));  // the lowest value becomes 0
  } else {
    return To(value);
  }
}

// What neither needs to be aligned for; compilers make plain and vector instructions of it.
template <class From, class To>
void Move(const std::byte* from, std::byte* to) {
  From value;
  std::memcpy(&value, from, sizeof(From));
  const To kept = Converted<From, To>(value);
  std::memcpy(to, &kept, sizeof(kept));
}

template <class From, class To>
void CopyRow(const std::byte* from, std::int64_t step, std::int64_t count, std::byte* to) {
  constexpr std::int64_t kFrom = sizeof(From), kTo = sizeof(To);
  if (step == 1) {
    if constexpr (std::is_same_v<From, To>) {
      std::memcpy(to, from, std::size_t(count * kFrom));
    } else {
      for (std::int64_t x = 0; x < count; ++x) Move<From, To>(from + x * kFrom, to + x * kTo);
    }
  } else {
    for (std::int64_t x = 0; x < count; ++x) Move<From, To>(from + x * step * kFrom, to + x * kTo);
  }
}

template <class From, class To>
void CopyRows(const std::byte* from, const std::array<std::int64_t, 3>& steps, const Index3& count, std::byte* to, std::int64_t row,
              std::int64_t slice) {
  constexpr std::int64_t kFrom = sizeof(From), kTo = sizeof(To);
  for (std::int64_t z = 0; z < count.z; ++z) {
    for (std::int64_t y = 0; y < count.y; ++y) {
      CopyRow<From, To>(from + (z * steps[2] + y * steps[1]) * kFrom, steps[0], count.x, to + (z * slice + y * row) * kTo);
    }
  }
}

// Where y or z is the fastest axis of the array, a row of x touches a line of the cache for each sample. In tiles of x and that axis each
// line is read while it is in the nearest cache.
template <class From, class To>
void CopyTiles(const std::byte* from, const std::array<std::int64_t, 3>& steps, const Index3& count, std::byte* to, std::int64_t row,
               std::int64_t slice) {
  constexpr std::int32_t kTile = 32;
  const bool y_fastest = std::abs(steps[1]) < std::abs(steps[2]);
  Index3 tile = {kTile, y_fastest ? kTile : 1, y_fastest ? 1 : kTile};
  for (std::int32_t z = 0; z < count.z; z += tile.z) {
    for (std::int32_t y = 0; y < count.y; y += tile.y) {
      for (std::int32_t x = 0; x < count.x; x += tile.x) {
        const Index3 part = Min(tile, count - Index3{x, y, z});
        CopyRows<From, To>(from + (x * steps[0] + y * steps[1] + z * steps[2]) * std::int64_t(sizeof(From)), steps, part,
                           to + (z * slice + y * row + x) * std::int64_t(sizeof(To)), row, slice);
      }
    }
  }
}

template <class From, class To>
void CopyAll(const std::byte* from, const std::array<std::int64_t, 3>& steps, const Index3& count, const BoxRoom& to) {
  // Along an axis of one voxel the step does not matter.
  const auto faster_than_x = [&](std::size_t axis) { return std::abs(steps[axis]) < std::abs(steps[0]); };
  if (count.x > 1 && ((count.y > 1 && faster_than_x(1)) || (count.z > 1 && faster_than_x(2)))) {
    CopyTiles<From, To>(from, steps, count, to.first, to.row, to.slice);
  } else if (steps[0] == 1 && steps[1] == count.x && to.row == count.x) {  // slices without gaps
    for (std::int64_t z = 0; z < count.z; ++z) {
      CopyRow<From, To>(from + z * steps[2] * std::int64_t(sizeof(From)), 1, std::int64_t(count.x) * count.y,
                        to.first + z * to.slice * std::int64_t(sizeof(To)));
    }
  } else {
    CopyRows<From, To>(from, steps, count, to.first, to.row, to.slice);
  }
}

}  // namespace

KeptType KeptTypeOf(SampleType type) {
  switch (type) {
    case SampleType::kInt8: return {ScalarType::kUint8, -128};
    case SampleType::kUint8: return {ScalarType::kUint8, 0};
    case SampleType::kInt16: return {ScalarType::kUint16, -32768};
    case SampleType::kUint16: return {ScalarType::kUint16, 0};
    default: return {ScalarType::kFloat32, 0};
  }
}

std::size_t CopiedBytes(SampleType type, bool exact) { return exact ? BytesPerSample(type) : BytesPerSample(KeptTypeOf(type).type); }

void CopySamples(SampleType type, const std::byte* from, const std::array<std::int64_t, 3>& steps, const Index3& count, const BoxRoom& to) {
  VisitSampleType(type, [&]<class From>(const From*) {
    to.exact ? CopyAll<From, From>(from, steps, count, to) : CopyAll<From, Kept<From>>(from, steps, count, to);
  });
}

}  // namespace slabstream
