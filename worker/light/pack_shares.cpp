#include "worker/light/pack_shares.h"

#include <algorithm>
#include <vector>

#include "common/parallel/parallel.h"
#include "common/volume/indices.h"

namespace slabstream {
namespace {

// Steps from voxel to voxel in the order of rows along x (0) or y (1).
Vector3<std::ptrdiff_t> StepsOf(int fast, const Index3& size) {
  if (fast == 0) return {1, size.x, std::ptrdiff_t{size.x} * size.y};
  return {std::ptrdiff_t{size.y} * size.z, 1, size.y};
}

constexpr std::int32_t kSquare = 32;

// to[j][i] = from[i][j] for `width` x `height` numbers, i < width.
void TurnSquare(const std::uint8_t* __restrict from, std::ptrdiff_t from_row, std::int32_t width, std::int32_t height,
                std::uint8_t* __restrict to, std::ptrdiff_t to_row) {
  for (std::int32_t i = 0; i < width; ++i) {
    for (std::int32_t j = 0; j < height; ++j) to[j * to_row + i] = from[i * from_row + j];
  }
}

void Interleave(const std::uint8_t* __restrict a, const std::uint8_t* __restrict b, std::int32_t count, std::uint8_t* __restrict out) {
  for (std::int32_t i = 0; i < count; ++i) {
    out[2 * i] = a[i];
    out[2 * i + 1] = b[i];
  }
}

}  // namespace

void PackShares(const Bytes255& open, const Bytes255& reached, int reached_fast, std::size_t number, FrameLight& light) {
  const Index3& size = light.size;
  const int u = light.fast, v = light.fast == 0 ? 1 : 0;  // rows along u lie side by side along v, in slices of z
  const Vector3<std::ptrdiff_t> steps = StepsOf(light.fast, size), reached_steps = StepsOf(reached_fast, size);
  const Bytes255 all(std::size_t(size[u]), 255);
  std::uint8_t* const shares = light.shares.data() + number * std::size_t(light.light);
  const std::ptrdiff_t row_bytes = 2 * std::ptrdiff_t{size[u] + 1};
  ParallelFor(0, size.z, [&](std::int32_t z) {
    std::vector<std::uint8_t> turned(std::size_t(kSquare) * std::size_t(size[u]));
    for (std::int32_t begin = 0; begin < size[v]; begin += kSquare) {
      const std::int32_t end = std::min(begin + kSquare, size[v]);
      if (!reached.empty() && reached_fast != light.fast) {
        for (std::int32_t i = 0; i < size[u]; i += kSquare) {
          TurnSquare(reached.data() + z * reached_steps.z + i * reached_steps[u] + begin, reached_steps[u], std::min(kSquare, size[u] - i),
                     end - begin, turned.data() + i, size[u]);
        }
      }
      for (std::int32_t j = begin; j < end; ++j) {
        const std::ptrdiff_t row = z * steps.z + j * steps[v];
        const std::uint8_t* const through = reached.empty()              ? all.data()
                                            : reached_fast == light.fast ? reached.data() + row
                                                                         : turned.data() + std::ptrdiff_t{j - begin} * size[u];
        std::uint8_t* const out = shares + std::ptrdiff_t{z} * light.stride[2] + std::ptrdiff_t{j} * light.stride[std::size_t(v)];
        Interleave(open.empty() ? all.data() : open.data() + row, through, size[u], out);
        // What lies beyond the last voxels is like them.
        std::copy_n(out + row_bytes - 4, 2, out + row_bytes - 2);
        for (std::int32_t dz = 0; dz <= (z + 1 == size.z ? 1 : 0); ++dz) {
          for (std::int32_t dj = 0; dj <= (j + 1 == size[v] ? 1 : 0); ++dj) {
            if (dz + dj > 0) std::copy_n(out, row_bytes, out + dz * light.stride[2] + dj * light.stride[std::size_t(v)]);
          }
        }
      }
    }
  });
}

Bytes255 TurnedBytes(const Bytes255& along_x, const Index3& size) {
  Bytes255 turned(along_x.size());
  const Vector3<std::ptrdiff_t> from = StepsOf(0, size), to = StepsOf(1, size);
  ParallelFor(0, size.z, [&](std::int32_t z) {
    for (std::int32_t y = 0; y < size.y; y += kSquare) {
      for (std::int32_t x = 0; x < size.x; x += kSquare) {
        TurnSquare(along_x.data() + z * from.z + y * from.y + x, from.y, std::min(kSquare, size.y - y), std::min(kSquare, size.x - x),
                   turned.data() + z * to.z + x * to.x + y, to.x);
      }
    }
  });
  return turned;
}

}  // namespace slabstream
