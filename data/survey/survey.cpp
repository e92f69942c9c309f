#include "data/survey/survey.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "common/volume/memory_budget.h"
#include "data/sources/copy_samples.h"
#include "data/survey/pieces.h"
#include "data/volume_io/exact_samples.h"

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
  // Of a block that is larger than the sample, a part is enough.
  for (const auto bytes = [&] { return std::int64_t(CountIn(block) * BytesPerSample(level.description.type)); };
       bytes() > std::max(most, 2 * kPieceBytes);) {
    std::int32_t& longest = block[*std::ranges::max_element(kAxes, {}, [&](Axis axis) { return block[axis]; })];
    longest = (longest + 1) / 2;
  }
  // They are counted and not listed: a volume may say that it has any number of them.
  const Index3 counts = (bounds.end + block - Uniform(1)) / block;
  const std::size_t all = CountIn(counts);
  const double share = std::min(1.0, double(most) / double(level.description.voxel_bytes()));
  const auto count = std::clamp<std::size_t>(std::size_t(share * double(all)), 1, all);
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

// Reads boxes of whole slices in order, and keeps their exact samples from the first one on that has whole numbers that float32 rounds.
class ExactCopy {
 public:
  ExactCopy(const ExactType& of, std::string name, ExactWanted wanted, const Volume& volume)
      : of_(of), name_(std::move(name)), wanted_(wanted == ExactWanted::kAll), volume_(volume) {}

  Status Read(VolumeSource& source, int level, const Box& box, std::span<std::byte> kept) {
    const std::size_t sample = BytesPerSample(of_.type), count = std::size_t(box.voxel_count());
    stored_.resize(count * sample);
    const Index3 size = box.size();
    if (Status read = source.ReadNow(level, box, BoxRoom::Dense(box, stored_.data(), true)); !read.ok()) return read;
    if (volume_.block.type == ScalarType::kFloat32) {
      CopySamples(of_.type, stored_.data(), {1, size.x, std::int64_t{size.x} * size.y}, size, BoxRoom::Dense(box, kept.data()));
      wanted_ = wanted_ || (MayRoundLabels(of_.type) && !AllFitFloat(of_.type, stored_));
    } else if (Status read = source.ReadNow(level, box, kept); !read.ok()) {  // a reader has seen that all of them fit a narrow type
      return read;
    }
    if (wanted_ && exact_ == nullptr) {
      if (Status made = Make(); !made.ok()) return made;
    }
    if (wanted_) std::ranges::copy(stored_, exact_->bytes.begin() + std::ptrdiff_t(done_ * sample));
    done_ += count;
    return Status::Ok();
  }

  std::shared_ptr<const ExactSamples> Take() { return std::move(exact_); }  // null: none are wanted

 private:
  Status Make() {
    const std::size_t bytes = std::size_t(volume_.block.box.voxel_count()) * BytesPerSample(of_.type);
    if (Status fits = CheckFitsMemory(std::int64_t(bytes), name_); !fits.ok()) return fits;
    exact_ = std::make_shared<ExactSamples>(ExactSamples{of_, AlignedVector<std::byte>(bytes)});
    // What has been read before is kept exactly.
    VisitSampleType(of_.type, [&]<class T>(const T*) {
      std::ranges::transform(std::span(volume_.block.samples<float>(), done_), reinterpret_cast<T*>(exact_->bytes.data()),
                             [](float sample) { return T(sample); });
    });
    return Status::Ok();
  }

  const ExactType of_;
  const std::string name_;
  bool wanted_;
  const Volume& volume_;
  AlignedVector<std::byte> stored_;
  std::shared_ptr<ExactSamples> exact_;
  std::size_t done_ = 0;  // voxels
};

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

Result<LevelInMemory> ReadLevel(VolumeSource& source, int level, ReadProgress* progress, ExactWanted wanted) {
  const SourceLevel& of = source.info().levels[std::size_t(level)];
  const std::string name = source.info().format + " volume";
  if (Status fits = CheckFitsMemory(of.description.voxel_bytes(), name); !fits.ok()) return fits;
  auto volume = std::make_shared<Volume>();
  volume->description = of.description;
  volume->block = MakeVoxelBlock(of.description.geometry.bounds(), of.description.type);
  std::optional<ExactCopy> exact;
  if (const ExactType& type = source.info().exact; MayBeRounded(type.type)) exact.emplace(type, name, wanted, *volume);
  // Stretches of whole slices, so that each lies in one piece of memory.
  const Index3& size = of.description.geometry.size;
  const std::size_t slice_bytes = std::size_t(size.x) * std::size_t(size.y) * BytesPerSample(of.description.type);
  const std::int32_t step = std::max(of.block.z, std::int32_t(kPieceBytes / std::int64_t(slice_bytes)) / of.block.z * of.block.z);
  if (progress != nullptr) progress->Begin(of.description.voxel_bytes());
  for (std::int32_t z = 0; z < size.z; z += step) {
    const Box box = {{0, 0, z}, {size.x, size.y, std::min(z + step, size.z)}};
    const std::span<std::byte> out =
        std::span(volume->block.bytes).subspan(std::size_t(z) * slice_bytes, std::size_t(box.size().z) * slice_bytes);
    if (Status read = exact ? exact->Read(source, level, box, out) : source.ReadNow(level, box, out); !read.ok()) return read;
    if (progress != nullptr) progress->Add(std::int64_t(out.size()));
  }
  return LevelInMemory{std::move(volume), exact ? exact->Take() : nullptr};
}

}  // namespace slabstream
