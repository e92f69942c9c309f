#include "tests/simulator/simulation.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <string>

#include "common/renderers/registry.h"
#include "common/text/parse_number.h"

namespace slabstream {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

// Frames of several clients share the workers and end together, each after about as much time as all of them take: more than a minute
// where boxes take long and each frame keeps only one worker busy at a time.
constexpr std::uint32_t kDeadlineMs = 120000;
constexpr Duration kBound = milliseconds(kDeadlineMs) + seconds(30);  // until every request has ended, from the last one on
constexpr Duration kTroubled = seconds(5);                            // requests are made and things break in this time
constexpr Duration kOwnersTroubled = seconds(25);                     // the same where owners wait for each other, and for the silent
constexpr Duration kLongestBacklog = std::chrono::minutes(10);
constexpr RequestId kRequestAfterHealing = 1000;
constexpr Duration kSettle = seconds(14);  // long enough for every time-out of the machines below
constexpr char kFile[] = "/data/volume";
constexpr Index3 kBlock = {32, 32, 32};  // of a volume that is read in parts

}  // namespace

Simulation::Simulation(std::uint64_t seed, bool owned, Tally& tally)
    : random_(seed),
      tally_(tally),
      faults_(RandomFaults(random_)),
      current_(faults_),
      network_(random_, faults_, std::chrono::microseconds(random_.Integer(50, 5000)), tally),
      encode_messages_(random_.Chance(0.02)),
      cells_(seed, !owned),
      world_(RandomWorld(random_, faults_, cells_, owned)),
      witness_(faults_.none() && !owned, tally),
      service_(machine_, *this),
      words_(random_) {
  if (!owned) return;
  owners_.emplace(service_, random_, current_, network_, *world_.summary, tally,
                  [this](const DatasetEvent& event) { StepDatasets(event); });
}

// ---------------------------------------------------------------- the world

Node Simulation::AddNode() {
  WorkerConfig config = world_.worker_config;
  config.incarnation = random_.Integer<Incarnation>(1, std::uint64_t{1} << 62);
  workers_.emplace_back(Node(workers_.size()), config, world_.speed, current_, random_, service_, cells_, tally_);
  return service_.AddWorker(std::move(config));
}

void Simulation::AddWorker(Duration after) {
  service_.queue().After(after, [this] {
    const Node node = AddNode();
    if (random_.Chance(current_.slow)) {
      tally_.Add(Count::kSlowWorkers);
      workers_[node].SlowDown(current_.slowness);
    }
    if (random_.Chance(current_.without_memory)) {
      tally_.Add(Count::kWorkersWithoutMemory);
      workers_[node].TakeMemory();
    }
  });
}

void Simulation::AddClient() {
  clients_.push_back(
      std::make_unique<ModelClient>(service_, [this, i = clients_.size()](const ClientToFrames& message) { FromClientNode(i, message); }));
}

void Simulation::StartCoordinator() {
  CoordinatorConfig config;
  config.epoch = random_.Integer<Epoch>(1, std::uint64_t{1} << 62);
  config.voxels_endpoint = "voxels";
  config.worker_timeout = seconds(3);
  config.worker_wait = seconds(5);
  config.vacancy_grace = milliseconds(random_.Integer(500, 8000));
  config.stall_timeout = seconds(4);
  config.share_pixels = 1;  // the frames are small
  epoch_ = config.epoch;
  published_.clear();
  stored_.clear();
  planner_.emplace();
  witness_.OnRestart();
  datasets_wake_ = {};
  datasets_of_frames_.clear();
  DatasetConfig of_datasets{.folders = {"/data"}};
  if (!owners_) of_datasets.datasets = {{"volume", DataSource(kFile, "")}};
  datasets_.emplace(std::move(of_datasets));
  service_.StartCoordinator(std::move(config));
  if (owners_) owners_->StartCoordinator(epoch_, [this](const std::string& name) { return datasets_->NameIsFree(name); });
  StepDatasets(DatasetTick{});
}

void Simulation::Submit(ModelClient& client, RequestId request) {
  ++requests_made_;
  SubmitFrame submit = RandomRequest(random_, world_.policy, request, kDeadlineMs);
  if (owners_ && request != kRequestAfterHealing) submit.frame.missing = Missing(random_.Integer(1, 3));
  if (submit.frame.missing == Missing::kSkip) {
    submit.frame.policy.assignment = "owner";
    submit.frame.policy.balance = Policy().balance;
  }
  if (cells_.present() && random_.Chance(0.5)) submit.frame.renderer = DefaultRenderer(false).name();  // else the cells are drawn
  client.Submit(submit);
}

bool Simulation::Idle() const {
  return requests_made_ == requests_planned_ &&
         std::all_of(clients_.begin(), clients_.end(), [](const auto& client) { return client->idle(); });
}

bool Simulation::Working() const {
  for (Node node = 0; node < workers_.size(); ++node) {
    if (!service_.alive(node)) continue;
    for (const Lane lane : {Lane::kRender, Lane::kCombine, Lane::kFinish}) {
      if (!service_.Idle(node, lane)) return true;
    }
  }
  return false;
}

void Simulation::RunUntil(Duration from_now, bool until_idle) {
  const double end = service_.now() + std::chrono::duration<double>(from_now).count();
  while (service_.next() <= end && !testing::Test::HasFatalFailure()) {
    service_.RunNext();
    ASSERT_LT(service_.spins(), 10) << "a machine wants to be woken at once, again and again";
    if (until_idle && Idle()) return;
  }
}

void Simulation::Run() {
  tally_.Add(Count::kWorlds);
  if (cells_.present()) tally_.Add(Count::kGrids);
  if (world_.in_parts) tally_.Add(Count::kWorldsInParts);
  StartCoordinator();
  const int workers = random_.Integer(1, 8);
  for (int i = 0; i < workers; ++i) AddWorker(faults_.none() ? Duration{} : Duration(milliseconds(random_.Integer(0, 500))));
  const int clients = random_.Integer(1, 3);
  for (int i = 0; i < clients; ++i) AddClient();
  // Without faults nobody asks before all workers are there: slots, and so padded boxes, then stay as they are. Nor before the voxels are.
  const Duration first = owners_ ? Duration(seconds(2)) : faults_.none() ? Duration(milliseconds(500)) : Duration{};
  const Duration troubled = owners_ ? kOwnersTroubled : kTroubled;
  for (const auto& client : clients_) {
    const int requests = random_.Integer(1, owners_ ? 8 : 4);
    for (int r = 1; r <= requests; ++r) {
      ++requests_planned_;
      const Duration when = first + Duration(random_.Integer<std::int64_t>(0, troubled.count() / 2));
      service_.queue().After(when, [this, c = client.get(), r] {
        Submit(*c, RequestId(r));
        if (random_.Chance(faults_.cancel)) {
          service_.queue().After(milliseconds(random_.Integer(0, 1000)), [c, r] { c->Cancel(RequestId(r)); });
        }
      });
    }
  }
  PlanTroubles(kTroubled);
  if (owners_) owners_->PlanTroubles(troubled);

  RunUntil(troubled + kBound, true);
  tally_.Add(Count::kRequests, requests_planned_);
  CheckOutcome();
  Heal();
  RunUntil(troubled + kSettle, false);
  // A slow worker may have hundreds of tasks that wait, each as slow as it was when they came up.
  for (Duration waited{}; Working() && waited < kLongestBacklog; waited += seconds(1)) RunUntil(seconds(1), false);
  CheckRecovery();
  RunUntil(kSettle, false);  // the last picture may not need all voxels that owners were asked for
  if (owners_) owners_->CheckRecovered();
  CheckRest();
  tally_.virtual_seconds += service_.now();
}

// ---------------------------------------------------------------- what must hold

void Simulation::CheckOutcome() {
  EXPECT_TRUE(Idle()) << "a request has not ended in time";
  const bool only_stops = faults_.none() || (faults_.only_stops_time() && faults_.worker_pauses == 0 && faults_.coordinator_pauses == 0);
  for (const auto& client : clients_) {
    if (!client->vanished()) {
      EXPECT_EQ(client->ended().size(), client->submitted());
    }
    for (const auto& [request, ended] : client->ended()) {
      const StatusCode code = ended.status.code();
      if (code == StatusCode::kOk) {
        tally_.Add(Count::kPictures);
        if (ended.statistics.attempts > 1) tally_.Add(Count::kRetriedPictures);
        if (faults_.gentle() && ended.statistics.attempts > 1) tally_.Add(Count::kHandedOver);
        if (only_stops && (!owners_ || owners_->calm())) {
          EXPECT_EQ(ended.statistics.attempts, 1U);
        }
        continue;
      }
      const bool of_store = ended.status.message().find(kFile) != std::string::npos;
      const bool of_owners = owners_ && ended.status.message().find("volume") != std::string::npos;
      tally_.Add(of_owners                                ? Count::kErrorsOfOwners
                 : of_store                               ? Count::kErrorsOfStores
                 : ended.given_up                         ? Count::kGivenUp
                 : code == StatusCode::kCancelled         ? Count::kCancelled
                 : code == StatusCode::kDeadlineExceeded  ? Count::kErrorsOfDeadline
                 : code == StatusCode::kResourceExhausted ? Count::kErrorsOfMemory
                 : code == StatusCode::kUnavailable       ? Count::kErrorsOfWorkers
                                                          : Count::kErrors);
      const bool out_of_time = code == StatusCode::kDeadlineExceeded && faults_.clock_jumps > 0;
      const bool stood_still = ended.given_up && faults_.coordinator_pauses + faults_.suspensions > 0;
      // Three workers that are killed by chance may have had the same box of a frame.
      const bool died_alike = faults_.worker_kills + 2 * faults_.preemptions >= 3 &&
                              ended.status.message().find("as two workers before it") != std::string::npos;
      // Reads may take long, and the word that they fail may be lost.
      const bool stalled = ended.status.message().find("no progress") != std::string::npos;
      const bool replaced = (of_store || (stalled && world_.in_parts)) && faults_.file_changes > 0;
      const bool excused = !faults_.harmless() || (owners_ && !owners_->calm()) || replaced || workerless_ || out_of_time || stood_still ||
                           died_alike || client->cancelled().count(request) > 0;
      EXPECT_TRUE(excused) << "a frame failed although there was a worker all the time: " << ended.status.message();
      EXPECT_FALSE(ended.status.message().empty());
      if (faults_.only_stores()) {
        const bool never_opened = owners_ && code == StatusCode::kDeadlineExceeded;
        EXPECT_TRUE(of_store || of_owners || stalled || never_opened) << ended.status.message();
      }
      EXPECT_TRUE(code != StatusCode::kInternal && code != StatusCode::kInvalidArgument) << ended.status.message();
      if (code == StatusCode::kCancelled) {
        EXPECT_EQ(client->cancelled().count(request), 1U) << "cancelled, but not by the client";
      }
    }
  }
}

// Whatever happened before: the clients that are left, and a new one, get their pictures at once.
void Simulation::CheckRecovery() {
  if (Staying().empty()) {
    AddWorker({});
    RunUntil(seconds(1), false);
  }
  AddClient();
  for (const auto& client : clients_) {
    if (client->vanished()) continue;
    ++requests_planned_;
    tally_.Add(Count::kRequestsAfterHealing);
    Submit(*client, kRequestAfterHealing);
  }
  RunUntil(kBound, true);
  for (const auto& client : clients_) {
    if (client->vanished()) continue;
    const auto ended = client->ended().find(kRequestAfterHealing);
    ASSERT_TRUE(ended != client->ended().end()) << "no picture after the world has healed";
    // The owners were so slow that the service expects too much of the next frames.
    if (owners_ && ended->second.status.message().find("too much to do") != std::string::npos) continue;
    EXPECT_TRUE(ended->second.status.ok()) << "after the world has healed: " << ended->second.status.message();
    EXPECT_EQ(ended->second.statistics.attempts, ended->second.status.ok() ? 1U : 0U);
    EXPECT_EQ(ended->second.statistics.missing, "");
  }
}

// Once all owners have left, or are silent, the dataset is gone, and nothing is left of them.
void Simulation::CheckOwnersLeft() {
  owners_->LeaveAll();
  RunUntil(kOwnerTimeout + seconds(3), false);
  const OwnerSizes sizes = owners_->sizes();
  EXPECT_EQ(sizes.fields + sizes.owners + sizes.out + sizes.waiting + sizes.uses, 0U);
  EXPECT_TRUE(datasets_->NameIsFree("volume").ok()) << "a dataset without owners";
  EXPECT_EQ(published_.size(), 0U);
}

// After a while without work and faults, nothing is left of any frame; then the service goes down.
void Simulation::CheckRest() {
  ASSERT_TRUE(service_.coordinator_runs());
  CheckTables();
  if (owners_) CheckOwnersLeft();
  const PeerToken monitor = TokenOfClient(clients_.size());
  service_.StepCoordinator(FromClient{monitor, StatusQuery{1}});
  ASSERT_TRUE(status_.has_value());
  EXPECT_EQ(status_->queued, 0U);
  EXPECT_EQ(status_->running, 0U);
  service_.StepCoordinator(FromClient{monitor, ShutDown{2}});
  EXPECT_FALSE(service_.coordinator_runs());
  RunUntil(seconds(1), false);
  for (Node node = 0; node < workers_.size(); ++node) EXPECT_TRUE(!service_.alive(node) || workers_[node].stopped()) << node;
}

void Simulation::CheckTables() {
  std::size_t registered = 0;
  for (Node node = 0; node < workers_.size(); ++node) {
    if (!service_.alive(node) || workers_[node].stopped()) continue;
    ++registered;
    EXPECT_EQ(workers_[node].images(), 0U) << node;
    EXPECT_TRUE(service_.worker(node).registered()) << node;
    const WorkerSizes sizes = service_.worker(node).sizes();
    EXPECT_EQ(sizes.frames, 0U) << node;
    EXPECT_EQ(sizes.cancelled, 0U) << node;
    EXPECT_EQ(sizes.early_images, 0U) << node;
    EXPECT_EQ(sizes.renders, 0U) << node;
    EXPECT_EQ(sizes.chunk_requests, 0U) << node;
    EXPECT_EQ(sizes.boxes, workers_[node].boxes()) << node;
  }
  const FrameSizes sizes = service_.coordinator().sizes();
  const DatasetSizes of_datasets = datasets_->sizes();
  const std::pair<const char*, std::size_t> none_left[] = {{"clients", sizes.clients},           {"queued", sizes.queued},
                                                           {"running", sizes.running},           {"over", sizes.over},
                                                           {"planning", sizes.planning},         {"counting", sizes.counting},
                                                           {"uses", of_datasets.uses},           {"orders", of_datasets.orders},
                                                           {"awaited", of_datasets.awaited},     {"retired", of_datasets.retired},
                                                           {"questions", of_datasets.questions}, {"uploads", of_datasets.uploads}};
  for (const auto& [what, count] : none_left) EXPECT_EQ(count, 0U) << what;
  EXPECT_LE(sizes.grids, OccupancyTable::kMaxKept);
  EXPECT_EQ(stored_.size(), 0U) << "memory of a volume whose client has gone";
  EXPECT_EQ(sizes.workers, registered);
  EXPECT_EQ(sizes.slots, registered);
}

// ---------------------------------------------------------------- the coordinator

void Simulation::StepDatasets(const DatasetEvent& event) {
  if (!service_.coordinator_runs()) return;
  if (service_.now() < service_.coordinator_held()) return TellDatasets(service_.coordinator_held(), event);
  // Voxels are served from just before the machine hears of them, as BackgroundActions has it.
  if (const auto* loaded = std::get_if<DatasetLoaded>(&event)) published_.insert(loaded->dataset);
  for (DatasetAction& action : datasets_->Step(event, service_.coordinator_time())) {
    std::visit([this](auto& each) { Perform(each); }, action);
  }
  const Time wake = datasets_->NextWake();
  if (wake == std::exchange(datasets_wake_, wake) || wake == Time::max()) return;
  const std::chrono::duration<double> rest = wake - service_.coordinator_time();
  TellDatasets(service_.now() + rest.count(), DatasetTick{});
}

void Simulation::TellDatasets(double when, DatasetEvent event) {
  service_.queue().At(when, [this, epoch = epoch_, event = std::move(event)] {
    if (epoch == epoch_) StepDatasets(event);
  });
}

void Simulation::AskDatasets(PeerToken client, const ClientToDatasets& message, const Bytes& payload) {
  service_.StepCoordinator(ClientHeard{client, std::holds_alternative<AddVolume>(message)});
  StepDatasets(ClientAsked{client, message, payload});
}

void Simulation::Perform(ToClient& action) {
  if (const auto* reply = std::get_if<FrameReply>(&action.message)) {
    const auto* from_worker = std::get_if<FromWorker>(cause_);
    const auto* image = from_worker == nullptr ? nullptr : std::get_if<FrameImage>(&from_worker->message);
    if (image != nullptr) witness_.OnPicture(*image, action.payload, *reply);
    if (image != nullptr && owners_) CheckOwned(*reply, image->frame, action.to);
  }
  if (const auto* status = std::get_if<StatusReply>(&action.message)) status_ = *status;
  if (const auto* credit = std::get_if<VolumeCredit>(&action.message); credit != nullptr && action.to == Admin()) {
    service_.queue().After(milliseconds(random_.Integer(1, 200)), [this, granted = *credit] { SendParts(granted); });
  }
  for (std::size_t client = 0; client < clients_.size(); ++client) {
    if (action.to != TokenOfClient(client)) continue;
    const Arrivals arrivals = network_.Send({kCoordinatorEnd, kClientEnds + int(client)}, service_.now());
    for (int i = 0; i < arrivals.count; ++i) {
      service_.queue().At(arrivals.times[i], [c = clients_[client].get(), message = OnTheWay(action.message)] { c->Deliver(message); });
    }
  }
}

void Simulation::CheckOwned(const FrameReply& reply, FrameId frame, PeerToken to) {
  if (reply.groups_done != reply.group_count) return;  // a preview
  for (std::size_t client = 0; client < clients_.size(); ++client) {
    const SubmitFrame* const asked = to == TokenOfClient(client) ? clients_[client]->Find(reply.request) : nullptr;
    if (asked != nullptr) owners_->CheckPicture(datasets_of_frames_.at(frame), asked->frame.missing, reply.statistics.missing);
  }
}

WorkerEvent Simulation::Answer(Job& job) {
  const auto* render = std::get_if<StartRender>(&job.action);
  if (render != nullptr && faults_.gentle() && !hurried_ && (!owners_ || owners_->calm())) {
    EXPECT_TRUE(rendered_.emplace(render->key.frame, render->placement.id).second) << "a box is rendered twice";
  }
  return workers_[job.node].Answer(job);
}

void Simulation::Perform(const UnloadDataset& action) {
  published_.erase(action.dataset);
  if (owners_) owners_->Unload(action.dataset);
}

void Simulation::Perform(const LoadDataset& action) {
  if (owners_ && action.source.open) return owners_->Load(action);
  const double when = service_.now() + random_.Real(0.001, 0.3);
  if (random_.Chance(current_.fail_load)) {
    return TellDatasets(when, DatasetFailed{action.name, action.load, Status::NotFound("the file of the volume is gone")});
  }
  if (voxels_ > 1) tally_.Add(Count::kReadAnew);
  const auto stamp = std::make_shared<const FileStamp>(FileStamp{{action.source.path}, voxels_});
  auto summary = std::make_shared<VolumeSummary>(*world_.summary);
  if (world_.in_parts) summary->stored = StoredAt{.source = kFile, .level = 0, .version = voxels_, .block = {{0, 0, 0}, kBlock}};
  TellDatasets(when, DatasetLoaded{action.name, action.load, voxels_, std::move(summary), 0, stamp});
}

void Simulation::Perform(const CheckDatasetFiles& action) {
  if (owners_ && action.stamp->ask) {
    const double when = service_.now() + random_.Real(0, faults_.none() ? 200e-6 : 0.1);
    return service_.queue().At(when, [this, epoch = epoch_, action] {
      if (epoch == epoch_) StepDatasets(DatasetSeen{action.name, action.load, HaveChanged(*action.stamp, service_.coordinator_time())});
    });
  }
  DatasetSeen seen{action.name, action.load, action.stamp->digest != voxels_};
  if (random_.Chance(current_.fail_load / 5)) seen.changed = Status::NotFound("the file of the volume is gone");
  TellDatasets(service_.now() + random_.Real(0, faults_.none() ? 200e-6 : 0.1), seen);
}

// A file of another name comes and goes.
void Simulation::Perform(const CheckWatchedFolders& action) {
  FoldersSeen seen;
  for (const std::string& folder : action.folders) {
    FoundData found;
    if (random_.Chance(0.5)) found.datasets["other"] = DataSource(folder + "/other", folder);
    const bool fails = random_.Chance(current_.fail_load);
    seen.folders.emplace(folder, fails ? Result<FoundData>(Status::Unavailable("cannot read the folder")) : Result<FoundData>(found));
  }
  TellDatasets(service_.now() + random_.Real(0, 0.1), seen);
}

void Simulation::Perform(const FindDatasets& action) {
  DatasetsFound answer{action.order, Status::NotFound("no such file")};
  if (random_.Chance(0.7)) {
    FoundData found;
    for (const std::string& name : action.arguments) found.datasets[name] = DataSource("/data/" + name, "");
    answer.found = std::move(found);
  }
  TellDatasets(service_.now() + random_.Real(0, 0.1), answer);
}

// Whatever was asked: late, and perhaps to nobody who still waits.
void Simulation::Perform(const AnswerQuestion& action) {
  QuestionAnswered answered{action.id, QuestionReply(SampleReply{.nonce = NonceOf(action.question)})};
  if (random_.Chance(current_.fail_load)) answered.answer = Status::ResourceExhausted("not enough memory to answer");
  TellDatasets(service_.now() + random_.Real(0, 0.1), answered);
}

void Simulation::Perform(const BeginUpload& action) {
  EXPECT_TRUE(stored_.emplace(action.upload, Stored{0, BytesToSend(action.order)}).second);
  UploadBegun begun{action.upload, Status::Ok()};
  if (random_.Chance(current_.fail_load)) begun.status = Status::ResourceExhausted("not enough memory for a volume");
  TellDatasets(service_.now() + random_.Real(0, 0.1), begun);
}

void Simulation::Perform(const StoreUpload& action) {
  ASSERT_TRUE(stored_.contains(action.upload));
  EXPECT_EQ(action.begin, stored_.at(action.upload).bytes) << "bytes are stored in order";
  stored_.at(action.upload).bytes += action.bytes.size();
}

void Simulation::Perform(const FinishUpload& action) {
  const Stored whole = stored_.extract(action.upload).mapped();
  EXPECT_EQ(whole.bytes, whole.expected) << "a volume is whole when it ends";
  tally_.Add(Count::kVolumesSent);
  UploadFinished finished{action.upload, Status::InvalidArgument("a label that there is not")};
  if (!random_.Chance(current_.fail_load)) {
    DataSource source("/sent", "");
    source.held_bytes = 1;
    finished.source = source;
  }
  TellDatasets(service_.now() + random_.Real(0, 0.1), finished);
}

void Simulation::Perform(const CountDataset& action) {
  tally_.Add(Count::kCountsOfVoxels);
  OccupiedCounted counted{action.count, world_.occupied};
  if (random_.Chance(current_.fail_load)) counted.grid = Status::ResourceExhausted("not enough memory to count");
  // Once, or twice, and with news of a count that nobody asked for.
  const int times = faults_.none() ? 1 : random_.Integer(1, 2);
  for (int i = 0; i < times; ++i) {
    const double when = service_.now() + random_.Real(0.001, 0.3);
    if (i == 1) service_.TellCoordinator(when, OccupiedCounted{counted.count + 1000000, world_.occupied});
    service_.TellCoordinator(when, counted);
  }
}

// Plans come late, and not always in the order in which they were asked for.
void Simulation::Perform(const PlanRequest& action) {
  Planned planned{action.plan, planner_->Plan(action)};
  if (world_.shapes && planned.frame.ok()) {
    auto with_shape = std::make_shared<PlannedFrame>(**planned.frame);
    FramePlan& plan = with_shape->plan;
    plan.setup.shapes.resize(1);
    plan.setup.shapes[0].bytes = {kShapeDataset, {.geometry = {{100, 1, 1}}, .type = TypeOf(kShapeDataset)}};
    plan.tiles = PlanTiles(plan);
    planned.frame = std::shared_ptr<const PlannedFrame>(std::move(with_shape));
  }
  if (random_.Chance(current_.fail_load / 5)) planned.frame = Status::ResourceExhausted("not enough memory to plan");
  service_.TellCoordinator(service_.now() + random_.Real(0, faults_.none() ? 200e-6 : 0.1), std::move(planned));
}

// ---------------------------------------------------------------- messages

template <class Messages>
Messages Simulation::OnTheWay(const Messages& message) const {
  if (!encode_messages_) return message;
  const Result<AnyMessage> decoded = Decode(Encode(message));
  EXPECT_TRUE(decoded.ok()) << NameOf(message) << ": " << decoded.status().message();
  if (!decoded.ok()) return message;
  return std::visit(
      [&]<class Message>(const Message& each) {
        if constexpr (std::constructible_from<Messages, Message>) return Messages(each);
        return message;
      },
      *decoded);
}

Arrivals Simulation::ToWorker(Node to, CoordinatorToWorker& message, double sent) {
  if (const auto* assignment = std::get_if<GroupAssignment>(&message)) {
    witness_.OnAssignment(*assignment, workers_.size(), most_teams_);
    EXPECT_TRUE(published_.contains(assignment->setup.dataset)) << "a group of voxels that are not there any more";
    if (owners_) datasets_of_frames_[assignment->key.frame] = assignment->setup.dataset;
    if (assignment->setup.dataset != voxels_ && !owners_) tally_.Add(Count::kFramesOfRetiredVoxels);
  }
  if (const auto* ping = std::get_if<Ping>(&message)) witness_.OnPing(*ping);
  if (std::holds_alternative<Retire>(message)) tally_.Add(Count::kRetired);
  if (const auto peer = hostile_peers_.find(to); peer != hostile_peers_.end()) return HearAsHostile(peer->second, message);
  if (told_dead_.contains(to)) return {.nobody = true};
  message = OnTheWay(message);
  return network_.Send({kCoordinatorEnd, int(to)}, sent);
}

Arrivals Simulation::ToCoordinator(Node from, WorkerToCoordinator& message) {
  if (IsHostile(from) && !hostile_peers_.at(from).worker) return {};
  if (const auto* done = std::get_if<GroupDone>(&message); done != nullptr && done->epoch == epoch_) witness_.OnGroupDone(*done);
  if (const auto* trouble = std::get_if<WorkerTrouble>(&message)) {
    tally_.Add(Count::kTroubles);
    if (trouble->elsewhere) tally_.Add(Count::kTroublesElsewhere);
    if (trouble->unreachable != 0) tally_.Add(Count::kComplaints);
  }
  if (const auto told = leaving_.find(from); told != leaving_.end() && std::holds_alternative<Leave>(message)) {
    const std::chrono::duration<double> drain = world_.worker_config.drain;
    hurried_ = hurried_ || service_.now() >= told->second + drain.count();
  }
  words_.Overhear(message);
  message = OnTheWay(message);
  return network_.Send({int(from), kCoordinatorEnd}, service_.now());
}

Arrivals Simulation::ToPeer(Node to, Job& sends) {
  if (told_dead_.contains(to) && random_.Chance(0.3)) return {.nobody = true};
  PartialImage& image = std::get<SendPartial>(sends.action).message;
  words_.Overhear(image, sends.payload ? *sends.payload : Bytes());
  image = std::get<PartialImage>(OnTheWay(WorkerToWorker(image)));
  return network_.Send({int(sends.node), int(to)}, service_.now());
}

void Simulation::Perform(Node node, const DrawTiles& action) {
  tally_.Add(Count::kTilesDrawn);
  service_.queue().At(service_.now() + random_.Real(0, world_.speed.render), [this, node, action] {
    if (!service_.alive(node)) return;
    for (const DrawTiles::For& receiver : action.receivers) {
      const ShapeTiles tiles = {.epoch = action.epoch,
                                .from_worker = action.from,
                                .key = action.key,
                                .tiles = receiver.tiles,
                                .bytes = std::vector<std::uint32_t>(receiver.tiles.size())};
      const auto message = Widen<MessageToWorker>(OnTheWay(WorkerToWorker(tiles)));
      const Node to = ParseNumber<Node>(receiver.to.images_endpoint).value();
      const Arrivals arrivals = network_.Send({int(node), int(to)}, service_.now());
      for (int i = 0; i < arrivals.count; ++i) {
        service_.queue().At(arrivals.times[i], [this, to, message] { service_.StepWorker(to, MessageReceived{message, {}}); });
      }
    }
    service_.StepWorker(node, TilesDrawn{action.key, {Stage::kRender, 0, 1}});
  });
}

void Simulation::Perform(Node node, SendChunkRequest& action) {
  workers_[node].OnRequest(action.request);
  if (action.stored != nullptr && !owners_ && ReadsItself(node, *action.stored)) {
    tally_.Add(Count::kOwnReads);
    const std::optional<double> seconds = SecondsToRead();
    if (!seconds) return;
    service_.queue().At(service_.now() + *seconds, [this, node, request = action.request] {
      service_.StepWorker(node, MessageReceived{Widen<MessageToWorker>(ReadOf(request)), {}});
    });
    return;
  }
  const auto request = std::get<ChunkRequest>(OnTheWay(WorkerToVoxels(action.request)));
  const Arrivals asked = network_.Send({int(node), kVoxelServerEnd}, service_.now());
  for (int i = 0; i < asked.count; ++i) {
    const std::optional<double> seconds = world_.in_parts ? SecondsToRead() : 0;
    if (!seconds) continue;
    service_.queue().At(asked.times[i] + *seconds, [this, node, request] {
      if (!service_.coordinator_runs() || request.epoch != epoch_) return;
      if (!owners_ || !published_.contains(request.dataset)) return SendVoxels(node, AnswerOf(request));
      owners_->Read(request, [this, node](const VoxelsToWorker& answer) { SendVoxels(node, answer); });
    });
  }
}

void Simulation::SendVoxels(Node node, const VoxelsToWorker& voxels) {
  const auto answer = Widen<MessageToWorker>(OnTheWay(voxels));
  const Arrivals answered = network_.Send({kVoxelServerEnd, int(node)}, service_.now());
  for (int i = 0; i < answered.count; ++i) {
    service_.queue().At(answered.times[i], [this, node, answer] { service_.StepWorker(node, MessageReceived{answer, {}}); });
  }
}

// A worker sees the file or does not, and needs a while to find out. One that opens it after it was replaced finds another one.
bool Simulation::ReadsItself(Node node, const StoredAt& stored) {
  const auto [place, is_new] = places_.try_emplace({node, stored.version});
  if (is_new && random_.Chance(0.7) && stored.version == voxels_) place->second = service_.now() + random_.Real(0.001, 0.5);
  return place->second && service_.now() >= *place->second;
}

std::optional<double> Simulation::SecondsToRead() {
  if (random_.Chance(current_.lost_read)) {
    tally_.Add(Count::kLostReads);
    return std::nullopt;
  }
  if (!random_.Chance(current_.slow_read)) return random_.Real(10e-6, 5e-3);
  tally_.Add(Count::kSlowReads);
  return random_.Real(0.1, 5);
}

// What a read gives of a file that holds the voxels that are asked for, or held them.
VoxelsToWorker Simulation::ReadOf(const ChunkRequest& request) {
  const auto refused = [&](Count count, Status why) {
    tally_.Add(count);
    return ChunkRefused{request.epoch, request.dataset, request.box, request.chunk, std::move(why)};
  };
  if (request.dataset != voxels_) {
    return refused(Count::kReadsOfOtherFiles, Status::Unavailable(std::string(kFile) + ": has changed since it was opened"));
  }
  if (random_.Chance(current_.fail_read)) {
    return refused(Count::kFailedReads, Status::Unavailable(std::string(kFile) + ": cannot be read: Input/output error"));
  }
  const std::size_t block = NumberIn(world_.summary->brick_counts, request.box.begin / kBrick);
  if (double(block * 7919 % 1000) < 1000 * current_.bad_blocks) {
    return refused(Count::kBadBlocks, Status::DataLoss(std::string(kFile) + ": a block is damaged"));
  }
  return ChunkOf(request);
}

VoxelsToWorker Simulation::AnswerOf(const ChunkRequest& request) {
  if (request.dataset == kShapeDataset) return ChunkOf(request);
  if (!published_.contains(request.dataset)) {
    return ChunkRefused{request.epoch, request.dataset, request.box, request.chunk, Status::NotFound("no such dataset")};
  }
  return world_.in_parts ? ReadOf(request) : ChunkOf(request);
}

Chunk Simulation::ChunkOf(const ChunkRequest& request) {
  Chunk chunk;
  chunk.epoch = request.epoch;
  chunk.dataset = request.dataset;
  chunk.box = request.box;
  chunk.chunk = request.chunk;
  if (IsCellChunk(request.chunk)) {
    chunk.cell_bytes = cells_.BytesOf(request.dataset, request.box);
    EXPECT_LT(request.chunk - kFirstCellChunk, CellChunkCount(chunk.cell_bytes)) << "a chunk of cells that there is not";
    chunk.raw_bytes = BytesOfCellChunk(chunk.cell_bytes, request.chunk);
  } else {
    chunk.raw_bytes = PartOfChunk(request.box, TypeOf(request.dataset), request.chunk).bytes;
  }
  chunk.encoded_bytes = chunk.raw_bytes;
  return chunk;
}

PeerToken Simulation::TokenOfClient(std::size_t client) const { return service_.TokenOf(Node(kClientEnds + int(client))); }

void Simulation::FromClientNode(std::size_t client, const ClientToFrames& message) {
  const Arrivals arrivals = network_.Send({kClientEnds + int(client), kCoordinatorEnd}, service_.now());
  for (int i = 0; i < arrivals.count; ++i) {
    service_.queue().At(arrivals.times[i], [this, client, message = OnTheWay(message)] {
      service_.StepCoordinator(FromClient{TokenOfClient(client), message, "10.0.0.1"});
    });
  }
}

}  // namespace slabstream
