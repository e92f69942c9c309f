#include "client/report/status_text.h"

#include <fmt/format.h>

#include "client/report/dataset_text.h"
#include "common/base/printable.h"
#include "common/transport/keys.h"
#include "common/volume/memory_budget.h"

namespace slabstream {

std::string StatusText(const StatusReply& reply) {
  const auto limit = [](std::uint64_t bytes) { return bytes == 0 ? std::string("no memory limit") : "memory limit " + MemoryText(bytes); };
  std::string text = fmt::format("coordinator  pid {}, up {:.1f} s, {} clients, {}\n", reply.pid, double(reply.uptime_ms) / 1e3,
                                 reply.clients, limit(reply.memory_bytes));
  text += fmt::format("frames       {} done, {} failed, {} running, {} queued\n", reply.frames_done, reply.frames_failed, reply.running,
                      reply.queued);
  const auto& [bad, unknown, large, quota] = reply.refused;
  text += fmt::format("requests     {} refused ({} bad, {} of unknown datasets, {} too large, {} over quota)\n",
                      bad + unknown + large + quota, bad, unknown, large, quota);
  text += fmt::format("workers      {} ({} lost so far)\n", reply.workers.size(), reply.workers_lost);
  for (const WorkerStatus& worker : reply.workers) {
    const std::string place = worker.leaving ? "leaving" : fmt::format("slot {}", worker.slot);
    text += fmt::format("  {:<4} pid {} on {}, {} threads, {}, {:.1f} MiB cached, {:.1f} MiB fetched, {} ranks rendered, {}\n",
                        worker.worker, worker.pid, worker.host, worker.threads, place, double(worker.cached_bytes) / (1 << 20),
                        double(worker.fetched_bytes) / (1 << 20), worker.rendered_ranks, limit(worker.memory_bytes));
  }
  for (const WebTraffic& of : reply.web) {
    text += fmt::format("web server   {}: {} requests ({} of them retries), {} failed, {} answered from the disk, {:.1f} MiB, {:.1f} s\n",
                        of.server, of.requests, of.retries, of.failures, of.unchanged, double(of.bytes) / (1 << 20),
                        double(of.milliseconds) / 1000);
  }
  text += fmt::format("datasets     {}\n", reply.datasets.size());
  for (const DatasetStatus& dataset : reply.datasets) {
    text += fmt::format("  {} {}", dataset.name, NameOf(dataset.state));
    const Index3& size = dataset.description.geometry.size;
    if (dataset.state == DatasetState::kReady) {
      text += fmt::format(" {} x {} x {}, ", size.x, size.y, size.z);
      if (!dataset.levels.empty()) text += fmt::format("{} levels, ", dataset.levels.size());
      text += MemoryText(dataset.memory_bytes);
    }
    if (dataset.state == DatasetState::kFailed) text += fmt::format(": {}", dataset.error);
    text += '\n';
  }
  return text;
}

std::string HeardText(const AdmittedKey& key) {
  return key.silent_ms ? fmt::format("heard {:.1f} s ago", double(*key.silent_ms) / 1e3) : "not heard since the service began";
}

std::string KeysText(const std::vector<AdmittedKey>& keys) {
  std::string text = fmt::format("keys         {}\n", keys.size());
  for (const AdmittedKey& key : keys) {
    text +=
        fmt::format("  {} {}, {}\n", key.name.empty() ? IdOfKey(key.public_key) : Printable(key.name), NameOf(key.role), HeardText(key));
  }
  return text;
}

Json KeysJson(const std::vector<AdmittedKey>& keys) {
  Json json = Json::array();
  for (const AdmittedKey& key : keys) {
    json.push_back({{"id", IdOfKey(key.public_key)},
                    {"role", NameOf(key.role)},
                    {"made", key.made},
                    {"name", key.name},
                    {"silent_ms", key.silent_ms ? Json(*key.silent_ms) : Json(nullptr)}});
  }
  return json;
}

Json StatusJson(const StatusReply& reply) {
  Json workers = Json::array(), renderers = Json::array();
  for (const WorkerStatus& worker : reply.workers) {
    workers.push_back({{"worker", worker.worker},
                       {"pid", worker.pid},
                       {"host", worker.host},
                       {"threads", worker.threads},
                       {"slot", worker.slot},
                       {"leaving", worker.leaving},
                       {"cached_bytes", worker.cached_bytes},
                       {"fetched_bytes", worker.fetched_bytes},
                       {"rendered_ranks", worker.rendered_ranks},
                       {"silent_ms", worker.silent_ms},
                       {"memory_bytes", worker.memory_bytes}});
  }
  for (const auto& [name, title, abilities, parameters] : reply.renderers) {
    renderers.push_back({{"name", name}, {"title", title}, {"abilities", abilities}, {"parameters", parameters}});
  }
  Json web = Json::array();
  for (const WebTraffic& of : reply.web) {
    web.push_back({{"server", of.server},
                   {"requests", of.requests},
                   {"retries", of.retries},
                   {"failures", of.failures},
                   {"unchanged", of.unchanged},
                   {"bytes", of.bytes},
                   {"ms", of.milliseconds}});
  }
  return {{"pid", reply.pid},
          {"uptime_ms", reply.uptime_ms},
          {"clients", reply.clients},
          {"queued", reply.queued},
          {"running", reply.running},
          {"frames_done", reply.frames_done},
          {"frames_failed", reply.frames_failed},
          {"requests_refused",
           {{"bad_request", reply.refused.bad_request},
            {"unknown_dataset", reply.refused.unknown_dataset},
            {"too_large", reply.refused.too_large},
            {"over_quota", reply.refused.over_quota}}},
          {"workers_lost", reply.workers_lost},
          {"memory_bytes", reply.memory_bytes},
          {"workers", std::move(workers)},
          {"datasets", DatasetsJson(reply.datasets)},
          {"web", std::move(web)},
          {"renderers", std::move(renderers)}};
}

}  // namespace slabstream
