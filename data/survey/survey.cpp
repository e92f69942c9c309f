#include "data/survey/survey.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

#include "common/volume/box_assembly.h"
#include "common/volume/memory_budget.h"
#include "data/survey/pieces.h"

namespace slabstream {
namespace {

// Blocks of the source, or several of them together, spread evenly: about `most` bytes in all.
std::vector<Box> SampleOf(const SourceLevel& level, std::int64_t most) {
  constexpr std::size_t kLeastBytes = 1U << 20;
  const Box bounds = level.description.geometry.bounds();
  Index3 block = level.block;
  for (const Axis axis : kAxes) {
    while (CountIn(block) * BytesPerSample(level.description.type) < kLeastBytes && block[axis] < bounds.end[axis]) block[axis] *= 2;
  }
  const std::vector<Box> all = CutAtBlocks(bounds, block);
  const double share = std::min(1.0, double(most) / double(level.description.voxel_bytes()));
  const auto count = std::clamp<std::size_t>(std::size_t(share * double(all.size())), 1, all.size());
  // One of each stretch of them: each time at another place in it, or rows of blocks as long as a stretch would give the same column.
  constexpr double kGoldenRatio = 0.6180339887498949;
  std::vector<Box> sample;
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t first = i * all.size() / count, end = (i + 1) * all.size() / count;
    const double turn = kGoldenRatio * (double(i) + 0.5);
    sample.push_back(all[first + std::size_t((turn - std::floor(turn)) * double(end - first))]);
  }
  return sample;
}

}  // namespace

Result<Survey> SurveySource(VolumeSource& source, const SurveyBytes& most, ReadProgress* progress) {
  const std::vector<SourceLevel>& levels = source.info().levels;
  const auto bytes = [&](std::size_t level) { return levels[level].description.voxel_bytes(); };
  std::size_t level = 0;
  if (bytes(0) > most.exact) {
    while (level + 1 < levels.size() && bytes(level) > most.coarse) ++level;
  }
  const VolumeDescription& description = levels[level].description;
  const bool whole = bytes(level) <= most.exact;
  const std::vector<Box> boxes = whole ? PiecesOf(levels[level]) : SampleOf(levels[level], most.coarse);

  PiecewiseSummary pieces(description);
  if (progress != nullptr) {
    std::int64_t expected = 0;
    for (const Box& box : boxes) expected += box.voxel_count() * std::int64_t(BytesPerSample(description.type));
    progress->Begin(expected);
  }
  Status read = ReadPieces(source, int(level), boxes, 1, [&](const VoxelBlock& block) {
    whole ? pieces.Add(block) : pieces.AddSample(block);
    if (progress != nullptr) progress->Add(std::int64_t(block.bytes.size()));
  });
  if (read.ok() && pieces.EndOfPieces()) {
    read = ReadPieces(source, int(level), boxes, 1, [&](const VoxelBlock& block) { pieces.AddAgain(block); });
  }
  if (!read.ok()) return read;
  return Survey{int(level), !whole, std::make_shared<const VolumeSummary>(pieces.Take())};
}

Result<std::shared_ptr<const Volume>> ReadLevel(VolumeSource& source, int level, ReadProgress* progress) {
  const SourceLevel& of = source.info().levels[std::size_t(level)];
  if (Status fits = CheckFitsMemory(of.description.voxel_bytes(), source.info().format + " volume"); !fits.ok()) return fits;
  auto volume = std::make_shared<Volume>();
  volume->description = of.description;
  volume->block = MakeVoxelBlock(of.description.geometry.bounds(), of.description.type);
  // Stretches of whole slices, so that each lies in one piece of memory.
  const Index3& size = of.description.geometry.size;
  const std::size_t slice_bytes = std::size_t(size.x) * std::size_t(size.y) * BytesPerSample(of.description.type);
  const std::int32_t step = std::max(of.block.z, std::int32_t(kPieceBytes / std::int64_t(slice_bytes)) / of.block.z * of.block.z);
  if (progress != nullptr) progress->Begin(of.description.voxel_bytes());
  for (std::int32_t z = 0; z < size.z; z += step) {
    const std::int32_t end = std::min(z + step, size.z);
    const std::span<std::byte> out =
        std::span(volume->block.bytes).subspan(std::size_t(z) * slice_bytes, std::size_t(end - z) * slice_bytes);
    if (Status read = source.ReadNow(level, {{0, 0, z}, {size.x, size.y, end}}, out); !read.ok()) return read;
    if (progress != nullptr) progress->Add(std::int64_t(out.size()));
  }
  return std::shared_ptr<const Volume>(std::move(volume));
}

}  // namespace slabstream
