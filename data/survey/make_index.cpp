#include "data/survey/make_index.h"

#include <algorithm>
#include <thread>
#include <vector>

#include "data/survey/pieces.h"

namespace slabstream {
namespace {

bool IsKnown(const Box& piece, const Index3& brick_counts, const BrickRangeList& bricks) {
  const auto brick_of = [](std::int32_t voxel) { return voxel / kBrick; };
  Index3 brick;
  for (brick.z = brick_of(piece.begin.z); brick.z <= brick_of(piece.end.z - 1); ++brick.z) {
    for (brick.y = brick_of(piece.begin.y); brick.y <= brick_of(piece.end.y - 1); ++brick.y) {
      for (brick.x = brick_of(piece.begin.x); brick.x <= brick_of(piece.end.x - 1); ++brick.x) {
        if (bricks[NumberIn(brick_counts, brick)] == kNotRead) return false;
      }
    }
  }
  return true;
}

}  // namespace

Status ReadIntoIndex(VolumeSource& source, const IndexOptions& options, BrickIndex& index) {
  const std::vector<SourceLevel>& levels = source.info().levels;
  const std::size_t wanted = std::size_t(options.memory / (2 * kPieceBytes)), cores = std::max(1U, std::thread::hardware_concurrency());
  const std::size_t ahead = std::clamp<std::size_t>(wanted, 2, cores + 1) - 1;
  IndexProgress progress;
  std::vector<std::vector<Box>> unknown(levels.size());
  for (std::size_t i = 0; i < levels.size(); ++i) {
    const Index3 brick_counts = CubesOver(levels[i].description.geometry.size, kBrick);
    const std::uint64_t voxel_bytes = BytesPerSample(levels[i].description.type);
    for (const Box& piece : PiecesOf(levels[i])) {
      const std::uint64_t bytes = std::uint64_t(piece.voxel_count()) * voxel_bytes;
      progress.all_bytes += bytes;
      if (IsKnown(piece, brick_counts, index.levels[i])) {
        progress.done_bytes += bytes;
      } else {
        unknown[i].push_back(piece);
      }
    }
  }
  options.progress(progress);
  // What pictures are drawn from first, and is read soonest.
  for (std::size_t i = levels.size(); i-- > 0;) {
    const Index3 brick_counts = CubesOver(levels[i].description.geometry.size, kBrick);
    const Status read = ReadPieces(
        source, int(i), unknown[i], ahead,
        [&](const VoxelBlock& piece) {
          FindBrickRanges(piece, brick_counts, index.levels[i]);
          progress.done_bytes += piece.bytes.size();
          options.progress(progress);
        },
        options.stop);
    if (!read.ok()) return read;
  }
  return Status::Ok();
}

}  // namespace slabstream
