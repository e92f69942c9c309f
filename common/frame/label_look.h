// How a picture shows the labels of its dataset (common/volume/labels.h): as a client asks for it (LabelChoice), and as workers are told
// (LabelLook). docs/rendering.md defines what it means for a picture.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "common/classification/transfer_function.h"
#include "common/text/wildcard.h"
#include "common/volume/labels.h"
#include "common/volume/summary.h"

namespace slabstream {

// kTint: labels colour the material that the transfer function shows; one that is not shown takes its material away.
// kSurface: a label is material of its own, in place of the volume's. kHighlight: as kTint, but the material of a label that is not shown
// stays as it is. kAuto: kSurface of a dataset of labels alone, else kTint.
enum class LabelMode : std::uint8_t { kTint = 1, kSurface = 2, kHighlight = 3, kAuto = 4 };

// Of kSurface. kBlocky: a place has the label of the voxel that it lies in. kSmooth: labels are smoothed (common/frame/smooth_label.h).
enum class LabelSurface : std::uint8_t { kBlocky = 1, kSmooth = 2 };

inline constexpr double kDefaultTint = 0.6;
inline constexpr std::size_t kMaxLabelRanges = std::size_t{1} << 18;

// Values of labels, both ends included, 1 <= first <= last. Or if there is a name, the labels of that name.
struct LabelRange {
  std::uint64_t first = 1, last = 1;
  std::string name = {};  // may be a pattern (common/text/wildcard.h); at most kMaxNameBytes
  friend bool operator==(const LabelRange&, const LabelRange&) = default;
};
inline bool Covers(const LabelRange& range, const Label& label) {
  if (!range.name.empty()) return MatchesPattern(label.name, range.name);
  return range.first <= label.value && label.value <= range.last;
}

struct LabelOpacity {
  std::uint64_t value = 1;  // at least 1
  double opacity = 1;       // [0, 1]; kSurface: of a voxel length of the label; else a factor of the material's opacity
  friend bool operator==(const LabelOpacity&, const LabelOpacity&) = default;
};

struct LabelChoice {
  LabelMode mode = LabelMode::kAuto;
  double tint = kDefaultTint;  // [0, 1]: share of the label's colour; not of kSurface
  // Opacities of labels; a label that is not named has 1, none is named twice; at most kMaxLabels.
  std::vector<LabelOpacity> opacities;
  std::vector<LabelRange> shown;  // empty: all; at most kMaxLabelRanges
  LabelSurface surface = LabelSurface::kBlocky;
  friend bool operator==(const LabelChoice&, const LabelChoice&) = default;
};

// ---- resolved

// How one label is drawn.
struct LabelStyle {
  Rgb color;
  float opacity = 1;  // as LabelOpacity
  bool shown = true;  // else the volume's material is drawn as it is
};

struct LabelLook {
  struct Entry {
    std::uint64_t value = 0;
    Rgb color;
    float opacity = 1;
    friend bool operator==(const Entry&, const Entry&) = default;
  };
  struct Span {
    std::uint64_t first = 0, last = 0;  // both included
    friend bool operator==(const Span&, const Span&) = default;
  };
  LabelMode mode = LabelMode::kTint;  // or kSurface; kHighlight is kTint without `hides`, kAuto one of the two
  double tint = kDefaultTint;
  std::vector<Entry> entries;  // values rise; other labels have their StandardColor and the opacity 1
  std::vector<Span> shown;     // rise and do not touch; empty: all labels
  bool hides = false;          // labels that are not shown take their material away
  bool smooth = false;         // LabelSurface::kSmooth; only of kSurface
  friend bool operator==(const LabelLook&, const LabelLook&) = default;
};

// Of any value; 0: none, which is not shown.
LabelStyle StyleOf(const LabelLook& look, std::uint64_t value);

// Whether labels within a range of float values, which may be rounded ones, may be material under any transfer function. Never wrongly
// false.
bool MayBeMatter(const LabelLook& look, const ValueRange& values);

// What labels mean where there is no translucency, as in the Z-buffer, which draws opaque voxels and no others. Half decides, as it does of
// the transfer function's opacities: a label whose opacity is below 1/2 is clear.
enum class LabelUse : std::uint8_t {
  kAsVolume,  // the transfer function says whether voxels are opaque
  kClear,     // they are not
  kOpaque,    // they are
};
LabelUse UseOf(LabelMode mode, const LabelStyle& style);

}  // namespace slabstream
