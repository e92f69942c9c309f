// slabstream-worker: one worker process. It waits for its coordinator without a time limit. It ends on Stop, if its key is refused, and on
// SIGINT or SIGTERM after it has finished what it had begun.
#include <fmt/format.h>
#include <unistd.h>

#include <cstdlib>
#include <string>

#include "common/base/version.h"
#include "common/cli/add_option.h"
#include "common/cli/program.h"
#include "common/kernels/simd_target.h"
#include "common/memory/large_buffers.h"
#include "common/metrics/metrics_listener.h"
#include "common/service/service_file.h"
#include "common/threads/stop_signals.h"
#include "common/volume/memory_budget.h"
#include "data/open/cache_option.h"
#include "data/open/open_source.h"
#include "data/stores/http_transfers.h"
#include "data/stores/object_cache.h"
#include "worker/service/service.h"

namespace slabstream {
namespace {

Status Serve(WorkerOptions options, const MetricsOptions& metrics) {
  if (Status simd = LimitSimdTargetByEnvironment(); !simd.ok()) return simd;
  BlockStopSignals();
  Context context;
  auto service = WorkerService::Start(context, std::move(options));
  if (!service.ok()) return service.status();
  const auto listener = MetricsListener::Start(metrics, [&worker = **service] { return worker.MetricsText(); });
  if (!listener.ok()) return listener.status();
  WaitUntilStopped<WorkerService, &WorkerService::RequestLeave>(**service);
  return (*service)->ended();
}

int Run(int argc, char** argv) {
  constexpr int kMaxCacheMib = 1 << 24;  // 16 TiB
  WorkerOptions options;
  MetricsOptions metrics;
  int cache_mib = 0;
  std::uint64_t cache = 0;
  std::string compress = "auto", service;
  bool frames_only = false;
  static constexpr Duration kLongestDrain = std::chrono::hours(24);

  const Program app("Slabstream worker: renders boxes and combines images for a coordinator.", "slabstream-worker", std::string(Version()));
  const Option coordinator =
      app.AddText("--coordinator", options.coordinator_endpoint, "The coordinator's endpoint for workers, such as tcp://127.0.0.1:7421")
          .TypeName("ENDPOINT");
  app.AddText("--service", service, "The service file worker.json of a service with keys, which names the coordinator")
      .TypeName("FILE")
      .Default("$SLABSTREAM_SERVICE, if there is no --coordinator")
      .Excludes(coordinator);
  app.AddText("--listen", options.images_endpoint, "Address for images from other workers")
      .TypeName("ENDPOINT")
      .Default("any port, at the address that reaches the coordinator");
  AddInteger(app, "--threads", options.machine.threads, 1, int(kMaxThreads), "Render threads");
  options.machine.memory_bytes = DefaultMemory().worker;
  AddParsed(app, "--memory", options.machine.memory_bytes, ParseMemoryLimit,
            "Memory limit for voxels and images. The worker gets no frame that needs more")
      .TypeName("SIZE")
      .Default(fmt::format("half of this machine's memory: {}", MemoryText(options.machine.memory_bytes)));
  AddInteger(app, "--cache-mib", cache_mib, 1, kMaxCacheMib, "MiB of voxels kept between frames").Default("what --memory leaves");
  AddCacheOption(app, cache);
  AddOptionalValue(app, "--compress", compress, "on", OneOf({"auto", "on", "off"}),
                   "Pack images with zstd. auto: for workers behind links that are slower than zstd. on (--compress alone): "
                   "all images, and the pictures for clients. off: none")
      .TypeName("[=MODE]")
      .Default(compress);
  AddParsed(
      app, "--drain", options.machine.drain,
      [](const std::string& option, const std::string& text) { return ParseDuration(option, text, kLongestDrain); },
      "Time to finish begun work after SIGTERM or SIGINT. The worker gets no new work, and ends as soon as no frame needs it. 0s, or a "
      "second signal: at once")
      .TypeName("TIME")
      .Default("30s");
  app.AddFlag("--no-shared-memory", frames_only, "Send images to workers of this host over sockets, too");
  AddMetricsOptions(app, metrics);
  return RunService(app, argc, argv, "worker " + std::to_string(::getpid()), [&] {
    if (options.coordinator_endpoint.empty()) {
      const char* const variable = std::getenv("SLABSTREAM_SERVICE");
      if (service.empty() && variable != nullptr) service = variable;
      if (service.empty()) return Status::InvalidArgument("--coordinator or --service is missing");
      const Result<ServiceFile> file = ReadServiceFile(service);
      if (!file.ok()) return file.status();
      if (file->role != Role::kWorker)
        return Status::InvalidArgument(
            fmt::format("--service '{}' is of role {}, a worker needs worker.json", service, NameOf(file->role)));
      options.coordinator_endpoint = file->endpoint;
      options.keys = file->keys();
    }
    options.machine.compression = *ParseCompression(compress);
    options.machine.web_traffic = HttpTransfers::TrafficOfProcess;
    options.share_memory = !frames_only;
    options.machine.spare_for_images = [limit = options.machine.memory_bytes] { return SpareForImages(limit - KeptBytes(limit) / 2); };
    SetReadMemory(options.machine.memory_bytes);
    KeepBlocks(KeptBytes(options.machine.memory_bytes));
    if (Status kept = KeepObjects(cache); !kept.ok()) return kept;
    if (cache_mib != 0) options.machine.cache_bytes = std::uint64_t(cache_mib) << 20;
    return Serve(std::move(options), metrics);
  });
}

}  // namespace
}  // namespace slabstream

int main(int argc, char** argv) {
  slabstream::HandleStopSignals([](int) { std::_Exit(0); });
  return slabstream::RunMain("slabstream-worker", [&] { return slabstream::Run(argc, argv); });
}
