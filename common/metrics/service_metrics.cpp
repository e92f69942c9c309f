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

void AddWebTraffic(Exposition& out, const WebTrafficNames& names, std::span<const WebTraffic> servers) {
  out.Family(names.requests, MetricType::kCounter, "Requests of web servers for parts of volumes, by result and server.");
  for (const WebTraffic& of : servers) {
    out.Value(of.answered(), {{"result", "done"}, {"server", of.server}});
    out.Value(of.unchanged, {{"result", "unchanged"}, {"server", of.server}});
    out.Value(of.retries, {{"result", "again"}, {"server", of.server}});
    out.Value(of.failures, {{"result", "failed"}, {"server", of.server}});
  }
  out.Family(names.bytes, MetricType::kCounter, "Bytes that web servers have sent for them.");
  for (const WebTraffic& of : servers) out.Value(of.bytes, {{"server", of.server}});
  out.Family(names.seconds, MetricType::kCounter, "Time of these requests; those that ran at a time count each.");
  for (const WebTraffic& of : servers) out.Value(double(of.milliseconds) / 1000, {{"server", of.server}});
}

}  // namespace slabstream
