// slabstream-coordinator: the service's front. It ends on SIGINT, SIGTERM or a client's order, and tells its workers to end.
#include <fmt/format.h>

#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include "common/base/log.h"
#include "common/base/notify_ready.h"
#include "common/base/version.h"
#include "common/cli/add_option.h"
#include "common/cli/program.h"
#include "common/kernels/simd_target.h"
#include "common/metrics/metrics_listener.h"
#include "common/threads/stop_signals.h"
#include "common/volume/memory_budget.h"
#include "coordinator/service/service.h"
#include "data/catalogue/catalogue.h"
#include "data/open/cache_option.h"
#include "data/open/open_source.h"
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

  const Program app("Slabstream coordinator: takes requests from clients, plans frames and streams boxes to workers.",
                    "slabstream-coordinator", std::string(Version()));
  app.AddText("--listen", options.client_endpoint, "Address for clients; port * takes any free port")
      .TypeName("ENDPOINT")
      .Default(options.client_endpoint);
  app.AddText("--worker-listen", options.worker_endpoint, "Address for workers")
      .TypeName("ENDPOINT")
      .Default("the next port, or the path with .workers");
  app.AddText("--voxels-listen", options.voxels_endpoint, "Address from which workers get voxels")
      .TypeName("ENDPOINT")
      .Default("any port, or the path with .voxels");
  app.AddText("--keys", options.keys_folder,
              "Encrypt tcp connections with the keys in this folder; make it, with the service files client.json, worker.json and "
              "admin.json, if it does not exist; required for addresses that are not loopback")
      .TypeName("FOLDER");
  AddRepeated(app, "--data", data, kDataHelp).TypeName("[NAME=]FILE|FOLDER");
  app.AddFlag("--compress", compress,
              "Pack voxels for workers with zstd: saves time on links slower than about 300 MB/s, not within a machine");
  options.machine.memory_bytes = DefaultMemory().coordinator;
  AddParsed(app, "--memory", options.machine.memory_bytes, ParseMemoryLimit,
            "Memory limit. Datasets that no request needs are unloaded, least recently used first")
      .TypeName("SIZE")
      .Default(fmt::format("a quarter of this machine's memory: {}", MemoryText(options.machine.memory_bytes)));
  AddCacheOption(app, cache);
  AddMetricsOptions(app, metrics);
  return RunService(app, argc, argv, "coordinator", [&]() -> Status {
    // Before anything is read. Voxels take three quarters (DatasetShare), so chunks get half of what they have elsewhere.
    SetReadMemory(options.machine.memory_bytes / 2);
    if (Status kept = KeepObjects(cache); !kept.ok()) return kept;
    FoundData found = FindData(data);
    CheckFiles(found);
    for (const std::string& line : found.complaints) LogWarning(line);
    if (!found.errors.empty()) return ReportAll(app.name(), found.errors);
    options.catalogue = std::move(found.datasets);
    options.folders = {found.folders.begin(), found.folders.end()};
    options.machine.log_level = LeastLogLevel();
    options.machine.web_traffic = HttpTransfers::TrafficOfProcess;
    LimitMemory(options.machine.memory_bytes / 16 * 15);  // the rest is for pictures that clients have not read
    if (compress) options.codec = Codec::kZstd;
    return Serve(std::move(options), metrics);
  });
}

}  // namespace
}  // namespace slabstream

int main(int argc, char** argv) {
  slabstream::HandleStopSignals([](int) { std::_Exit(0); });
  return slabstream::RunMain("slabstream-coordinator", [&] { return slabstream::Run(argc, argv); });
}
