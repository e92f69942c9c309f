#include "common/metrics/service_metrics.h"

#include <cstddef>

namespace slabstream {

void AddStageSeconds(Exposition& out, std::string_view name, std::string_view help, const StageTimes& times) {
  out.Family(name, MetricType::kCounter, help);
  for (std::size_t stage = 0; stage < times.size(); ++stage) out.Value(double(times[stage]) / 1e9, {{"stage", ToString(Stage(stage))}});
}

void AddRefused(Exposition& out, std::string_view name, std::string_view help, const RefusedRequests& refused) {
  out.Family(name, MetricType::kCounter, help);
  out.Value(refused.bad_request, {{"reason", "bad request"}});
  out.Value(refused.unknown_dataset, {{"reason", "unknown dataset"}});
  out.Value(refused.too_large, {{"reason", "too large"}});
  out.Value(refused.over_quota, {{"reason", "over quota"}});
}

}  // namespace slabstream
