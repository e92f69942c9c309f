// BinLookup<T>: finds the bin of a stored sample in the classification table, for selected bins (visible or opaque ones).
#pragma once

#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <type_traits>
#include <vector>

#include "common/classification/classification_table.h"
#include "worker/kernels/select_samples.h"

namespace slabstream {

inline constexpr std::uint16_t kNotSelected = 0xFFFF;  // kMaxBins is far below
static_assert(kMaxBins < kNotSelected);

// Determines each sample's bin and whether the bin counts. Equal selections select the same voxels with the same bins.
struct BinSelection {
  double scale = 1, origin = 0;        // ClassificationTable's scale and origin
  std::vector<std::uint8_t> selected;  // by bin: 0 or 1
  friend bool operator==(const BinSelection&, const BinSelection&) = default;
};

inline BinSelection SelectBins(const ClassificationTable& table, float least_opacity) {
  BinSelection selection{table.bin_from_stored_scale, table.stored_origin, {}};
  for (float opacity : table.opacity) selection.selected.push_back(opacity > 0 && opacity >= least_opacity);
  return selection;
}

template <class T>
class BinLookup {
 public:
  BinLookup(const ClassificationTable& table, const BinSelection& selection) : table_(&table), selection_(&selection) {
    if constexpr (std::is_integral_v<T>) {
      bins_.resize(std::size_t{std::numeric_limits<T>::max()} + 1);
      for (std::size_t sample = 0; sample < bins_.size(); ++sample) {
        const int bin = table.BinOf(double(sample));
        bins_[sample] = selection.selected[std::size_t(bin)] != 0 ? std::uint16_t(bin) : kNotSelected;
      }
    }
    selected_before_.push_back(0);
    for (std::uint8_t s : selection.selected) selected_before_.push_back(selected_before_.back() + s);
  }

  // The sample's bin, or kNotSelected; samples that are not finite have no bin.
  std::uint16_t operator()(T sample) const {
    if constexpr (std::is_integral_v<T>) {
      return bins_[sample];
    } else {
      if (!std::isfinite(sample)) return kNotSelected;
      const int bin = table_->BinOf(double(sample));
      return selection_->selected[std::size_t(bin)] != 0 ? std::uint16_t(bin) : kNotSelected;
    }
  }

  // The selected samples, finite ones, as disjoint intervals in ascending order.
  std::vector<SampleInterval<T>> Intervals() const {
    std::vector<SampleInterval<T>> intervals;
    const std::vector<std::uint8_t>& selected = selection_->selected;
    for (std::size_t bin = 0; bin < selected.size(); ++bin) {
      if (selected[bin] == 0) continue;
      const std::size_t first = bin;
      while (bin + 1 < selected.size() && selected[bin + 1] != 0) ++bin;
      // If no sample falls into these bins, this is the first sample of a later bin.
      const std::int64_t begin = FirstWithBin(int(first)), end = FirstWithBin(int(bin) + 1);
      if (begin < end) intervals.push_back({SampleAt(begin), SampleAt(end - 1)});
    }
    return intervals;
  }

  // False if no sample in [low, high] is selected.
  bool AnyBetween(double low, double high) const {
    return low <= high && selected_before_[std::size_t(table_->BinOf(high)) + 1] > selected_before_[std::size_t(table_->BinOf(low))];
  }

 private:
  // Finite samples by their position in ascending order, [0, kSamples). Floats are ordered as the integers of their bits, negative ones
  // backwards; -0 has the position of 0.
  static constexpr std::int64_t kFiniteFloats = 0x7F800000;  // without sign
  static constexpr std::int64_t kSamples = std::is_integral_v<T> ? std::int64_t{1} << (8 * sizeof(T)) : 2 * kFiniteFloats - 1;
  static T SampleAt(std::int64_t place) {
    if constexpr (std::is_integral_v<T>) {
      return T(place);
    } else {
      const std::int64_t signed_place = place - (kFiniteFloats - 1);
      const auto magnitude = std::bit_cast<float>(std::uint32_t(std::abs(signed_place)));
      return signed_place < 0 ? -magnitude : magnitude;
    }
  }

  // Position of the least sample whose bin is at least `bin`; kSamples: there is none. Bins ascend with samples.
  std::int64_t FirstWithBin(int bin) const {
    std::int64_t low = 0, high = kSamples;
    while (low < high) {
      const std::int64_t middle = (low + high) / 2;
      if (bin < table_->size() && table_->BinOf(double(SampleAt(middle))) >= bin) {
        high = middle;
      } else {
        low = middle + 1;
      }
    }
    return low;
  }

  const ClassificationTable* table_;
  const BinSelection* selection_;
  std::vector<std::uint16_t> bins_;
  std::vector<int> selected_before_;
};

}  // namespace slabstream
