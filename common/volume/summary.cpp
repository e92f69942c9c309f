#include "common/volume/summary.h"

#include <cmath>
#include <limits>
#include <numeric>
#include <type_traits>
#include <utility>
#include <variant>

#include "common/parallel/parallel.h"
#include "common/parallel/per_thread.h"
#include "common/volume/column_ranges.h"

namespace slabstream {
namespace {

template <class T>
bool IsFinite(T stored) {
  if constexpr (std::is_floating_point_v<T>) {
    return std::abs(stored) <= std::numeric_limits<T>::max();
  } else {
    return true;
  }
}

// Data values are kept as float; a value beyond its range becomes the nearest finite float.
float DataValue(const ValueMapping& mapping, double stored) {
  constexpr double kLimit = std::numeric_limits<float>::max();
  return float(std::clamp(mapping.FromStored(stored), -kLimit, kLimit));
}

template <class T>
ValueRange ToDataValues(const StoredRange<T>& stored, const ValueMapping& mapping, ValueRange if_empty) {
  if (stored.empty()) return if_empty;
  const auto [min, max] = std::minmax({DataValue(mapping, stored.low), DataValue(mapping, stored.high)});  // the scale may be negative
  return {min, max};
}

// Of a piece of a block, calls met(part, row of samples, their number) for each row, and found(part, brick, its range) for each brick.
// Parallel: each row of bricks by one thread, which calls local() for its `part` first.
template <class T, class Local, class Met, class Found>
void ForEachRowOfBricks(const VoxelBlock& block, const Box& piece, Local&& local, Met&& met, Found&& found) {
  const Index3 begin = piece.begin, end = piece.end;
  const Index3 first = {begin.x / kBrick, begin.y / kBrick, begin.z / kBrick}, bricks = CubesOver(piece.size(), kBrick);
  ParallelFor(0, bricks.y * bricks.z, [&](std::int32_t row_of_bricks) {
    auto* const part = local();
    ColumnRanges<T> columns(std::size_t(end.x - begin.x));
    const Index3 row = {first.x, first.y + row_of_bricks % bricks.y, first.z + row_of_bricks / bricks.y};
    for (std::int32_t z = row.z * kBrick; z < std::min((row.z + 1) * kBrick, end.z); ++z) {
      for (std::int32_t y = row.y * kBrick; y < std::min((row.y + 1) * kBrick, end.y); ++y) {
        const T* const samples = block.samples<T>() + block.Offset({begin.x, y, z});
        columns.Fold(samples);
        met(*part, samples, end.x - begin.x);
      }
    }
    for (std::int32_t brick = 0; brick < bricks.x; ++brick) {
      const std::size_t x = std::size_t(brick) * kBrick;
      found(*part, row + Index3{brick, 0, 0}, columns.Of(x, x + kBrick));
    }
  });
}

// How often each stored integer occurs. Neighbouring voxels are often equal, and counting them in one table would make each wait for the
// one before it: four tables take turns.
template <class T>
class StoredCounts {
 public:
  static constexpr std::size_t kValues = std::size_t{std::numeric_limits<T>::max()} + 1;

  void Add(const T* row, std::int32_t width) {
    std::int32_t x = 0;
    for (; x + kWays <= width; x += kWays) {
      for (std::size_t way = 0; way < kWays; ++way) ++counts_[way * kValues + row[x + std::int32_t(way)]];
    }
    for (; x < width; ++x) ++counts_[row[x]];
  }

  std::uint64_t operator[](std::size_t value) const {
    std::uint64_t sum = 0;
    for (std::size_t way = 0; way < kWays; ++way) sum += counts_[way * kValues + value];
    return sum;
  }

 private:
  static constexpr std::int32_t kWays = 4;
  std::vector<std::uint64_t> counts_ = std::vector<std::uint64_t>(kWays * kValues);
};

// Floats are counted once their range is known; labels never, since a label says nothing of those beside it.
struct NoCounts {
  template <class T>
  void Add(const T*, std::int32_t) {}
};
template <class T>
constexpr bool kIsCounted = std::is_integral_v<T> && sizeof(T) <= 2;

// What one thread finds.
template <class T>
struct Part {
  StoredRange<T> range;
  std::conditional_t<kIsCounted<T>, StoredCounts<T>, NoCounts> counts;
};
struct FloatPart {
  std::array<std::uint64_t, kHistogramBins> histogram{};
  std::int64_t non_finite = 0;
};

template <class T>
class PiecesOf {
 public:
  void Add(const VoxelBlock& block, const Box& piece, VolumeSummary& summary) {
    ForEachRowOfBricks<T>(
        block, piece, [&] { return &parts_.Mine(); }, [](Part<T>& part, const T* row, std::int32_t width) { part.counts.Add(row, width); },
        [&](Part<T>& part, const Index3& brick, const StoredRange<T>& range) {
          part.range.Include(range);
          summary.bricks[NumberIn(summary.brick_counts, brick)] = ToDataValues(range, summary.description.mapping, kNoFiniteValue);
        });
  }

  void AddSample(const VoxelBlock& piece) {
    const Index3 size = piece.box.size();
    ParallelFor(0, size.z, [&](std::int32_t z) {
      Part<T>& part = parts_.Mine();
      ColumnRanges<T> columns{std::size_t(size.x)};
      for (std::int32_t y = 0; y < size.y; ++y) {
        const T* const samples = piece.samples<T>() + piece.Offset(piece.box.begin + Index3{0, y, z});
        columns.Fold(samples);
        part.counts.Add(samples, size.x);
      }
      part.range.Include(columns.Of(0, std::size_t(size.x)));
    });
  }

  // All pieces were added.
  void FindRange(VolumeSummary& summary) {
    const ValueMapping& mapping = summary.description.mapping;
    StoredRange<T> whole;
    parts_.ForEach([&](const Part<T>& part) { whole.Include(part.range); });
    summary.range = ToDataValues(whole, mapping, ValueRange{0, 0});
    if constexpr (kIsCounted<T>) {
      for (std::size_t stored = whole.low; stored <= whole.high; ++stored) {
        std::uint64_t& bin = summary.histogram[std::size_t(HistogramBin(summary.range, DataValue(mapping, double(stored))))];
        parts_.ForEach([&](const Part<T>& part) { bin += part.counts[stored]; });
      }
    }
  }

  // Bins need the range first, so floats are met a second time.
  static void AddToHistogram(const VoxelBlock& piece, VolumeSummary& summary) {
    PerThread<FloatPart> parts;
    const Index3 begin = piece.box.begin, size = piece.box.size();
    ParallelFor(0, size.z, [&](std::int32_t z) {
      FloatPart& part = parts.Mine();
      const T* const slice = piece.samples<T>() + piece.Offset({begin.x, begin.y, begin.z + z});
      for (std::int64_t i = 0; i < std::int64_t{size.x} * size.y; ++i) {
        if (IsFinite(slice[i])) {
          ++part.histogram[std::size_t(HistogramBin(summary.range, DataValue(summary.description.mapping, double(slice[i]))))];
        } else {
          ++part.non_finite;
        }
      }
    });
    parts.ForEach([&](const FloatPart& part) {
      for (std::size_t bin = 0; bin < part.histogram.size(); ++bin) summary.histogram[bin] += part.histogram[bin];
      summary.non_finite += part.non_finite;
    });
  }

 private:
  PerThread<Part<T>> parts_;
};

template <class T>
ValueRange AnyValueOf(const ValueMapping& mapping) {
  return ToDataValues(StoredRange<T>{std::numeric_limits<T>::lowest(), std::numeric_limits<T>::max()}, mapping, {});
}

}  // namespace

ValueRange AnyValue(const VolumeDescription& description) {
  return VisitStoredType(description.type, [&]<class T>(const T*) { return AnyValueOf<T>(description.mapping); });
}

VolumeSummary UnreadSummary(const VolumeDescription& description, const VolumeSummary& surveyed) {
  VolumeSummary summary = WithStatistics({.description = description}, surveyed);
  summary.non_finite = surveyed.non_finite;
  summary.labels = surveyed.labels;
  summary.brick_counts = CubesOver(description.geometry.size, kBrick);
  return summary;
}

VolumeSummary OverTimes(VolumeSummary own, std::span<const VolumeSummary> others) {
  if (others.empty()) return own;
  std::vector<const VolumeSummary*> times = {&own};
  for (const VolumeSummary& other : others) times.push_back(&other);
  const auto count = [](const VolumeSummary& of) { return std::accumulate(of.histogram.begin(), of.histogram.end(), 0.0); };
  std::erase_if(times, [&](const VolumeSummary* of) { return count(*of) == 0; });
  VolumeSummary over = own;
  over.times = 1 + int(others.size());
  if (times.empty()) return over;
  over.range = times.front()->range;
  for (const VolumeSummary* const of : times) {
    over.range = {std::min(over.range.min, of->range.min), std::max(over.range.max, of->range.max)};
  }
  const double voxels = count(*times.front());
  const double width = (double(over.range.max) - double(over.range.min)) / kHistogramBins;
  std::array<double, kHistogramBins> mean{};
  for (const VolumeSummary* const of : times) {
    const double weight = voxels / count(*of) / double(times.size());
    const double own_width = (double(of->range.max) - double(of->range.min)) / kHistogramBins;
    for (int bin = 0; bin < kHistogramBins; ++bin) {
      const double counted = double(of->histogram[std::size_t(bin)]) * weight, begin = double(of->range.min) + own_width * bin;
      if (counted == 0) continue;
      const int first = HistogramBin(over.range, begin), last = HistogramBin(over.range, begin + own_width);
      for (int to = first; to <= last; ++to) {
        const double from = double(over.range.min) + width * to;
        const double overlap = std::min(from + width, begin + own_width) - std::max(from, begin);
        mean[std::size_t(to)] += first == last ? counted : counted * std::max(overlap, 0.0) / own_width;
      }
    }
  }
  // What is rare stays.
  std::ranges::transform(mean, over.histogram.begin(), [](double each) { return each > 0 ? std::uint64_t(std::max(each, 1.0) + 0.5) : 0; });
  return over;
}

VolumeSummary WithStatistics(VolumeSummary summary, const VolumeSummary& statistics) {
  summary.range = statistics.range;
  summary.histogram = statistics.histogram;
  summary.times = statistics.times;
  return summary;
}

ValueRange DataRange(const VolumeDescription& description, const ValueRange& samples) {
  return ToDataValues(StoredRange<float>{samples.min, samples.max}, description.mapping, kNoFiniteValue);
}

void FindBrickRanges(const VoxelBlock& piece, const Index3& brick_counts, BrickRangeList& bricks) {
  VisitStoredType(piece.type, [&]<class T>(const T*) {
    ForEachRowOfBricks<T>(
        piece, piece.box, [&] { return &bricks; }, [](BrickRangeList&, const T*, std::int32_t) {},
        [&](BrickRangeList& all, const Index3& brick, const StoredRange<T>& range) {
          all[NumberIn(brick_counts, brick)] = ToDataValues(range, ValueMapping{}, kNoFiniteValue);
        });
  });
}

struct PiecewiseSummary::State {
  VolumeSummary summary;
  std::variant<PiecesOf<std::uint8_t>, PiecesOf<std::uint16_t>, PiecesOf<float>, PiecesOf<std::uint32_t>, PiecesOf<std::uint64_t>> pieces;
};

PiecewiseSummary::PiecewiseSummary(const VolumeDescription& description) : state_(std::make_unique<State>()) {
  VolumeSummary& summary = state_->summary;
  summary.description = description;
  summary.brick_counts = CubesOver(description.geometry.size, kBrick);
  VisitStoredType(description.type, [&]<class T>(const T*) { state_->pieces.emplace<PiecesOf<T>>(); });
}

PiecewiseSummary::~PiecewiseSummary() = default;

void PiecewiseSummary::Add(const VoxelBlock& block, const Box& piece) {
  VolumeSummary& summary = state_->summary;
  if (summary.bricks.empty()) summary.bricks.assign(CountIn(summary.brick_counts), AnyValue(summary.description));
  std::visit([&](auto& pieces) { pieces.Add(block, piece, summary); }, state_->pieces);
}

void PiecewiseSummary::AddSample(const VoxelBlock& piece) {
  std::visit([&](auto& pieces) { pieces.AddSample(piece); }, state_->pieces);
}

bool PiecewiseSummary::EndOfPieces() {
  std::visit([&](auto& pieces) { pieces.FindRange(state_->summary); }, state_->pieces);
  return state_->summary.description.type == ScalarType::kFloat32;
}

void PiecewiseSummary::AddAgain(const VoxelBlock& piece) { PiecesOf<float>::AddToHistogram(piece, state_->summary); }

VolumeSummary PiecewiseSummary::Take() { return std::move(state_->summary); }

VolumeSummary SummaryOfBricks(const Volume& volume, const VolumeSummary& surveyed) {
  VolumeSummary summary = UnreadSummary(volume.description, surveyed);
  summary.bricks.resize(CountIn(summary.brick_counts));
  FindBrickRanges(volume.block, summary.brick_counts, summary.bricks);
  for (ValueRange& brick : summary.bricks) brick = DataRange(volume.description, brick);
  return summary;
}

VolumeSummary Summarize(const Volume& volume) {
  PiecewiseSummary pieces(volume.description);
  pieces.Add(volume.block);
  if (pieces.EndOfPieces()) pieces.AddAgain(volume.block);
  return pieces.Take();
}

}  // namespace slabstream
