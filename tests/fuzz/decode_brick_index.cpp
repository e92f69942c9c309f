// Indices of bricks, of sources of each type.
//
// input: the type, then the file
#include <algorithm>

#include "common/volume/summary.h"
#include "data/survey/brick_index.h"
#include "tests/fuzz/decoders.h"

namespace slabstream {
namespace {

constexpr std::string_view kName = "/data/scan.ome.zarr\nfiles 1 2\n";
constexpr ScalarType kTypes[] = {ScalarType::kUint8, ScalarType::kUint16, ScalarType::kFloat32};

SourceInfo SourceOf(ScalarType type) {
  SourceInfo source;
  for (const std::int32_t side : {70, 35}) source.levels.push_back({{{Uniform(side), {1, 1, 1}}, type, {}}, Uniform(16)});
  return source;
}

}  // namespace

bool DecodeBrickIndex(std::span<const std::byte> bytes) {
  if (bytes.empty()) return false;
  const SourceInfo source = SourceOf(kTypes[std::to_integer<std::size_t>(bytes[0]) % std::size(kTypes)]);
  const Result<BrickIndex> index = DecodeIndex(bytes.subspan(1), source, kName);
  if (!index.ok()) {
    CheckRefusal(index.status());
    return false;
  }
  for (std::size_t level = 0; level < index->levels.size(); ++level) {
    const VolumeDescription& description = source.levels[level].description;
    CHECK_EQ(index->levels[level].size(), CountIn(CubesOver(description.geometry.size, kBrick)));
    const ValueRange any = AnyValue(description);
    for (const ValueRange& range : DataRanges(index->levels[level], description)) {
      CHECK(range == kNoFiniteValue || (any.min <= range.min && range.min <= range.max && range.max <= any.max));
    }
  }
  const Result<std::vector<std::byte>> again = EncodeIndex(*index, source, kName);
  CHECK(again.ok()) << again.status().message();
  CHECK(DecodeIndex(*again, source, kName).value() == *index);
  return true;
}

std::vector<FuzzBytes> BrickIndexSeeds() {
  std::vector<FuzzBytes> seeds;
  for (std::size_t i = 0; i < std::size(kTypes); ++i) {
    const SourceInfo source = SourceOf(kTypes[i]);
    BrickIndex index = EmptyIndex(source).value();
    for (std::size_t brick = 1; brick < index.levels[0].size(); ++brick)
      index.levels[0][brick] = {float(brick % 7), float(brick % 7 + brick)};
    if (kTypes[i] == ScalarType::kFloat32) index.levels[1][2] = kNoFiniteValue;
    const std::vector<std::byte> file = EncodeIndex(index, source, kName).value();
    seeds.push_back(FuzzSeed().Put(std::uint8_t(i)).Put(file).bytes());
  }
  return seeds;
}

}  // namespace slabstream
