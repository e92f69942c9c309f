// A whole level of a source in memory, read in stretches of slices.
#include <algorithm>
#include <array>
#include <cstddef>
#include <future>
#include <memory>
#include <numeric>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "common/parallel/task_arena.h"
#include "common/volume/memory_budget.h"
#include "common/volume/summary.h"
#include "data/sources/copy_samples.h"
#include "data/sources/volume_source.h"

namespace slabstream {
namespace {

constexpr std::int64_t kStretchBytes = std::int64_t{16} << 20;

// Of whole slices, in the order of the source, and of whole bricks if they are wanted.
std::vector<Box> StretchesOf(const SourceLevel& level, const SliceOrder& order, bool of_bricks) {
  const Box bounds = level.description.geometry.bounds();
  const std::int32_t size = bounds.end[order.along], block = std::lcm(level.block[order.along], of_bricks ? kBrick : 1);
  const std::int64_t slice_bytes = level.description.voxel_bytes() / size;
  const std::int32_t step = std::max(block, std::int32_t(std::min<std::int64_t>(kStretchBytes / slice_bytes, size)) / block * block);
  std::vector<Box> stretches;
  for (std::int32_t begin = 0; begin < size; begin += step) {
    Box& box = stretches.emplace_back(bounds);
    box.begin[order.along] = begin;
    box.end[order.along] = std::min(begin + step, size);
  }
  if (order.from_end) std::ranges::reverse(stretches);
  return stretches;
}

// Where the samples of a box of a volume lie in it.
BoxRoom RoomIn(const Index3& volume, std::byte* samples, std::size_t sample_bytes, const Box& box, bool exact = false) {
  BoxRoom room = BoxRoom::Dense({{0, 0, 0}, volume}, samples, exact);
  room.first += NumberIn(volume, box.begin) * sample_bytes;
  return room;
}

// Reads boxes, and keeps their exact samples from the first one on that has whole numbers that float32 rounds.
class ExactCopy {
 public:
  ExactCopy(const ExactType& of, std::string name, const LevelWanted& wanted, Volume& volume)
      : of_(of), name_(std::move(name)), wanted_(wanted), keeps_(wanted.all_exact), volume_(volume) {}

  Status Read(VolumeSource& source, int level, const Box& box) {
    const Index3 size = box.size();
    stored_.resize(std::size_t(box.voxel_count()) * sample_);
    if (Status read = source.ReadNow(level, box, BoxRoom::Dense(box, stored_.data(), true)); !read.ok()) return read;
    const std::array<std::int64_t, 3> steps = {1, size.x, std::int64_t{size.x} * size.y};
    CopySamples(of_.type, stored_.data(), steps, size, RoomIn(size_, volume_.block.bytes.data(), sizeof(float), box));
    rounds_ = rounds_ || !AllFitFloat(of_.type, stored_);
    if (of_.type == SampleType::kFloat64) reach_.Add({reinterpret_cast<const double*>(stored_.data()), stored_.size() / sizeof(double)});
    keeps_ = keeps_ || (rounds_ && MayRoundLabels(of_.type));
    if (keeps_ && exact_ == nullptr) {
      if (Status made = Make(); !made.ok()) return made;
    }
    if (keeps_) CopySamples(of_.type, stored_.data(), steps, size, RoomIn(size_, exact_->bytes.data(), sample_, box, true));
    done_.push_back(box);
    return Status::Ok();
  }

  // What float32 rounds becomes exact if uint16 holds it.
  LevelInMemory Take(std::shared_ptr<Volume> volume) {
    std::optional<KeptSamples> shifted;
    if (wanted_.narrow && exact_ != nullptr) {
      shifted = ShiftedToUint16(of_.type, exact_->bytes);
    } else if (wanted_.narrow && !rounds_) {
      shifted = ShiftedToUint16(SampleType::kFloat32, volume->block.bytes);
    }
    if (shifted) {
      volume->description.type = volume->block.type = shifted->type;
      // value = scale * (stored + shift) + offset
      volume->description.mapping = {of_.mapping.scale, of_.mapping.FromStored(shifted->shift)};
      volume->block.bytes = std::move(shifted->bytes);
    }
    const bool rounds = shifted ? !shifted->exact : rounds_;
    std::string rounding = rounds ? RoundingText(of_.type, MayRoundLabels(of_.type) ? exact_.get() : nullptr, reach_) : "";
    if (!wanted_.all_exact && !rounds) exact_ = nullptr;
    return {std::move(volume), std::move(exact_), std::move(rounding)};
  }

 private:
  Status Make() {
    const std::size_t bytes = CountIn(size_) * sample_;
    if (Status fits = CheckFitsMemory(std::int64_t(bytes), name_); !fits.ok()) return fits;
    exact_ = std::make_shared<ExactSamples>(ExactSamples{of_, AlignedVector<std::byte>(bytes)});
    // What has been read before is kept exactly.
    VisitSampleType(of_.type, [&]<class T>(const T*) {
      for (const Box& box : done_) {
        ForEachRow(box, [&](std::size_t first, std::size_t count) {
          std::ranges::transform(std::span(volume_.block.samples<float>() + first, count),
                                 reinterpret_cast<T*>(exact_->bytes.data()) + first, [](float sample) { return T(sample); });
        });
      }
    });
    return Status::Ok();
  }

  template <class Function>
  void ForEachRow(const Box& box, Function&& function) const {
    for (std::int32_t z = box.begin.z; z < box.end.z; ++z) {
      for (std::int32_t y = box.begin.y; y < box.end.y; ++y) {
        function(NumberIn(size_, {box.begin.x, y, z}), std::size_t(box.size().x));
      }
    }
  }

  const ExactType of_;
  const std::string name_;
  const LevelWanted wanted_;
  bool keeps_, rounds_ = false;
  Volume& volume_;
  const Index3 size_ = volume_.description.geometry.size;
  const std::size_t sample_ = BytesPerSample(of_.type);
  AlignedVector<std::byte> stored_;
  std::shared_ptr<ExactSamples> exact_;
  FloatReach reach_;
  std::vector<Box> done_;
};

// A read of a box. Whoever drops it waits for its end, since its voxels have a place until then.
class ReadUnderWay {
 public:
  ReadUnderWay(VolumeSource& source, int level, const Box& box, const BoxRoom& room) {
    source.Read(level, box, room, {}, [this](Status status) { end_.set_value(std::move(status)); });
  }
  ~ReadUnderWay() {
    if (read_.valid()) read_.wait();
  }
  ReadUnderWay(const ReadUnderWay&) = delete;
  ReadUnderWay& operator=(const ReadUnderWay&) = delete;

  Status Wait() { return read_.get(); }

 private:
  std::promise<Status> end_;
  std::future<Status> read_ = end_.get_future();
};

// Makes the summary of a volume of which one box after the other comes. On the calling thread alone, so that the reader keeps its core.
class SummaryOfComing {
 public:
  explicit SummaryOfComing(const Volume& volume) : volume_(volume), pieces_(volume.description) {}

  void Add(const Box& come) {
    here_.Run([&] { pieces_.Add(volume_.block, come); });
  }
  // All boxes have come.
  std::shared_ptr<const VolumeSummary> Take() {
    if (pieces_.EndOfPieces()) pieces_.AddAgain(volume_.block);
    return std::make_shared<const VolumeSummary>(pieces_.Take());
  }

 private:
  const Volume& volume_;
  PiecewiseSummary pieces_;
  TaskArena here_{1};
};

}  // namespace

Result<LevelInMemory> VolumeSource::DoReadLevel(int level, ReadProgress* progress, const LevelWanted& wanted) {
  const SourceLevel& of = info().levels[std::size_t(level)];
  const std::string name = info().format + " volume";
  if (Status fits = CheckFitsMemory(of.description.voxel_bytes(), name); !fits.ok()) return fits;
  auto volume = std::make_shared<Volume>();
  volume->description = of.description;
  volume->block = MakeVoxelBlock(of.description.geometry.bounds(), of.description.type);
  std::optional<ExactCopy> exact;
  if (const ExactType& type = info().exact; MayBeRounded(type.type)) exact.emplace(type, name, wanted, *volume);
  if (info().slices) progress = nullptr;
  if (progress != nullptr) progress->Begin(of.description.voxel_bytes());
  const Index3& size = of.description.geometry.size;
  const std::size_t sample_bytes = BytesPerSample(of.description.type);
  // A stream keeps one thread busy: this one counts what has come. Other sources are read by all.
  std::optional<SummaryOfComing> summary;
  if (wanted.summary && info().slices && !exact) summary.emplace(*volume);
  Box come;
  for (const Box& box : StretchesOf(of, info().slices.value_or(SliceOrder{}), summary.has_value())) {
    Status read;
    if (exact) {
      read = exact->Read(*this, level, box);
    } else {
      ReadUnderWay reading(*this, level, box, RoomIn(size, volume->block.bytes.data(), sample_bytes, box));
      if (summary) summary->Add(come);  // at first, nothing
      read = reading.Wait();
    }
    if (!read.ok()) return read;
    if (progress != nullptr) progress->Add(box.voxel_count() * std::int64_t(sample_bytes));
    come = box;
  }
  if (exact) return exact->Take(std::move(volume));
  if (summary) summary->Add(come);
  LevelInMemory read{.volume = volume};
  if (summary) read.summary = summary->Take();
  return read;
}

}  // namespace slabstream
