// Normal codes of the voxels of a brick, by the gradient of Zucker and Hummel (1981): along each axis the difference of the two
// neighbouring slices, smoothed by (1, 2, 1) along the other two. The smoothing factor 16 is the same for all axes and is left in, because
// only the direction is kept.
//
//   1. SumPlane for three planes z - 1, z, z + 1: sums along y, by column.
//   2. EncodeNormals: the rest, for the wanted rows of z. The sums of a plane serve three z.
// Sums are always added in the same order (y, z, then x; the outer two of three first) and without fused operations, so the codes do not
// depend on the instruction set. Integer samples are summed exactly.
#pragma once

#include <array>
#include <cstdint>

namespace slabstream {

inline constexpr int kNormalRow = 16;      // voxels of a row, and rows of a plane
inline constexpr int kNormalColumns = 32;  // columns -1 ... 16 and padding, which may hold anything

// Samples of rows -1 ... 16. Outside the volume, the nearest sample inside. T: std::uint8_t, std::uint16_t, float.
template <class T>
struct alignas(64) NormalSamples {
  T row[kNormalRow + 2][kNormalColumns];
};
struct alignas(64) NormalSums {
  float smooth[kNormalRow][kNormalColumns], slope[kNormalRow][kNormalColumns];
};
// 1 / physical distance of a voxel's two neighbours, by axis. Shorter if one neighbour is missing, 0 if both are.
struct NormalScales {
  std::array<float, kNormalRow> x{}, y{};
  float z = 0;
};

void SumPlane(const NormalSamples<std::uint8_t>& samples, NormalSums& sums);
void SumPlane(const NormalSamples<std::uint16_t>& samples, NormalSums& sums);
void SumPlane(const NormalSamples<float>& samples, NormalSums& sums);

// codes[y][x] of normal_code.h, for the rows y whose bit is set in `rows`.
void EncodeNormals(const NormalSums& below, const NormalSums& middle, const NormalSums& above, const NormalScales& scales,
                   std::uint32_t rows, std::uint16_t (*codes)[kNormalRow]);

}  // namespace slabstream
