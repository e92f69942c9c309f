// Which fields of its dataset a request shows, at which time, and how: what it says of them, what the dataset says, and what is left over
// from the values.
//
// Pure.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/base/status.h"
#include "common/frame/field_look.h"
#include "common/frame/frame_request.h"
#include "common/frame/frame_setup.h"
#include "common/volume/field_info.h"
#include "common/volume/summary.h"

namespace slabstream {

// A level of a volume.
struct CoarserVolume {
  DatasetId dataset = 0;
  std::shared_ptr<const VolumeSummary> summary;  // never null
};

// A field that a picture shows beside its volume.
struct FieldVolume {
  int number = 0;                           // of the field
  bool labels = false;                      // its values are labels
  std::vector<CoarserVolume> levels;        // FieldSetup::levels
  std::vector<std::uint32_t> of_volume;     // FieldSetup::of_volume
  std::optional<CoarserVolume> light = {};  // ResolvedRequest::light, of this field
  friend bool operator==(const FieldVolume&, const FieldVolume&) = default;
};

// The fields that a picture shows.
struct ShownFields {
  std::shared_ptr<const DatasetFields> dataset = nullptr;  // null: it has one field, of which nothing is known
  int volume = 0;                                          // the number of the field that is the picture's volume
  bool volume_shows = true;                                // FieldNumbers::volume_shows
  std::vector<FieldVolume> others = {};                    // by ascending numbers, so labels are the last one
  std::vector<CoarserVolume> shapes = {};                  // of FrameRequest::shapes: the datasets that these name
  std::vector<CoarserVolume> planes = {};                  // of FrameRequest::planes, once it is known which voxels they go through

  // How many show that have values, with the volume.
  std::size_t values() const { return 1 + others.size() - (!others.empty() && others.back().labels ? 1 : 0); }
};

// Whether it has no values: its labels show without being asked for, and its volume is hollow (data/sources/hollow_source.h).
inline bool HasLabelsAlone(const DatasetFields& dataset) { return dataset.labels() && dataset.fields.back().shown; }

// The name of a field, or "channel 3", by its number; of one channel "volume".
std::string TitleOf(const ShownFields& shown, int number);

struct FieldNumbers {
  std::vector<int> numbers;  // ascending. The first one is the picture's volume: a channel, even if the request shows none
  bool volume_shows = true;  // it shows the first one
};
// InvalidArgument: there is no such field, or more than kMaxShownFields show.
Result<FieldNumbers> FieldsToShow(const FrameRequest& request, const DatasetFields& dataset);

// The number of the time that the request shows. InvalidArgument: there is no such time, or the dataset does not tell the unit of its
// times.
Result<int> TimeToShow(const FrameRequest& request, const DatasetFields& dataset);

// What a request shows of a dataset.
struct ShownAtTime {
  ShownFields fields;        // `others` have only their numbers
  std::vector<int> numbers;  // of all fields, the volume's first, labels last
  int time = 0;
};
// `dataset`: null: there is one field, of which nothing is known. Errors of FieldsToShow and TimeToShow; InvalidArgument: labels are
// asked for, and it has none.
Result<ShownAtTime> WhatShows(const FrameRequest& request, std::shared_ptr<const DatasetFields> dataset);

// How the request shows a field that the values of `summary` are those of. Blend::kAuto becomes that of the field. `full`: the strongest
// value is opaque (projections). In a slice all values are, and weak ones are dark. NotFound: no such preset; InvalidArgument: one that has
// regions.
Result<FieldLook> LookOf(const FrameRequest& request, const DatasetFields& dataset, int number, const VolumeSummary& summary, bool full);

// Whether the request shows its volume by LookOf, and not by FrameRequest::transfer: it is named, or one of several channels that show, and
// nothing is said of the transfer function. InvalidArgument: a transfer function is given, but several channels show.
Result<bool> ShowsAsChannel(const FrameRequest& request, const ShownFields& shown);

}  // namespace slabstream
