// How a frame shows the layers of its dataset (common/volume/layers.h): labels as a client asks for them (LabelChoice), and what workers
// are told of either layer (LayerLooks). docs/rendering.md defines what they mean for a picture.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/classification/transfer_function.h"
#include "common/text/wildcard.h"
#include "common/volume/layers.h"
#include "common/volume/summary.h"

namespace slabstream {

// kTint: labels colour the material that the transfer function shows; one that is not shown takes its material away.
// kSurface: a label is material of its own, in place of the volume's. kHighlight: as kTint, but the material of a label that is not shown
// stays as it is.
enum class LabelMode : std::uint8_t { kTint = 1, kSurface = 2, kHighlight = 3 };

inline constexpr double kDefaultTint = 0.6;
inline constexpr std::size_t kMaxLabelRanges = 1024;

// Values of labels, both ends included: 1 <= first <= last <= kMaxLabelValue. Or if there is a name, the labels of that name.
struct LabelRange {
  std::uint32_t first = 1, last = 1;
  std::string name = {};  // may be a pattern (common/text/wildcard.h); at most kMaxNameBytes
  friend bool operator==(const LabelRange&, const LabelRange&) = default;
};
inline bool Covers(const LabelRange& range, const Label& label) {
  if (!range.name.empty()) return MatchesPattern(label.name, range.name);
  return range.first <= label.value && label.value <= range.last;
}

struct LabelOpacity {
  std::uint32_t value = 1;  // [1, kMaxLabelValue]
  double opacity = 1;       // [0, 1]; kSurface: of a voxel length of the label; else a factor of the material's opacity
  friend bool operator==(const LabelOpacity&, const LabelOpacity&) = default;
};

struct LabelChoice {
  LabelMode mode = LabelMode::kTint;
  double tint = kDefaultTint;  // [0, 1]: share of the label's colour; not of kSurface
  // Opacities of labels; a label that is not named has 1, none is named twice; at most kMaxLabels.
  std::vector<LabelOpacity> opacities;
  std::vector<LabelRange> shown;  // empty: all; at most kMaxLabelRanges
  friend bool operator==(const LabelChoice&, const LabelChoice&) = default;
};

// ---- resolved

struct LabelLook {
  struct Entry {
    Rgb color;
    float opacity = 1;  // as LabelOpacity
    bool shown = true;  // else the volume's material is drawn as it is
    friend bool operator==(const Entry&, const Entry&) = default;
  };
  LabelMode mode = LabelMode::kTint;  // or kSurface; kHighlight is kTint with labels that are not shown
  double tint = kDefaultTint;
  std::vector<Entry> entries;  // entries[i - 1] is that of label number i
  friend bool operator==(const LabelLook&, const LabelLook&) = default;

  // The label is material under any transfer function.
  bool IsMatter(std::size_t number) const {
    return mode == LabelMode::kSurface && number != 0 && entries[number - 1].shown && entries[number - 1].opacity > 0;
  }
};

// Nothing: the frame does not show that layer.
struct LayerLooks {
  std::optional<LabelLook> labels = {};

  bool any() const { return labels.has_value(); }
  friend bool operator==(const LayerLooks&, const LayerLooks&) = default;
};

}  // namespace slabstream
