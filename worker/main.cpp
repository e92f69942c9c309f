// slabstream-worker: one worker process. It waits for its coordinator without a time limit and ends on Stop, SIGINT or SIGTERM.
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>
#include <string>

#include "common/base/large_buffers.h"
#include "common/base/log.h"
#include "common/base/stop_signals.h"
#include "common/base/version.h"
#include "common/kernels/simd_target.h"
#include "common/transport/socket.h"
#include "worker/service.h"

namespace {

constexpr std::uint64_t kMaxCacheMib = std::uint64_t{1} << 24;  // 16 TiB

int Fail(int exit_status, const std::string& message) {
  (void)std::fprintf(stderr, "slabstream-worker: %s\n", message.c_str());
  return exit_status;
}

int Run(int argc, char** argv) {
  slabstream::WorkerOptions options;
  std::uint64_t cache_mib = 0;
  std::string compress = "auto";
  std::string log_level = "warning";

  CLI::App app("Slabstream worker: renders slabs and combines images for a coordinator.");
  app.set_version_flag("--version", std::string(slabstream::Version()));
  app.add_option("--coordinator", options.coordinator_endpoint, "the coordinator's endpoint for workers, such as tcp://127.0.0.1:7421")
      ->required();
  app.add_option("--listen", options.images_endpoint, "where other workers send partial images (default: any port beside the coordinator)");
  app.add_option("--threads", options.machine.threads, "render threads (default: 1)");
  app.add_option("--cache-mib", cache_mib, "MiB of voxels kept between frames (default: no limit)")
      ->check(CLI::Range(std::uint64_t{1}, kMaxCacheMib));
  app.add_flag(
         "--compress{on}", compress,
         "auto (default): pack images for workers behind links that are slower than zstd; on: all images, and the pictures for clients; "
         "off: none")
      ->check(CLI::IsMember({"auto", "on", "off"}));
  app.add_flag("!--no-shared-memory", options.share_memory, "send images to workers of this host in frames as well");
  app.add_option("--log-level", log_level, "debug, info, warning, error or off")->check(CLI::IsMember(slabstream::LogLevelNames()));
  try {
    app.parse(argc, argv);
  } catch (const CLI::Success& asked) {  // --help, --version
    return app.exit(asked);
  } catch (const CLI::ParseError& error) {
    return Fail(2, error.what());
  }
  options.compression = *slabstream::ParseCompression(compress);
  if (cache_mib != 0) options.machine.cache_bytes = cache_mib << 20;
  if (const auto simd = slabstream::LimitSimdTargetByEnvironment(); !simd.ok()) return Fail(2, simd.message());
  slabstream::InitLog("worker " + std::to_string(::getpid()), slabstream::LogLevelNames().at(log_level));

  slabstream::BlockStopSignals();
  slabstream::Context context;
  auto service = slabstream::WorkerService::Start(context, std::move(options));
  if (!service.ok()) return Fail(service.status().code() == slabstream::StatusCode::kInvalidArgument ? 2 : 1, service.status().message());
  slabstream::WaitUntilStopped(**service);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  slabstream::KeepFrameBuffers();
  try {
    return Run(argc, argv);
  } catch (const std::exception& error) {  // mostly out of memory: all expected errors are returned as a Status
    (void)std::fprintf(stderr, "slabstream-worker: %s\n", error.what());
    return 1;
  }
}
