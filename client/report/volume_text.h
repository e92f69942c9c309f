// What a dataset holds, as the command line and the gateway show it.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "common/json/json.h"
#include "common/wire/client_messages.h"

namespace slabstream {

// A data value with every digit that it has. Whole numbers in full up to 2^64; of others the shortest text that reads back the same: as a
// float, if the value is one.
std::string ValueText(double value);

// {"dataset", "range", "counts", "non_finite", "percentiles": {"50": value, ...}}
Json HistogramJson(const std::string& dataset, const SummaryReply& summary);

// {"dataset", "range", "steepest", "values", "slopes", "counts"}
Json JointHistogramJson(const std::string& dataset, const JointHistogramReply& reply);

std::string ColorText(const std::array<float, 3>& color);  // "#rrggbb"
// {"value", "name", "color": "#rrggbb"}
Json LabelJson(const Label& label);
// {"dataset", "labels": [LabelJson, ...]}
Json LabelsJson(const std::string& dataset, const SummaryReply& summary);

// {"at", "inside", "voxel", "value", "label": {"value", "name"} if there are labels, "fields": [{"name", "value"}, ...], "interpolated"}.
// Null: there is none. Outside the volume: the first four.
Json SampleJson(const VolumeSample& sample);
// What a pixel of a picture shows, which `frame` asked for: the members of SampleJson, "hit" and "depth". A shape or a plane adds "shape"
// (its name, or "plane"), "shape_number" and "shape_value". A pixel that shows nothing: {"hit": false}.
Json PickJson(const PickReply& picked, const FrameRequest& frame);

// {"from", "to", "length", "values"}: what samples along a line hold, at least two of them. Null: nothing, or no finite value.
Json ProfileJson(const std::vector<VolumeSample>& samples);

// {"voxels", "non_finite", "mean", "deviation", "least", "largest"}. Null: there are no voxels.
Json BoxStatisticsJson(const BoxStatistics& box);

// What voxels of a dataset take of the world: millilitres, if the length of its unit is known in mm, cm or m; else its unit cubed.
struct VoxelMeasure {
  std::string unit;   // "ml", "\u00b5m^3"
  double volume = 1;  // the volume of a voxel
};
VoxelMeasure MeasureOf(const VolumeGeometry& geometry);

// {"unit", "labels": [{"value", "name", "color", "volume", and the fields of BoxStatisticsJson}, ...]}
Json LabelStatisticsJson(const StatisticsReply& reply);
// The same as lines of a table: comma-separated as RFC 4180 has it, with a line of names; or in columns.
std::string LabelStatisticsCsv(const StatisticsReply& reply);
std::string LabelStatisticsText(const StatisticsReply& reply);

// One line. The first field is the one that "value" is of.
std::string SampleText(const VolumeSample& sample);

}  // namespace slabstream
