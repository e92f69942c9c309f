// Families of metrics that several processes of a service have, each under a name of its own. `name`, `help`: as in Exposition::Family.
#pragma once

#include <string_view>

#include "common/metrics/exposition.h"
#include "common/stats/report.h"
#include "common/wire/client_messages.h"

namespace slabstream {

void AddStageSeconds(Exposition& out, std::string_view name, std::string_view help, const StageTimes& times);    // by `stage`
void AddRefused(Exposition& out, std::string_view name, std::string_view help, const RefusedRequests& refused);  // by `reason`

}  // namespace slabstream
