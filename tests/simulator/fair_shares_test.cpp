// Clients whose frames take long beside clients whose frames are short: the coordinator's machine and those of workers, in virtual time. A
// client gets its share of the workers' time whatever its frames are like, as long as it always asks for more.
#include <gtest/gtest.h>

#include <deque>
#include <memory>
#include <vector>

#include "simulator/simulated_service.h"
#include "tests/simulator/support.h"

namespace slabstream {
namespace {

constexpr Duration kNever = std::chrono::hours(24 * 40);

struct FramesOf {
  std::uint32_t groups = 1;
  double box_seconds = 0;  // to render a box
  double finish_seconds = 0;
  int in_flight = 1;
  const char* renderer = "zbuffer";
  double read_seconds = 0;  // until the voxels of a box are there; 0: workers keep them
  bool uneven = false;      // some boxes take four times as long, others next to nothing
};

class FairShares : private Conditions {
 public:
  FairShares(std::uint32_t workers, const std::vector<FramesOf>& clients) {
    for (const FramesOf& frames : clients) {
      clients_.push_back({.frames = frames});
      clients_.back().made =
          std::make_unique<MadeFrame>(workers, frames.groups, 64, 1, frames.box_seconds, "fan-in", FindRenderer(frames.renderer));
      FramePlan& plan = clients_.back().made->plan();
      plan.setup.dataset = DatasetId(clients_.size());
      plan.setup.halo = 0;
      plan.setup.description.geometry.size = {1, 1, std::int32_t(workers * frames.groups)};
      for (GroupPlan& group : plan.groups) {
        for (Placement& placement : group.placements) {
          const auto z = std::int32_t(placement.id);
          placement.box = {{0, 0, z}, {1, 1, z + 1}};
        }
      }
    }
    CoordinatorConfig config;
    config.epoch = 1;
    config.heartbeat = config.worker_timeout = config.client_timeout = config.worker_wait = kNever;
    config.vacancy_grace = config.stall_timeout = kNever;
    service_.StartCoordinator(std::move(config));
    for (std::uint32_t i = 0; i < workers; ++i) {
      WorkerConfig worker;
      worker.incarnation = i + 1;
      worker.register_interval = worker.chunk_timeout = kNever;
      service_.AddWorker(std::move(worker));
    }
    while (service_.next() < 1) service_.RunNext();
    for (std::size_t client = 0; client < clients_.size(); ++client) {
      for (int i = 0; i < clients_[client].frames.in_flight; ++i) Submit(client);
    }
  }

  // Runs for so long, and forgets what was before.
  void Run(double seconds) {
    for (Of& client : clients_) client.used = 0;
    for (const double end = service_.now() + seconds; service_.next() < end;) service_.RunNext();
  }
  // Seconds that workers rendered for it. A render counts when it ends.
  double UsedBy(std::size_t client) const { return clients_[client].used; }

 private:
  struct Of {
    FramesOf frames;
    std::unique_ptr<MadeFrame> made = {};
    RequestId last = 0;
    double used = 0;
  };
  static constexpr double kLatency = 200e-6;  // of a message

  static PeerToken TokenOf(std::size_t client) { return PeerToken(1000 + client); }
  Of& ClientOf(PeerToken token) { return clients_[std::size_t(token - 1000)]; }

  void Submit(std::size_t client) {
    SubmitFrame submit;
    submit.request = ++clients_[client].last;
    submit.deadline_ms = ~std::uint32_t{0};
    submit.frame.dataset = std::string(1, char('a' + client));
    submit.frame.transfer.choice = TransferFunction{};
    service_.TellCoordinator(service_.now() + kLatency, FromClient{TokenOf(client), std::move(submit)});
  }

  using Conditions::Perform;
  double SecondsOf(const StartRender& render) {
    const FramesOf& frames = ClientOf(render.client).frames;
    const double u = double(render.placement.id * 2654435761U) / 4294967296.0;
    return frames.box_seconds * (frames.uneven ? 4 * u * u * u : 1);
  }
  std::optional<WorkCost> Begin(Job& job) override {
    if (const auto* render = std::get_if<StartRender>(&job.action)) return WorkCost{SecondsOf(*render)};
    if (const auto* send = std::get_if<SendFrame>(&job.action)) return WorkCost{ClientOf(send->client).frames.finish_seconds};
    if (std::holds_alternative<StoreChunk>(job.action)) return std::nullopt;
    return WorkCost{100e-6};
  }
  WorkerEvent Answer(Job& job) override {
    if (const auto* render = std::get_if<StartRender>(&job.action)) {
      const double seconds = SecondsOf(*render);
      ClientOf(render->client).used += seconds;
      RenderDone done{.key = render->key, .rank = render->rank, .image = render->image, .status = {}, .report = {}, .box_bytes = 1};
      done.report.stage_ns[std::size_t(Stage::kRender)] = std::int64_t(1e9 * seconds);
      return done;
    }
    if (const auto* store = std::get_if<StoreChunk>(&job.action))
      return ChunkStored{store->padded, store->chunk.box, store->chunk.chunk, {}};
    if (const auto* combine = std::get_if<StartCombine>(&job.action)) return CombineDone{combine->key, combine->image, {}, {}};
    if (const auto* find = std::get_if<FindHidden>(&job.action)) return HiddenFound{find->key, find->image, {}};
    return Tick{};
  }
  void Perform(Node node, SendChunkRequest& action) override {
    const ChunkRequest& request = action.request;
    const double read = clients_[(request.dataset - 1) % clients_.size()].frames.read_seconds;
    service_.queue().At(
        service_.now() + read,
        [this, node,
         chunk = Chunk{.epoch = request.epoch, .dataset = request.dataset, .box = request.box, .chunk = request.chunk, .raw_bytes = 1}] {
          service_.StepWorker(node, MessageReceived{chunk, {}});
        });
  }
  Arrivals ToWorker(Node, CoordinatorToWorker&, double sent) override { return Arrivals::At(sent + kLatency); }
  Arrivals ToCoordinator(Node, WorkerToCoordinator& message) override {
    if (const auto* trouble = std::get_if<WorkerTrouble>(&message)) CHECK(false) << trouble->status.message();
    return Arrivals::At(service_.now() + kLatency);
  }
  Arrivals ToPeer(Node, Job&) override { return Arrivals::At(service_.now() + kLatency); }
  void Perform(ToClient& action) override {
    if (const auto* failed = std::get_if<FrameFailed>(&action.message)) ADD_FAILURE() << failed->status.message();
    if (!std::holds_alternative<FrameReply>(action.message)) return;
    service_.queue().At(service_.now() + kLatency, [this, client = std::size_t(action.to - 1000)] { Submit(client); });
  }
  void Perform(const ToDatasets& action) override {
    const auto* seek = std::get_if<SeekDataset>(&action);
    if (seek == nullptr) return;
    const auto summary = std::make_shared<const VolumeSummary>();
    service_.StepCoordinator(
        DatasetNews{.uses = {{seek->use, DatasetReady{DatasetId(seek->request->dataset.front() - 'a' + 1), summary}}}});
  }
  void Perform(const CountDataset&) override {}
  void Perform(const PlanRequest& action) override {
    Of& client = ClientOf(action.client);
    auto planned = std::make_shared<PlannedFrame>(PlannedFrame{.asked = action, .plan = client.made->plan()});
    // Voxels that are read are those of other boxes each time.
    if (client.frames.read_seconds > 0) planned->plan.setup.dataset += DatasetId(clients_.size() * action.plan);
    service_.TellCoordinator(service_.now() + kLatency, Planned{action.plan, std::shared_ptr<const PlannedFrame>(std::move(planned))});
  }

  std::deque<Of> clients_;
  const MachineModel machine_ = WithoutDelays();
  SimulatedService service_{machine_, *this};
};

// The first client's frames take a second of each worker, in one group or many; four others always want four short frames. By fair shares
// it gets a fifth of what it gets alone, where it waits for the slowest box of each group and for voxels, too.
TEST(FairShares, DoNotDependOnWhatAFrameIsLike) {
  constexpr int kOthers = 4;
  constexpr double kLeast = 0.8;  // of a fair share
  struct Case {
    std::uint32_t workers = 1;
    FramesOf frames;
    double other_seconds = 0.008;
  };
  const std::vector<Case> cases = {
      {1, {.box_seconds = 1}},
      {2, {.groups = 64, .box_seconds = 1.0 / 64}, 0.030},
      {2, {.box_seconds = 1, .uneven = true}},
      {2, {.groups = 16, .box_seconds = 1.0 / 16, .uneven = true}},
      {4, {.groups = 64, .box_seconds = 1.0 / 64, .renderer = "raycast", .uneven = true}},
      {4, {.groups = 64, .box_seconds = 1.0 / 64, .renderer = "raycast", .uneven = true}, 0.030},
      {2, {.groups = 64, .box_seconds = 1.0 / 64, .renderer = "raycast", .read_seconds = 0.05}},
      {4, {.groups = 32, .box_seconds = 1.0 / 32, .renderer = "raycast", .read_seconds = 0.05, .uneven = true}},
  };
  for (std::size_t i = 0; i < cases.size(); ++i) {
    const auto& [workers, frames, other_seconds] = cases[i];
    const auto rate = [&](int others) {
      std::vector<FramesOf> clients = {frames};
      for (int other = 0; other < others; ++other)
        clients.push_back({.box_seconds = other_seconds, .finish_seconds = 0.001, .in_flight = 4});
      FairShares shares(workers, clients);
      shares.Run(5);
      shares.Run(30);
      return shares.UsedBy(0) / 30;
    };
    const double alone = rate(0), beside = rate(kOthers);
    EXPECT_GE(beside, kLeast * alone / (kOthers + 1))
        << "case " << i << ": " << alone << " workers alone, " << beside << " beside the others";
  }
}

}  // namespace
}  // namespace slabstream
