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

void AddWebRequests(Exposition& out, std::string_view requests_name, std::string_view bytes_name, const WebRequests& requests) {
  out.Family(requests_name, MetricType::kCounter, "Requests of web servers for parts of volumes, by result.");
  out.Value(requests.answered, {{"result", "done"}});
  out.Value(requests.unchanged, {{"result", "unchanged"}});
  out.Value(requests.again, {{"result", "again"}});
  out.Value(requests.failed, {{"result", "failed"}});
  out.Single(bytes_name, MetricType::kCounter, "Bytes that web servers have sent for them.", requests.bytes);
}

}  // namespace slabstream
