#include "data/survey/learnt_index.h"

#include <algorithm>
#include <cstring>
#include <optional>
#include <utility>

#include "common/base/guarded.h"
#include "common/base/log.h"

namespace slabstream {
namespace {

constexpr std::size_t kMostMemory = std::size_t{64} << 20;

// The bricks that lie in `box` as a whole, as a box of voxels.
Box WholeBricks(const Box& box, const Index3& volume) {
  Box bricks = box;
  for (const Axis axis : kAxes) {
    bricks.begin[axis] = (box.begin[axis] + kBrick - 1) / kBrick * kBrick;
    if (box.end[axis] != volume[axis]) bricks.end[axis] = box.end[axis] / kBrick * kBrick;
  }
  return bricks;
}

}  // namespace

std::unique_ptr<LearntIndex> LearntIndex::Begin(const std::string& path, std::string_view options, std::uint64_t files_version,
                                                std::shared_ptr<VolumeSource> source) {
  const SourceInfo& info = source->info();
  std::size_t bricks = 0;
  for (const SourceLevel& level : info.levels) bricks += CountIn(CubesOver(level.description.geometry.size, kBrick));
  if (bricks * sizeof(ValueRange) > kMostMemory) return nullptr;
  Result<IndexFile> file = IndexFile::Of(path, options);
  if (!file.ok()) return nullptr;
  Result<std::string> name = file->NameNow(files_version, info);
  if (!name.ok()) return nullptr;
  Result<std::optional<BrickIndex>> kept = file->Read(*name, info);
  Result<BrickIndex> known = kept.ok() && *kept ? Result<BrickIndex>(**std::move(kept)) : EmptyIndex(info);
  if (!known.ok() || ShareRead(*known) == 1) return nullptr;
  return std::unique_ptr<LearntIndex>(new LearntIndex(*std::move(file), *std::move(name), std::move(source), *std::move(known)));
}

LearntIndex::~LearntIndex() {
  const std::lock_guard lock(mutex_);
  if (!any_) return;
  const Status kept = Guarded("an index", [&] { return file_.Merge(name_, index_, source_->info()); });
  LogInfo(kept.ok() ? "noted what was read in " + file_.path() : "what was read is not noted: " + kept.message());
}

void LearntIndex::Learn(int level, const Box& box, std::span<const std::byte> samples) {
  const VolumeDescription& description = source_->info().levels[std::size_t(level)].description;
  const Box bricks = WholeBricks(box, description.geometry.size);
  if (bricks.empty()) return;
  const std::size_t sample_bytes = BytesPerSample(description.type), row_bytes = std::size_t(bricks.size().x) * sample_bytes;
  VoxelBlock piece = MakeVoxelBlock({{0, 0, 0}, bricks.size()}, description.type);
  std::byte* to = piece.bytes.data();
  for (std::int32_t z = bricks.begin.z; z < bricks.end.z; ++z) {
    for (std::int32_t y = bricks.begin.y; y < bricks.end.y; ++y, to += row_bytes) {
      const std::size_t voxel = NumberIn(box.size(), Index3{bricks.begin.x, y, z} - box.begin);
      std::memcpy(to, samples.data() + voxel * sample_bytes, row_bytes);
    }
  }
  const Index3 counts = CubesOver(bricks.size(), kBrick), all = CubesOver(description.geometry.size, kBrick);
  BrickRangeList ranges(CountIn(counts));
  FindBrickRanges(piece, counts, ranges);
  const Index3 first = {bricks.begin.x / kBrick, bricks.begin.y / kBrick, bricks.begin.z / kBrick};
  const std::lock_guard lock(mutex_);
  for (std::size_t i = 0; i < ranges.size(); ++i) {
    ValueRange& known = index_.levels[std::size_t(level)][NumberIn(all, first + PlaceIn(counts, i))];
    any_ |= known == kNotRead;
    known = ranges[i];
  }
}

}  // namespace slabstream
