#include "laboratory/experiments/machines.h"

#include "common/parallel/task_arena.h"
#include "laboratory/measure/calibrate.h"

namespace slabstream {
namespace {

Json HostKey() { return {{"what", "host"}}; }

// The numbers of a MachineModel that calibration finds.
struct Found {
  const char* name;
  double& (*of)(MachineModel&);
};
constexpr Found kNumbers[] = {
    {"scan_pixel", [](MachineModel& m) -> double& { return m.combining.scan_pixel; }},
    {"encode_pixel", [](MachineModel& m) -> double& { return m.combining.encode_pixel; }},
    {"combine_pixel", [](MachineModel& m) -> double& { return m.combining.combine_pixel; }},
    {"local_pixel", [](MachineModel& m) -> double& { return m.combining.local_pixel; }},
    {"hidden_pixel", [](MachineModel& m) -> double& { return m.combining.hidden_pixel; }},
    {"wake_up_awake", [](MachineModel& m) -> double& { return m.wake_ups.awake; }},
    {"wake_up_asleep", [](MachineModel& m) -> double& { return m.wake_ups.asleep; }},
    {"latency", [](MachineModel& m) -> double& { return m.link.latency_seconds; }},
    {"plan", [](MachineModel& m) -> double& { return m.plan_seconds; }},
    {"message", [](MachineModel& m) -> double& { return m.message_seconds; }},
    {"client", [](MachineModel& m) -> double& { return m.client_seconds; }},
};

MachineModel JoinedBy(MachineModel machine, const LinkModel& link, const HostModel& host) {
  machine.message_seconds = MachineModel().message_seconds;  // over sockets; threads of one process need none
  machine.link = link;
  machine.workers_a_host = 1;
  machine.cores_a_host = host.cores;
  if (host.encrypted) {
    machine.combining.cipher_byte = calibration::service::kCipherByte;
    machine.picture = {.link_byte = 1 / link.bytes_per_second,
                       .cipher_byte = host.direct_pictures ? calibration::service::kCipherByte : calibration::service::kCurveByte,
                       .direct = host.direct_pictures};
  }
  return machine;
}

}  // namespace

Trial HostTrial() {
  const auto run = []() -> Json {
    MachineModel machine = OrThrow(CalibrateThisHost(1));
    // Between hosts pixels travel in messages, instead of being lent. Hosts have one thread for it.
    TaskArena one_thread(1);
    machine.combining = one_thread.Run([] { return MeasureCombining(ImageTransfer::kMessage); });
    Json numbers = Json::object();
    for (const Found& number : kNumbers) numbers[number.name] = number.of(machine);
    return numbers;
  };
  return {HostKey(), run, 50};
}

LinkModel Link(std::string_view preset) { return ParseLink("link", preset).value(); }

MachineModel Cluster(const ExperimentContext& context, const LinkModel& link, const HostModel& host) {
  MachineModel machine;
  for (const Found& number : kNumbers) number.of(machine) = EstimateOf(context.log(), HostKey(), number.name).median;
  return JoinedBy(machine, link, host);
}

std::vector<MachineModel> Clusters(const ExperimentContext& context, const LinkModel& link, const HostModel& host) {
  std::vector<MachineModel> machines;
  for (const Json* numbers : context.log().All(HostKey())) {
    MachineModel& machine = machines.emplace_back();
    for (const Found& number : kNumbers) number.of(machine) = numbers->at(number.name).get<double>();
    machine = JoinedBy(machine, link, host);
  }
  return machines;
}

}  // namespace slabstream
