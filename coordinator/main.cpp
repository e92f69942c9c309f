// slabstream-coordinator: the service's front. It ends on SIGINT, SIGTERM or a client's order, and tells its workers to end.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <string>
#include <vector>

#include "common/base/background_tasks.h"
#include "common/base/large_buffers.h"
#include "common/base/log.h"
#include "common/base/stop_signals.h"
#include "common/base/version.h"
#include "common/transport/socket.h"
#include "coordinator/catalogue.h"
#include "coordinator/service.h"

namespace {

int Fail(const slabstream::Status& status) {
  (void)std::fprintf(stderr, "slabstream-coordinator: %s\n", status.message().c_str());
  const bool bad_input = status.code() == slabstream::StatusCode::kInvalidArgument || status.code() == slabstream::StatusCode::kNotFound;
  return bad_input ? 2 : 1;
}

int Run(int argc, char** argv) {
  slabstream::CoordinatorOptions options;
  options.client_endpoint = "tcp://127.0.0.1:7420";
  std::vector<std::string> data;
  bool compress = false;
  std::string link = slabstream::kDefaultLink;
  std::string log_level = "warning";

  CLI::App app("Slabstream coordinator: takes requests from clients, plans frames and streams slabs to workers.");
  app.set_version_flag("--version", std::string(slabstream::Version()));
  app.add_option("--listen", options.client_endpoint, "for clients (default tcp://127.0.0.1:7420; port * is any)");
  app.add_option("--worker-listen", options.worker_endpoint, "for workers (default: the next port, or the path with .workers)");
  app.add_option("--slabs-listen", options.slabs_endpoint, "for voxels (default: any port, or the path with .slabs)");
  app.add_option("--data", data, "a volume as NAME=PATH, or a directory of volumes; any number of times")->allow_extra_args(false);
  app.add_flag("--compress", compress, "pack voxels for workers with zstd: pays on links slower than about 300 MB/s, not within a machine");
  std::string links = "Between workers of different hosts, as NAME or NAME:MICROSECONDS,GBIT, for policies that are 'auto'";
  for (const slabstream::LinkPreset& preset : slabstream::LinkPresets()) {
    links += "\n  " + std::string(preset.name) + ": " + std::string(preset.purpose);
  }
  app.add_option("--link", link, links)->type_name("LINK")->default_str(link);
  app.add_option("--log-level", log_level, "debug, info, warning, error or off")->check(CLI::IsMember(slabstream::LogLevelNames()));
  try {
    app.parse(argc, argv);
  } catch (const CLI::Success& asked) {  // --help, --version
    return app.exit(asked);
  } catch (const CLI::ParseError& error) {
    return Fail(slabstream::Status::InvalidArgument(error.what()));
  }
  const auto parsed_link = slabstream::ParseLink("--link", link);
  if (!parsed_link.ok()) return Fail(parsed_link.status());
  options.surroundings.link = *parsed_link;
  auto catalogue = slabstream::MakeCatalogue(data);
  if (!catalogue.ok()) return Fail(catalogue.status());
  options.catalogue = std::move(*catalogue);
  if (compress) options.codec = slabstream::Codec::kZstd;
  slabstream::InitLog("coordinator", slabstream::LogLevelNames().at(log_level));

  slabstream::BlockStopSignals();
  slabstream::Context context;
  auto service = slabstream::CoordinatorService::Start(context, std::move(options));
  if (!service.ok()) return Fail(service.status());
  // Whoever started this process reads the ports that were chosen from this line.
  (void)std::printf("slabstream-coordinator ready client=%s workers=%s\n", (*service)->client_endpoint().c_str(),
                    (*service)->worker_endpoint().c_str());
  (void)std::fflush(stdout);
  slabstream::WaitUntilStopped(**service);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  slabstream::KeepFrameBuffers();
  int exit_status = 1;
  try {
    exit_status = Run(argc, argv);
  } catch (const std::exception& error) {  // out of memory, mostly: everything that is expected comes back as a Status
    (void)std::fprintf(stderr, "slabstream-coordinator: %s\n", error.what());
  }
  if (slabstream::BackgroundTasks::AnyRunning()) std::_Exit(exit_status);  // a load that takes long does not keep the process
  return exit_status;
}
