// BinLookup<T>: from a stored sample to its bin of the classification table, for the bins that were selected (visible ones, opaque ones).
#pragma once

#include <cmath>
#include <cstdint>
#include <limits>
#include <span>
#include <type_traits>
#include <vector>

#include "common/classification/classification_table.h"

namespace slabstream {

inline constexpr std::uint16_t kNotSelected = 0xFFFF;  // kMaxBins is far below
static_assert(kMaxBins < kNotSelected);

// What decides which bin a sample has and whether the bin counts. Equal selections select the same voxels with the same bins.
struct BinSelection {
  double scale = 1, origin = 0;        // of ClassificationTable
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

  // False if no sample in [low, high] is selected.
  bool AnyBetween(double low, double high) const {
    return low <= high && selected_before_[std::size_t(table_->BinOf(high)) + 1] > selected_before_[std::size_t(table_->BinOf(low))];
  }

 private:
  const ClassificationTable* table_;
  const BinSelection* selection_;
  std::vector<std::uint16_t> bins_;
  std::vector<int> selected_before_;
};

}  // namespace slabstream
