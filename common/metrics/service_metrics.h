// Families of metrics that several processes of a service have, each under a name of its own. `name`, `help`: as in Exposition::Family.
#pragma once

#include <span>
#include <string_view>

#include "common/base/web_traffic.h"
#include "common/metrics/exposition.h"
#include "common/stats/report.h"
#include "common/wire/client_messages.h"

namespace slabstream {

void AddStageSeconds(Exposition& out, std::string_view name, std::string_view help, const StageTimes& times);    // by `stage`
void AddRefused(Exposition& out, std::string_view name, std::string_view help, const RefusedRequests& refused);  // by `reason`

// Names of metrics about web servers that hold volumes, each by `server`.
struct WebTrafficNames {
  std::string_view requests, bytes, seconds;
};
void AddWebTraffic(Exposition& out, const WebTrafficNames& names, std::span<const WebTraffic> servers);

}  // namespace slabstream
