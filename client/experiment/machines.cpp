#include "client/experiment/machines.h"

#include <tbb/task_arena.h>

#include "client/lab/calibrate.h"
#include "client/lab/combining_costs.h"
#include "client/lab/neighbours.h"
#include "common/base/check.h"

namespace slabstream {
namespace {

Json HostKey(int workers) { return {{"what", "host"}, {"workers", workers}}; }
Json NeighbourKey(const FrameCase& frame) { return PictureKey("neighbours", frame); }

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
    {"hand_over_awake", [](MachineModel& m) -> double& { return m.hand_overs.awake; }},
    {"hand_over_asleep", [](MachineModel& m) -> double& { return m.hand_overs.asleep; }},
    {"latency", [](MachineModel& m) -> double& { return m.link.latency_seconds; }},
    {"plan", [](MachineModel& m) -> double& { return m.plan_seconds; }},
    {"message", [](MachineModel& m) -> double& { return m.message_seconds; }},
    {"client", [](MachineModel& m) -> double& { return m.client_seconds; }},
};

}  // namespace

Trial HostTrial(int workers) {
  const auto run = [workers]() -> Result<Json> {
    const Result<Calibration> calibration = CalibrateThisHost(workers);
    if (!calibration.ok()) return calibration.status();
    MachineModel machine = calibration->machine;
    Json numbers = {{"cores", machine.cores_a_host}};
    for (const Found& number : kNumbers) numbers[number.name] = number.of(machine);
    // Between hosts pixels travel in messages, where workers of one host lend them to each other.
    // Hosts of a cluster have one thread for it.
    tbb::task_arena one_thread(1);
    machine.combining = one_thread.execute([] { return MeasureCombining(Transfer::kMessage); });
    for (const Found& number : kNumbers) numbers[std::string("between_hosts_") + number.name] = number.of(machine);
    return numbers;
  };
  return {HostKey(workers), run, 50};
}

Trial NeighbourTrial(ExperimentContext& context, const FrameCase& frame) {
  const auto run = [&context, frame]() -> Result<Json> {
    const Result<VolumeInUse> volume = context.volumes().Get(frame.volume);
    if (!volume.ok()) return volume.status();
    const Result<FramePlan> plan = PlanOf(context, frame);
    if (!plan.ok()) return plan.status();
    return Json{{"slowdown", ModelSlowdown(MeasureSlowdown(*volume->volume, plan->setup).median)}};
  };
  return {NeighbourKey(frame), run, 10};
}

MachineModel ThisMachine(const ExperimentContext& context, const FrameCase& frame) {
  const Json key = HostKey(frame.workers);
  MachineModel machine;
  for (const Found& number : kNumbers) number.of(machine) = EstimateOf(context.log(), key, number.name).median;
  machine.link.contention = Contention::kNone;  // within a process workers lend each other their pixels
  machine.combining.rgba_bytes = machine.combining.depth_bytes = 0;
  machine.combining.lent = true;
  machine.link.bytes_per_second = 1e12;
  machine.workers_a_host = frame.workers;
  machine.cores_a_host = int(EstimateOf(context.log(), key, "cores").median);
  machine.picture_threads = std::min(machine.workers_a_host, machine.cores_a_host);
  machine.memory_slowdown = EstimateOf(context.log(), NeighbourKey(frame), "slowdown").median;
  return machine;
}

LinkModel Link(std::string_view preset) {
  const Result<LinkModel> link = ParseLink("link", preset);
  CHECK(link.ok()) << link.status().message();
  return *link;
}

MachineModel Cluster(const ExperimentContext& context, const LinkModel& link) {
  MachineModel machine;
  for (const Found& number : kNumbers)
    number.of(machine) = EstimateOf(context.log(), HostKey(1), std::string("between_hosts_") + number.name).median;
  machine.message_seconds = MachineModel().message_seconds;  // over sockets, which threads of a process do without
  machine.link = link;
  machine.workers_a_host = 1;
  machine.cores_a_host = kCoresAHost;
  return machine;
}

MachineModel PaperMachine(const ExperimentContext& context, double frame_seconds, double pixels) {
  // For N = 200 and p = 10 ... 30 centralised combining takes about 0.20 s an image (table 2 less the other stages of table 5), of which
  // compositing takes 0.117 s (table 5, p = 1: 32 % of 72.89 s for 200 slices). Writing and reading it takes the rest.
  constexpr double kImageShare = 0.083 / 72.89;
  MachineModel machine = Cluster(context, Link("pvs"));
  machine.link.bytes_per_second = pixels * machine.combining.rgba_bytes / (kImageShare * frame_seconds);
  machine.plan_seconds = machine.message_seconds = machine.client_seconds = 0;
  machine.cores_a_host = 1;  // its workers were single processors
  machine.hand_overs = {.awake = 0, .asleep = 0};
  machine.combining.hidden_pixel = 0;
  return machine;
}

}  // namespace slabstream
