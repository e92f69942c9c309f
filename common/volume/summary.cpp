#include "common/volume/summary.h"

#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <type_traits>

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

// The range of stored samples; low > high until a finite one was met.
template <class T>
struct StoredRange {
  T low = std::numeric_limits<T>::max();
  T high = std::numeric_limits<T>::lowest();

  bool empty() const { return low > high; }
  void Include(const StoredRange& other) {
    low = std::min(low, other.low);
    high = std::max(high, other.high);
  }
};

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

// Ranges of the bricks of one row of bricks along x. Rows of voxels are first folded onto each other, which vectorises for every type, and
// then into bricks.
template <class T>
class BrickRow {
 public:
  explicit BrickRow(std::int32_t width)
      : low_(std::size_t(width), std::numeric_limits<T>::max()), high_(std::size_t(width), std::numeric_limits<T>::lowest()) {}

  void Fold(const T* __restrict row) {
    T* __restrict low = low_.data();
    T* __restrict high = high_.data();
    const std::size_t width = low_.size();
    for (std::size_t x = 0; x < width; ++x) {
      const T value = row[x];
      if constexpr (std::is_floating_point_v<T>) {
        // Comparisons with NaN are false; infinite values are replaced by the bounds so far.
        const bool finite = IsFinite(value);
        const T low_value = finite ? value : low[x], high_value = finite ? value : high[x];
        low[x] = low_value < low[x] ? low_value : low[x];
        high[x] = high_value > high[x] ? high_value : high[x];
      } else {
        low[x] = std::min(low[x], value);
        high[x] = std::max(high[x], value);
      }
    }
  }

  StoredRange<T> Brick(std::int32_t brick) const {
    const std::size_t begin = std::size_t(brick) * kBrick, end = std::min(begin + kBrick, low_.size());
    StoredRange<T> range;
    for (std::size_t x = begin; x < end; ++x) range.Include({low_[x], high_[x]});
    return range;
  }

 private:
  std::vector<T> low_, high_;
};

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

struct NoCounts {
  void Add(const float*, std::int32_t) {}
};

// What one thread finds.
template <class T>
struct Part {
  StoredRange<T> range;
  std::conditional_t<std::is_integral_v<T>, StoredCounts<T>, NoCounts> counts;
};
struct FloatPart {
  std::array<std::uint64_t, kHistogramBins> histogram{};
  std::int64_t non_finite = 0;
};

template <class T>
void FillSummary(const Volume& volume, VolumeSummary& summary) {
  const ValueMapping& mapping = summary.description.mapping;
  const Index3 size = summary.description.geometry.size, bricks = summary.brick_counts;
  const auto row_at = [&](std::int32_t y, std::int32_t z) { return volume.block.samples<T>() + volume.block.Offset({0, y, z}); };

  tbb::enumerable_thread_specific<Part<T>> parts;
  summary.bricks.resize(CountIn(bricks));
  tbb::parallel_for(0, bricks.y * bricks.z, [&](std::int32_t row_of_bricks) {
    Part<T>& part = parts.local();
    BrickRow<T> brick_row(size.x);
    const std::int32_t y_begin = row_of_bricks % bricks.y * kBrick, z_begin = row_of_bricks / bricks.y * kBrick;
    for (std::int32_t z = z_begin; z < std::min(z_begin + kBrick, size.z); ++z) {
      for (std::int32_t y = y_begin; y < std::min(y_begin + kBrick, size.y); ++y) {
        brick_row.Fold(row_at(y, z));
        part.counts.Add(row_at(y, z), size.x);
      }
    }
    ValueRange* out = &summary.bricks[std::size_t(row_of_bricks) * std::size_t(bricks.x)];
    for (std::int32_t brick = 0; brick < bricks.x; ++brick) {
      const StoredRange<T> range = brick_row.Brick(brick);
      part.range.Include(range);
      *out++ = ToDataValues(range, mapping, kNoFiniteValue);
    }
  });
  StoredRange<T> whole;
  for (const Part<T>& part : parts) whole.Include(part.range);
  summary.range = ToDataValues(whole, mapping, ValueRange{0, 0});

  if constexpr (std::is_integral_v<T>) {
    for (std::size_t stored = whole.low; stored <= whole.high; ++stored) {
      std::uint64_t& bin = summary.histogram[std::size_t(HistogramBin(summary.range, DataValue(mapping, double(stored))))];
      for (const Part<T>& part : parts) bin += part.counts[stored];
    }
  } else {
    // Bins need the range first, so these voxels are read a second time.
    tbb::enumerable_thread_specific<FloatPart> float_parts;
    tbb::parallel_for(0, size.z, [&](std::int32_t z) {
      FloatPart& part = float_parts.local();
      for (std::int32_t y = 0; y < size.y; ++y) {
        const T* row = row_at(y, z);
        for (std::int32_t x = 0; x < size.x; ++x) {
          if (IsFinite(row[x])) {
            ++part.histogram[std::size_t(HistogramBin(summary.range, DataValue(mapping, double(row[x]))))];
          } else {
            ++part.non_finite;
          }
        }
      }
    });
    for (const FloatPart& part : float_parts) {
      for (std::size_t bin = 0; bin < part.histogram.size(); ++bin) summary.histogram[bin] += part.histogram[bin];
      summary.non_finite += part.non_finite;
    }
  }
}

}  // namespace

VolumeSummary Summarize(const Volume& volume) {
  VolumeSummary summary;
  summary.description = volume.description;
  summary.brick_counts = CubesOver(volume.description.geometry.size, kBrick);
  VisitScalarType(volume.description.type, [&]<class T>(const T*) { FillSummary<T>(volume, summary); });
  return summary;
}

VolumeSummary Summarize(const LayeredVolume& volume) {
  VolumeSummary summary = Summarize(*volume.volume);
  const auto of_layer = [](const std::shared_ptr<const Volume>& layer) {
    return layer == nullptr ? nullptr : std::make_shared<const VolumeSummary>(Summarize(*layer));
  };
  summary.labels = of_layer(volume.layers.labels);
  summary.overlay = of_layer(volume.layers.overlay);
  summary.label_table = volume.layers.table;
  return summary;
}

}  // namespace slabstream
