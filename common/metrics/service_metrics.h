// Families of metrics that several processes of a service have, each under a name of its own. `name`, `help`: as in Exposition::Family.
#pragma once

#include <cstdint>
#include <string_view>

#include "common/metrics/exposition.h"
#include "common/stats/report.h"
#include "common/wire/client_messages.h"

namespace slabstream {

void AddStageSeconds(Exposition& out, std::string_view name, std::string_view help, const StageTimes& times);    // by `stage`
void AddRefused(Exposition& out, std::string_view name, std::string_view help, const RefusedRequests& refused);  // by `reason`

// Of web servers that hold volumes.
struct WebRequests {
  std::uint64_t answered = 0;   // with bytes
  std::uint64_t unchanged = 0;  // answered without, since the disk has them
  std::uint64_t again = 0;      // after one that failed, tried once more
  std::uint64_t failed = 0;     // given up
  std::uint64_t bytes = 0;      // that came
};
void AddWebRequests(Exposition& out, std::string_view requests_name, std::string_view bytes_name,
                    const WebRequests& requests);  // by `result`

}  // namespace slabstream
