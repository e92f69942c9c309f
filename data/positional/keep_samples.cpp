#include "data/positional/keep_samples.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <limits>
#include <type_traits>

namespace slabstream {
namespace {

template <class T>
using Kept = std::conditional_t<(sizeof(T) > 2), float, std::conditional_t<sizeof(T) == 1, std::uint8_t, std::uint16_t>>;
template <class T>
constexpr bool kIsShifted = std::is_signed_v<T> && sizeof(T) <= 2;

template <class T>
Kept<T> Keep(T sample) {
  if constexpr (kIsShifted<T>) {
    // Adding half of the type's range, modulo that range, turns the sign bit around.
    return Kept<T>(Kept<T>(sample) ^ Kept<T>(Kept<T>{1} << (8 * sizeof(T) - 1)));
  } else {
    return Kept<T>(sample);
  }
}

template <class T, bool kSwapped>
T SampleAt(const std::byte* at) {
  std::array<std::byte, sizeof(T)> bytes;
  std::memcpy(bytes.data(), at, sizeof(T));
  if constexpr (kSwapped) std::ranges::reverse(bytes);
  return std::bit_cast<T>(bytes);
}

template <class T, bool kSwapped>
void KeepRow(std::int32_t count, const std::byte* from, std::int64_t from_step, std::byte* to, std::int64_t to_step) {
  const auto keep = [&](std::int64_t in_step, std::int64_t out_step) {
    for (std::int32_t x = 0; x < count; ++x) {
      const Kept<T> kept = Keep(SampleAt<T, kSwapped>(from + x * in_step));
      std::memcpy(to + x * out_step, &kept, sizeof kept);
    }
  };
  // With steps that the compiler knows it uses vectors.
  constexpr std::int64_t kFrom = sizeof(T), kTo = sizeof(Kept<T>);
  if (from_step == kFrom && to_step == kTo) {
    keep(kFrom, kTo);
  } else {
    keep(from_step, to_step);
  }
}

template <class T, bool kSwapped>
void KeepAll(const Index3& size, const PlacedSamples<const std::byte>& from, const PlacedSamples<std::byte>& to) {
  // Voxels a side of a tile: what is read and written of it stays in a cache, whichever axis runs fastest on either side.
  const std::int32_t along = to.steps[0] == std::int64_t(sizeof(Kept<T>)) ? size.x : 32;
  const Index3 tile = {along, 32, 32};
  const auto at = [](const auto& placed, std::int32_t x, std::int32_t y, std::int32_t z) {
    return placed.first + x * placed.steps[0] + y * placed.steps[1] + z * placed.steps[2];
  };
  for (std::int32_t z = 0; z < size.z; z += tile.z) {
    for (std::int32_t y = 0; y < size.y; y += tile.y) {
      for (std::int32_t x = 0; x < size.x; x += tile.x) {
        const Index3 end = Min(Index3{x, y, z} + tile, size);
        for (std::int32_t in_z = z; in_z < end.z; ++in_z) {
          for (std::int32_t in_y = y; in_y < end.y; ++in_y) {
            KeepRow<T, kSwapped>(end.x - x, at(from, x, in_y, in_z), from.steps[0], at(to, x, in_y, in_z), to.steps[0]);
          }
        }
      }
    }
  }
}

}  // namespace

KeptSampleType KeptSampleTypeOf(SampleType type) {
  return VisitSampleType(type, []<class T>(const T*) {
    constexpr auto kType = sizeof(T) > 2 ? ScalarType::kFloat32 : sizeof(T) == 1 ? ScalarType::kUint8 : ScalarType::kUint16;
    return KeptSampleType{kType, kIsShifted<T> ? double(std::numeric_limits<T>::min()) : 0};
  });
}

void KeepSamples(SampleType type, bool swapped, const Index3& size, const PlacedSamples<const std::byte>& from,
                 const PlacedSamples<std::byte>& to) {
  VisitSampleType(type, [&]<class T>(const T*) { swapped ? KeepAll<T, true>(size, from, to) : KeepAll<T, false>(size, from, to); });
}

}  // namespace slabstream
