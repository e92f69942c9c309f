#include "bench/service_processes.h"

#include <fmt/format.h>
#include <unistd.h>

#include "client/service/service_state.h"
#include "common/base/check.h"
#include "common/cli/add_option.h"
#include "common/files/program_beside.h"
#include "common/volume/sphere.h"
#include "data/volume_io/volume_writer.h"

namespace slabstream {
namespace {

constexpr Duration kPatience = std::chrono::seconds(30);

std::string KeysIn(const ServiceProcessesOptions& options) { return options.directory + "/keys"; }

Child StartProgram(const ServiceProcessesOptions& options, const std::string& name, const std::vector<std::string>& arguments) {
  std::vector<std::string> command = {ProgramBeside(name).value()};
  for (const auto* list : {&arguments, &options.arguments_of_each}) command.insert(command.end(), list->begin(), list->end());
  return Child::Start({.command = std::move(command), .log_path = options.directory + "/log"}).value();
}

Child StartCoordinator(const ServiceProcessesOptions& options) {
  std::vector<std::string> arguments = {"--listen", options.listen};
  if (options.keys) arguments.insert(arguments.end(), {"--keys", KeysIn(options)});
  const auto add = [&](const std::string& name, int size) {
    const std::string file = options.directory + "/" + name + ".mha";
    CHECK(WriteVolume(MakeSphere({.sphere_class = SphereClass::kHollow, .size = size}).value(), file).ok());
    arguments.insert(arguments.end(), {"--data", name + "=" + file});
  };
  add("sphere", options.size.volume);
  if (options.other_volume > 0) add("other", options.other_volume);
  return StartProgram(options, "slabstream-coordinator", arguments);
}

}  // namespace

void AddServiceSize(const Command& app, ServiceSize& size) {
  AddInteger(app, "--volume", size.volume, 2, 1024, "Voxels a side of the sphere");
  AddInteger(app, "--workers", size.workers, 1, 64, "Workers");
  AddInteger(app, "--threads", size.threads, 1, 64, "Render threads of each worker");
}

ServiceProcesses::ServiceProcesses(const ServiceProcessesOptions& options) : coordinator_(StartCoordinator(options)) {
  const std::string line = coordinator_.ReadLine(kPatience).value();
  endpoint_ = ValueIn(line, "client");
  if (options.keys) keys_ = KeysIn(options);
  for (int i = 0; i < options.size.workers; ++i) {
    std::vector<std::string> arguments = {"--threads", std::to_string(options.size.threads)};
    if (options.keys) {
      arguments.insert(arguments.end(), {"--service", keys_ + "/worker.json"});
    } else {
      arguments.insert(arguments.end(), {"--coordinator", ValueIn(line, "workers")});
    }
    workers_.push_back(StartProgram(options, "slabstream-worker", arguments));
  }
}

ServiceProcesses::~ServiceProcesses() {
  for (Child& worker : workers_) worker.Terminate(kPatience);
  coordinator_.Terminate(kPatience);
}

Client ServiceProcesses::Connect(Context& context, bool direct_pictures) const {
  ServiceAddress address = keys_.empty() ? ServiceAddress(endpoint_) : ResolveService({.file = keys_ + "/client.json"}).value();
  address.direct_pictures = direct_pictures;
  Client client = Client::Connect(context, address).value();
  while (client.QueryStatus().value().workers.size() < workers_.size()) ::usleep(10000);
  return client;
}

std::vector<std::pair<std::string, pid_t>> ServiceProcesses::pids() const {
  std::vector<std::pair<std::string, pid_t>> pids = {{"coordinator", coordinator_.pid()}};
  for (const Child& worker : workers_) pids.emplace_back(fmt::format("worker {}", pids.size()), worker.pid());
  return pids;
}

}  // namespace slabstream
