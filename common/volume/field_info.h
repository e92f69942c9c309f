// FieldInfo: what a dataset says of one of its fields. A dataset has one field or several: the channels of its volume, which lie on one
// grid, and perhaps an overlay and labels, each with a grid and a place of its own. Fields are numbered from 0: channels, overlay, labels.
//
// TimeAxis: the times of a dataset. All of its channels have the same ones.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/volume/summary.h"

namespace slabstream {

inline constexpr std::size_t kMaxFields = 64;       // of a dataset; further channels of a file are not shown
inline constexpr std::size_t kMaxShownFields = 16;  // of a picture

inline constexpr std::string_view kOverlayField = "overlay";  // the name of a second volume over the first one
inline constexpr std::string_view kLabelsField = "labels";    // the name of the field of labels

inline constexpr std::array<std::string_view, 3> kComponentNames = {"red", "green", "blue"};  // of fields that are parts of a colour

struct FieldInfo {
  std::string name = {};  // "": it has none, and is called by its number
  bool channel = true;    // of the volume, on its grid; else it has a grid of its own
  bool labels = false;    // its values are labels (labels.h), and it is no channel
  // What its author shows, as far as the file says it.
  std::optional<std::array<float, 3>> color = {};  // straight red, green, blue, [0, 1]
  std::optional<ValueRange> window = {};           // data values that are dark and bright, min < max
  bool shown = true;
  friend bool operator==(const FieldInfo&, const FieldInfo&) = default;
};

struct TimeAxis {
  int count = 1;                    // at least 1
  std::optional<double> step = {};  // from a time to the next one, above 0; none: the file does not say, or times are not evenly spaced
  std::string unit = {};            // of `step`, as UCUM spells it: "s", "ms", "min", "h"; "": not known
  friend bool operator==(const TimeAxis&, const TimeAxis&) = default;
};

// What a dataset has to show.
struct DatasetFields {
  std::vector<FieldInfo> fields = {FieldInfo{}};  // 1 ... kMaxFields
  TimeAxis times = {};
  int field = 0, time = 0;  // those that its source shows if nothing is said
  bool several() const { return fields.size() > 1; }
  // The number of the field of labels; none: there are no labels.
  std::optional<int> labels() const { return fields.back().labels ? std::optional(int(fields.size()) - 1) : std::nullopt; }
  int values() const { return int(fields.size()) - (fields.back().labels ? 1 : 0); }  // fields that are not of labels
  friend bool operator==(const DatasetFields&, const DatasetFields&) = default;
};

}  // namespace slabstream
