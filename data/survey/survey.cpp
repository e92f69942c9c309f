#include "data/survey/survey.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include "data/survey/pieces.h"

namespace slabstream {
namespace {

// Blocks of the source, or several of them together, spread evenly: about `most` bytes in all.
std::vector<Box> SampleOf(const SourceLevel& level, std::int64_t most, std::size_t places) {
  constexpr std::size_t kLeastBytes = 1U << 20;
  const Box bounds = level.description.geometry.bounds();
  Index3 block = level.block;
  for (const Axis axis : kAxes) {
    while (CountIn(block) * BytesPerSample(level.description.type) < kLeastBytes && block[axis] < bounds.end[axis]) block[axis] *= 2;
  }
  // Of a block that is larger than the sample, a part is enough.
  for (const auto bytes = [&] { return std::int64_t(CountIn(block) * BytesPerSample(level.description.type)); };
       bytes() > std::max(most, 2 * kPieceBytes) / std::int64_t(places);) {
    std::int32_t& longest = block[*std::ranges::max_element(kAxes, {}, [&](Axis axis) { return block[axis]; })];
    longest = (longest + 1) / 2;
  }
  // They are counted and not listed: a volume may say that it has any number of them.
  const Index3 counts = (bounds.end + block - Uniform(1)) / block;
  const std::size_t all = CountIn(counts);
  const double share = std::min(1.0, double(most) / double(level.description.voxel_bytes()));
  const auto count = std::clamp<std::size_t>(std::size_t(share * double(all)), std::min(places, all), all);
  // One of each stretch of them: each time at another place in it, or rows of blocks as long as a stretch would give the same column.
  constexpr double kGoldenRatio = 0.6180339887498949;
  std::vector<Box> sample;
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t first = i * all / count, end = (i + 1) * all / count;
    const double turn = kGoldenRatio * (double(i) + 0.5);
    const Index3 begin = PlaceIn(counts, first + std::size_t((turn - std::floor(turn)) * double(end - first))) * block;
    sample.push_back(Intersection({begin, begin + block}, bounds));
  }
  return sample;
}

}  // namespace

SurveyBytes SurveyBytesOf(const SourceInfo& info, bool far) {
  if (info.on_demand) return kMadeSurvey;
  // Each time of what others hold is surveyed, and perhaps they are far.
  return far || !info.owned.empty() ? kFarSurvey : SurveyBytes();
}

Result<Survey> SurveySource(VolumeSource& source, const SurveyBytes& most, ReadProgress* progress) {
  const std::vector<SourceLevel>& levels = source.info().levels;
  const auto bytes = [&](std::size_t level) { return levels[level].description.voxel_bytes(); };
  std::size_t level = 0;
  if (bytes(0) > most.exact) {
    while (level + 1 < levels.size() && bytes(level) > most.coarse) ++level;
  }
  const VolumeDescription& description = levels[level].description;
  const bool whole = bytes(level) <= most.exact;
  const std::vector<Box> boxes = whole ? PiecesOf(levels[level]) : SampleOf(levels[level], most.coarse, most.places);

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

}  // namespace slabstream
