// slabstream-coordinator: the service's front. It ends on SIGINT, SIGTERM or a client's order, and tells its workers to end.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <string>
#include <vector>

#include "common/base/log.h"
#include "common/base/notify_ready.h"
#include "common/base/stop_signals.h"
#include "common/base/version.h"
#include "common/cli/add_option.h"
#include "common/cli/program.h"
#include "common/kernels/simd_target.h"
#include "common/metrics/metrics_listener.h"
#include "common/transport/socket.h"
#include "common/volume/memory_budget.h"
#include "coordinator/catalogue.h"
#include "coordinator/service.h"
#include "data/open/any_volume.h"
#include "data/open/cache_option.h"
#include "data/stores/http_transfers.h"
#include "data/stores/object_cache.h"

namespace slabstream {
namespace {

Status Serve(CoordinatorOptions options, const MetricsOptions& metrics) {
  if (Status simd = LimitSimdTargetByEnvironment(); !simd.ok()) return simd;
  BlockStopSignals();
  Context context;
  auto service = CoordinatorService::Start(context, std::move(options));
  if (!service.ok()) return service.status();
  const auto listener = MetricsListener::Start(metrics, [&coordinator = **service] { return coordinator.MetricsText(); });
  if (!listener.ok()) return listener.status();
  // Whoever started this process reads the ports that were chosen from this line.
  const std::string measured = *listener == nullptr ? "" : " metrics=" + (*listener)->url();
  (void)std::printf("slabstream-coordinator ready client=%s workers=%s%s\n", (*service)->client_endpoint().c_str(),
                    (*service)->worker_endpoint().c_str(), measured.c_str());
  if (Status told = FlushOutput(); !told.ok()) return told;
  NotifyReady();
  WaitUntilStopped(**service);
  return Status::Ok();
}

int Run(int argc, char** argv) {
  CoordinatorOptions options;
  MetricsOptions metrics;
  options.client_endpoint = "tcp://127.0.0.1:7420";
  std::vector<std::string> data;
  bool compress = false;
  std::uint64_t cache = 0;

  CLI::App app("Slabstream coordinator: takes requests from clients, plans frames and streams boxes to workers.", "slabstream-coordinator");
  SetUp(app, std::string(Version()));
  app.add_option("--listen", options.client_endpoint, "Address for clients; port * takes any free port")
      ->type_name("ENDPOINT")
      ->default_str(options.client_endpoint);
  app.add_option("--worker-listen", options.worker_endpoint, "Address for workers")
      ->type_name("ENDPOINT")
      ->default_str("the next port, or the path with .workers");
  app.add_option("--voxels-listen", options.voxels_endpoint, "Address from which workers get voxels")
      ->type_name("ENDPOINT")
      ->default_str("any port, or the path with .voxels");
  app.add_option("--keys", options.keys_folder,
                 "Encrypt tcp connections with the keys in this folder; make it, with the service files client.json, worker.json and "
                 "admin.json, if it does not exist; required for addresses that are not loopback")
      ->type_name("FOLDER");
  AddRepeated(app, "--data", data, kDataHelp)->type_name("[NAME=]FILE|FOLDER");
  app.add_flag("--compress", compress,
               "Pack voxels for workers with zstd: saves time on links slower than about 300 MB/s, not within a machine");
  options.machine.memory_bytes = DefaultMemory().coordinator;
  AddParsed(app, "--memory", options.machine.memory_bytes, ParseMemoryLimit,
            "Memory limit. Datasets that no request needs are unloaded, least recently used first")
      ->type_name("SIZE")
      ->default_str(fmt::format("a quarter of this machine's memory: {}", MemoryText(options.machine.memory_bytes)));
  AddCacheOption(app, cache);
  options.surroundings.link = *ParseLink("--link", kDefaultLink);
  AddParsed(app, "--link", options.surroundings.link, ParseLink,
            "Network between hosts of workers, as NAME or NAME:MICROSECONDS,GBIT, for policies that are 'auto'" + Explained(LinkPresets()))
      ->type_name("LINK")
      ->default_str(kDefaultLink);
  AddMetricsOptions(app, metrics);
  return RunService(app, argc, argv, "coordinator", [&]() -> Status {
    SetReadMemory(options.machine.memory_bytes);  // before anything is read
    if (Status kept = KeepObjects(cache); !kept.ok()) return kept;
    FoundData found = FindData(data);
    CheckFiles(found);
    for (const std::string& line : found.complaints) LogWarning(line);
    if (!found.errors.empty()) return ReportAll(app.get_name(), found.errors);
    options.catalogue = std::move(found.datasets);
    options.folders = {found.folders.begin(), found.folders.end()};
    options.machine.log_level = LeastLogLevel();
    options.machine.web_traffic = HttpTransfers::TrafficOfProcess;
    LimitMemory(options.machine.memory_bytes);
    if (compress) options.codec = Codec::kZstd;
    return Serve(std::move(options), metrics);
  });
}

}  // namespace
}  // namespace slabstream

int main(int argc, char** argv) {
  return slabstream::RunMain("slabstream-coordinator", [&] { return slabstream::Run(argc, argv); });
}
