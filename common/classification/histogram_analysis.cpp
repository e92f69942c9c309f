#include "common/classification/histogram_analysis.h"

#include <algorithm>
#include <numeric>

namespace slabstream {
namespace {

// Counts by bin; smoothed ones are no integers.
using Histogram = std::array<double, kHistogramBins>;

constexpr int kLast = kHistogramBins - 1;

double Sum(const Histogram& histogram, int first, int last) {
  return first > last ? 0 : std::accumulate(histogram.begin() + first, histogram.begin() + last + 1, 0.0);
}

constexpr int kRadius = 2;  // bins of smoothing to either side

// Mean of five neighbours: integer samples over fewer or more than 256 values leave gaps and doubled bins that mean nothing.
Histogram Smoothed(const Histogram& histogram) {
  Histogram smoothed;
  for (int bin = 0; bin <= kLast; ++bin) {
    const int first = std::max(0, bin - kRadius), last = std::min(kLast, bin + kRadius);
    smoothed[std::size_t(bin)] = Sum(histogram, first, last) / (last - first + 1);
  }
  return smoothed;
}

// Whether the lowest bin is a background of its own that needs no smoothing.
bool LowestStandsApart(const Histogram& histogram, double total) {
  constexpr double kShare = 0.05;  // of all voxels
  constexpr int kNeighbours = 8;
  constexpr double kDrop = 4;
  return histogram.front() >= kShare * total && histogram.front() >= kDrop * Sum(histogram, 1, kNeighbours);
}

int LastFilled(const Histogram& histogram) {
  int last = kLast;
  while (last > 0 && histogram[std::size_t(last)] == 0) --last;
  return last;
}

// The highest bin; if smoothing spread it over its neighbours, the bin that it came from.
int FindPeak(const Histogram& histogram, const Histogram& smoothed) {
  const auto spread = std::max_element(smoothed.begin(), smoothed.end()) - smoothed.begin();
  const auto first = std::max<std::ptrdiff_t>(0, spread - kRadius), last = std::min<std::ptrdiff_t>(kLast, spread + kRadius);
  return int(std::max_element(histogram.begin() + first, histogram.begin() + last + 1) - histogram.begin());
}

// The bins from the foot of the peak to the end of the histogram, walking upwards. The foot is where the histogram lies furthest below the
// line from the peak to the last bin that holds anything, and then on as long as the flank still falls steeply.
MaterialBins AbovePeak(const Histogram& histogram, int peak) {
  const auto count = [&](int bin) { return histogram[std::size_t(bin)]; };
  const int last = LastFilled(histogram);
  if (last <= peak) return {};
  int foot = peak + 1;
  double deepest = -1;
  for (int bin = peak + 1; bin <= last; ++bin) {
    const double line = std::lerp(count(peak), count(last), double(bin - peak) / (last - peak));
    if (line - count(bin) > deepest) {
      deepest = line - count(bin);
      foot = bin;
    }
  }
  constexpr double kFootHeight = 0.5;  // of the peak, at most: a peak that is cut off by the end of the range has no foot there
  if (count(foot) > kFootHeight * count(peak)) return {};
  constexpr double kSteep = 0.85;  // of the bin before
  while (foot < last && count(foot) > 0 && count(foot + 1) < kSteep * count(foot)) ++foot;
  return {foot, last, 0};
}

// ---- outliers

// The fewest consecutive bins that hold all voxels but at most `few`.
MaterialBins BinsOfNearlyAll(const VolumeSummary& summary, double few) {
  const auto count = [&](int bin) { return double(summary.histogram[std::size_t(bin)]); };
  MaterialBins best = {0, kLast, 1};
  double before = 0;  // voxels in the bins below `first`
  for (int first = 0; first <= kLast && before <= few; before += count(first++)) {
    double left_out = before;
    int last = kLast;
    while (last > first && left_out + count(last) <= few) left_out += count(last--);
    if (last - first < best.last - best.first) best = {first, last, 1};
  }
  return best;
}

// Each brick's voxels are spread evenly over the part of its range within summary.range.
void CountByBricks(const BrickRangeList& bricks, VolumeSummary& summary) {
  constexpr double kCount = 1 << 20;  // of a brick, so that a share of it is a whole number
  Histogram counts = {};
  for (const ValueRange& brick : bricks) {
    if (brick.min > brick.max || brick.max < summary.range.min || brick.min > summary.range.max) continue;
    const int first = HistogramBin(summary.range, brick.min), last = HistogramBin(summary.range, brick.max);
    for (int bin = first; bin <= last; ++bin) counts[std::size_t(bin)] += kCount / (last - first + 1);
  }
  std::ranges::transform(counts, summary.histogram.begin(), [](double count) { return std::uint64_t(count); });
}

Histogram Mirrored(Histogram histogram) {
  std::reverse(histogram.begin(), histogram.end());
  return histogram;
}

}  // namespace

double BinValue(const ValueRange& range, int bin) {
  if (bin == 0) return range.min;
  if (bin == kLast) return range.max;
  return std::lerp(double(range.min), double(range.max), (bin + 0.5) / kHistogramBins);
}

double BinBorder(const ValueRange& range, int bin) { return std::lerp(double(range.min), double(range.max), bin / double(kHistogramBins)); }

VolumeSummary WithoutOutliers(const VolumeSummary& summary) {
  constexpr double kFew = 4, kFewShare = 1e-5, kMostShare = 0.01;  // voxels
  constexpr int kTooFewBins = 8;
  VolumeSummary usual;
  usual.description = summary.description;
  usual.range = summary.range;
  usual.histogram = summary.histogram;
  const double total = double(std::accumulate(summary.histogram.begin(), summary.histogram.end(), std::uint64_t{0}));
  const MaterialBins bins = BinsOfNearlyAll(summary, std::min(std::max(kFew, kFewShare * total), kMostShare * total));
  if (bins.last - bins.first >= kTooFewBins) return usual;
  const double from = BinBorder(summary.range, bins.first), to = BinBorder(summary.range, bins.last + 1);
  ValueRange within = {float(to), float(from)};
  for (const ValueRange& brick : summary.bricks) {
    if (brick.min > brick.max) continue;
    for (const float end : {brick.min, brick.max}) {
      if (end < from || end > to) continue;
      within = {std::min(within.min, end), std::max(within.max, end)};
    }
  }
  if (!(within.min < within.max)) return usual;
  usual.range = within;
  CountByBricks(summary.bricks, usual);
  return usual;
}

Foreground FindForeground(const VolumeSummary& summary) {
  constexpr double kNoiseShare = 0.2;  // of the other side
  Histogram histogram;
  std::copy(summary.histogram.begin(), summary.histogram.end(), histogram.begin());
  const double total = Sum(histogram, 0, kLast);
  if (total == 0) return {};

  Foreground foreground;
  if (LowestStandsApart(histogram, total)) {
    foreground.above = {1, LastFilled(histogram), 0};
  } else {
    const Histogram smoothed = Smoothed(histogram);
    const int peak = FindPeak(histogram, smoothed);
    foreground.above = AbovePeak(smoothed, peak);
    const MaterialBins below = AbovePeak(Mirrored(smoothed), kLast - peak);
    if (below.first <= below.last) foreground.below = {kLast - below.last, kLast - below.first, 0};
  }
  const auto share = [&](const MaterialBins& bins) { return Sum(histogram, bins.first, bins.last) / total; };
  foreground.above.share = share(foreground.above);
  foreground.below.share = share(foreground.below);
  if (foreground.below.share < kNoiseShare * foreground.above.share) foreground.below = {};
  if (foreground.above.share < kNoiseShare * foreground.below.share) foreground.above = {};
  if (foreground.above.share == 0 && foreground.below.share == 0 && summary.range.min < summary.range.max) {
    foreground.above = {1, kLast, share({1, kLast, 0})};
  }
  return foreground;
}

double Quantile(const VolumeSummary& summary, const MaterialBins& bins, double q) {
  const auto begin = summary.histogram.begin();
  const double wanted = q * double(std::accumulate(begin + bins.first, begin + bins.last + 1, std::uint64_t{0}));
  double below = 0;
  for (int bin = bins.first; bin < bins.last; ++bin) {
    below += double(summary.histogram[std::size_t(bin)]);
    if (below > 0 && below >= wanted) return BinValue(summary.range, bin);
  }
  return BinValue(summary.range, bins.last);
}

}  // namespace slabstream
