#include "worker/rays/label_volume.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <unordered_set>

#include "common/parallel/parallel.h"
#include "common/parallel/per_thread.h"

namespace slabstream {
namespace {

// Rows of the padding, too.
template <class T, class Use>
void ForEachRow(const PaddedVoxels& voxels, Use&& use) {
  const std::size_t rows = std::size_t(voxels.box.size().y + 2 * kPad) * std::size_t(voxels.box.size().z + 2 * kPad);
  constexpr std::size_t kGrain = 64;
  ParallelForRanges(0, rows, kGrain, [&](std::size_t begin, std::size_t end) {
    const T* const samples = reinterpret_cast<const T*>(voxels.samples.get());
    for (std::size_t row = begin; row < end; ++row) use(row, samples + row * std::size_t(voxels.row));
  });
}

// The labels that are met, rising, 0 among them.
template <class T>
std::vector<std::uint64_t> ValuesIn(const PaddedVoxels& labels) {
  PerThread<std::unordered_set<T>> met;
  ForEachRow<T>(labels, [&](std::size_t, const T* row) {
    std::unordered_set<T>& mine = met.Mine();
    T last = 0;
    for (std::int32_t x = 0; x < labels.row; ++x) {
      if (row[x] != last) mine.insert(last = row[x]);  // most voxels have the label of the one before
    }
  });
  std::unordered_set<T> all = {0};
  met.ForEach([&](const std::unordered_set<T>& part) { all.insert(part.begin(), part.end()); });
  std::vector<std::uint64_t> values(all.begin(), all.end());
  std::ranges::sort(values);
  return values;
}

template <class T, class Number>
void FindNumbers(const PaddedVoxels& labels, const std::vector<std::uint64_t>& values, const PaddedVoxels& numbers) {
  ForEachRow<T>(labels, [&](std::size_t row, const T* from) {
    // A row meets few labels, again and again.
    constexpr std::size_t kKept = 64;
    std::array<T, kKept> kept_value{};
    std::array<Number, kKept> kept_number{};
    Number* const to = reinterpret_cast<Number*>(numbers.samples.get()) + row * std::size_t(numbers.row);
    for (std::int32_t x = 0; x < labels.row; ++x) {
      const T value = from[x];
      if (value == 0) continue;
      const std::size_t place = std::size_t(value) % kKept;
      if (kept_value[place] != value) {
        kept_value[place] = value;
        kept_number[place] = Number(std::ranges::lower_bound(values, std::uint64_t{value}) - values.begin());
      }
      to[x] = kept_number[place];
    }
  });
}

template <class T>
NumberedLabels Numbered(const PaddedVoxels& labels) {
  NumberedLabels made;
  if constexpr (sizeof(T) <= 2) {  // a label is its own number
    made.numbers.voxels = labels;
  } else {
    made.values = ValuesIn<T>(labels);
    const bool narrow = made.values.size() <= std::size_t{1} << 16;
    made.numbers.voxels = MakePaddedVoxels(labels.box, narrow ? ScalarType::kUint16 : ScalarType::kUint32);
    narrow ? FindNumbers<T, std::uint16_t>(labels, made.values, made.numbers.voxels)
           : FindNumbers<T, std::uint32_t>(labels, made.values, made.numbers.voxels);
  }
  made.numbers.cells = FindMacrocellRanges(made.numbers.voxels);
  if constexpr (sizeof(T) <= 2) {
    float greatest = 0;
    for (const MacrocellRange& cell : made.numbers.cells.ranges) greatest = std::max(greatest, cell.max);
    made.values.resize(std::size_t(greatest) + 1);
    std::iota(made.values.begin(), made.values.end(), std::uint64_t{0});
  }
  return made;
}

}  // namespace

Result<const NumberedLabels*> LabelVolume::Of(const BoxData& data) {
  if (labels_ != nullptr) return labels_.get();
  const VoxelBricks bricks = data.bricks();
  if (CutIntoLayers(bricks.box(), bricks.type(), kMostRayBytes).size() > 1) {
    return Status::ResourceExhausted(
        fmt::format("the labels of one box take more than {} MiB; more workers have smaller boxes", kMostRayBytes >> 20));
  }
  const PaddedVoxels padded = data.padded() != nullptr ? *data.padded() : Pad(bricks, bricks.box());
  labels_ = std::make_unique<const NumberedLabels>(VisitLabelType(bricks.type(), [&]<class T>(const T*) { return Numbered<T>(padded); }));
  return labels_.get();
}

const std::vector<LabelStyle>& LabelVolume::StylesOf(const LabelLook& look) {
  if (look_ != nullptr && *look_ == look) return styles_;
  look_ = std::make_unique<const LabelLook>(look);
  const std::vector<std::uint64_t>& values = labels_->values;
  styles_.resize(values.size());
  constexpr std::size_t kGrain = 1024;
  ParallelForRanges(0, values.size(), kGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) styles_[i] = StyleOf(look, values[i]);
  });
  return styles_;
}

std::size_t LabelVolume::bytes() const {
  const std::size_t styles = styles_.capacity() * sizeof(LabelStyle);
  if (labels_ == nullptr) return styles;
  const auto& [piece, values] = *labels_;
  const bool shared = piece.voxels.samples.use_count() > 1;  // with the padded box, which counts them
  return styles + (shared ? 0 : piece.voxels.bytes()) + piece.cells.bytes() + values.capacity() * sizeof(values[0]);
}

MatterNumbers::MatterNumbers(LabelMode mode, const std::vector<LabelStyle>& styles) : matter_before_(1) {
  for (const LabelStyle& style : styles) {
    const bool matter = mode == LabelMode::kSurface && style.shown && style.opacity > 0;
    matter_before_.push_back(matter_before_.back() + (matter ? 1 : 0));
  }
}

bool MatterNumbers::AnyBetween(float low, float high) const {
  if (!(low <= high)) return false;
  // Above 2^24 a float may be a rounded number.
  const auto number = [&](float of) { return std::min(std::size_t(of), matter_before_.size() - 2); };
  constexpr float kExact = 1 << 24;
  const float first = low > kExact ? std::nextafter(low, 0.0F) : low, last = high > kExact ? std::nextafter(high, 1e30F) : high;
  return matter_before_[number(last) + 1] > matter_before_[number(first)];
}

}  // namespace slabstream
