#include "client/service/gateway_state.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <stdexcept>
#include <utility>

#include "client/service/service_state.h"
#include "common/files/files.h"
#include "common/json/json.h"

namespace slabstream {
namespace {

constexpr const char* kEnding = ".gateway";  // AllStates reads .json
constexpr std::size_t kMostBytes = std::size_t{1} << 14;

}  // namespace

Status SaveGateway(const GatewayState& state) {
  const Result<std::string> directory = StateDirectory();
  if (!directory.ok()) return directory.status();
  const Json json = {{"address", state.address}, {"pid", state.pid}, {"started_unix", state.started_unix}, {"token", state.token}};
  return WritePrivateTextFile(fmt::format("{}/{}{}", *directory, state.pid, kEnding), json.dump(2) + "\n");
}

void ForgetGateway(pid_t pid) {
  std::error_code ignored;
  if (const Result<std::string> directory = StateDirectory(); directory.ok()) {
    std::filesystem::remove(fmt::format("{}/{}{}", *directory, pid, kEnding), ignored);
  }
}

std::vector<GatewayState> RunningGateways() {
  std::vector<GatewayState> states;
  for (const std::string& file : StateFiles(kEnding)) {
    const Result<std::string> text = ReadPrivateTextFile(file, kMostBytes);
    const Result<Json> json = text.ok() ? Json::Parse(*text) : Result<Json>(text.status());
    if (!json.ok()) continue;
    try {
      GatewayState state{.address = json->at("address").text(),
                         .token = json->at("token").text(),
                         .pid = json->at("pid").get<pid_t>(),
                         .started_unix = json->at("started_unix").get<double>()};
      if (IsRunning(state.pid, "slabstream-gateway")) {
        states.push_back(std::move(state));
      } else {
        ForgetGateway(state.pid);
      }
    } catch (const std::runtime_error&) {
      continue;  // damaged
    }
  }
  std::ranges::sort(states, {}, &GatewayState::started_unix);
  return states;
}

}  // namespace slabstream
