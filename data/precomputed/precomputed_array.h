// A scale of a precomputed volume as a ChunkedArray of the axes channel, z, y and x. Source:
// https://github.com/google/neuroglancer/blob/master/src/datasource/precomputed/volume.md
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "data/precomputed/sharding.h"
#include "data/sources/chunked_array.h"
#include "data/sources/read_context.h"
#include "data/stores/store.h"

namespace slabstream::precomputed {

enum class Encoding : std::uint8_t { kRaw, kJpeg, kSegmentation };

struct Scale {
  std::string key;                               // the folder of its chunks
  std::array<std::uint64_t, 3> size{}, chunk{};  // voxels along x, y and z
  std::array<std::int64_t, 3> offset{};          // the place of the first voxel, which names of chunks count from
  std::array<double, 3> resolution{};            // nm
  Encoding encoding = Encoding::kRaw;
  std::array<std::uint64_t, 3> block{};   // kSegmentation
  std::optional<Sharding> sharding = {};  // else each chunk is a file
};

std::shared_ptr<ChunkedArray> MakeArray(const std::shared_ptr<Store>& store, const Scale& scale, SampleType type, std::uint64_t channels,
                                        const SourceContext& context);

}  // namespace slabstream::precomputed
