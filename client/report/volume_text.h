// What a dataset holds, as the command line and the gateway show it.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "common/wire/client_messages.h"

namespace slabstream {

// {"dataset", "range", "counts", "non_finite", "percentiles": {"50": value, ...}}
nlohmann::ordered_json HistogramJson(const std::string& dataset, const SummaryReply& summary);

// {"dataset", "labels": [{"value", "name", "color": "#rrggbb"}, ...]}
nlohmann::ordered_json LabelsJson(const std::string& dataset, const SummaryReply& summary);

// {"at", "inside", "voxel", "value", and, if there are such layers, "label": {"value", "name"}, "overlay"}. Null: there is none.
nlohmann::ordered_json SampleJson(const VolumeSample& sample);
// The same with "hit", and "depth"; {"hit": false} if there is none.
nlohmann::ordered_json PickJson(const PickReply& picked);

// One line.
std::string SampleText(const VolumeSample& sample);

}  // namespace slabstream
