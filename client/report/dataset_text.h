// Datasets of a service, as `status` and `data` show them.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "common/json/json.h"
#include "common/wire/client_messages.h"

namespace slabstream {

std::string_view NameOf(DatasetState state);  // "ready"

// "12 s", "5 min", "3.5 h", "2.1 d".
std::string AgeText(std::uint64_t milliseconds);

Json ShapeJson(const ShapeInfo& shape);
Json DatasetsJson(const std::vector<DatasetStatus>& datasets);

Json SimulationJson(const SimulationStatus& simulation);
// Its time, and a table of its parameters.
std::string SimulationText(const SimulationStatus& simulation);

// A table: a line for each dataset, and one for the heads of the columns.
std::string DatasetTableText(const std::vector<DatasetStatus>& datasets);

}  // namespace slabstream
