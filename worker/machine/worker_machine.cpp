#include "worker/machine/worker_machine.h"

#include <fmt/format.h>

#include <map>
#include <utility>

#include "common/planning/frame_occlusion.h"
#include "common/planning/worker_memory.h"
#include "common/volume/memory_budget.h"
#include "worker/machine/box_fetcher.h"
#include "worker/machine/early_messages.h"
#include "worker/machine/frame_accumulator.h"
#include "worker/machine/group_run.h"
#include "worker/machine/peer_links.h"
#include "worker/machine/render_queue.h"

namespace slabstream {

namespace {

constexpr Duration kMeasure = std::chrono::milliseconds(100);

// Among all that the assignment names; null: it names none such.
const Peer* PeerIn(const GroupAssignment& assignment, WorkerId worker) {
  for (const auto* peers : {&assignment.peers, &assignment.others}) {
    const auto found = std::ranges::find(*peers, worker, &Peer::worker);
    if (found != peers->end()) return &*found;
  }
  return nullptr;
}

}  // namespace

struct WorkerMachine::State {
  explicit State(WorkerConfig c)
      : config(std::move(c)),
        incarnation(config.incarnation),
        boxes(config),
        renders(boxes, names),
        early_images(EarlyImageBytes(config)),
        early_tiles(EarlyImageBytes(config)),
        links(config) {}

  // They are images of groups, which have room.
  static std::uint64_t EarlyImageBytes(const WorkerConfig& config) {
    return config.memory_bytes == 0 ? config.early_image_bytes : std::min(config.early_image_bytes, config.memory_bytes / 2);
  }

  // One frame, at the latest known attempt. A group without a run is over here: done, failed, or not needed.
  struct Frame {
    ClientId client = 0;
    std::uint32_t attempt = 0;
    std::map<std::uint32_t, std::optional<GroupRun>> groups;
    std::map<WorkerId, std::uint32_t> met;        // workers of groups that are over here, and the last such group
    std::optional<FrameAccumulator> accumulator;  // display worker
    // Of a picture with shapes: what its accumulator, and drawing for others, await. Acquired.
    std::vector<BoxFetcher::Generation> shapes = {}, lights = {};
    std::optional<DrawTiles> to_draw = {};         // without its boxes
    std::shared_ptr<const FrameSetup> setup = {};  // null: no tiles are shared

    bool AwaitsShapes() const { return to_draw || (accumulator && accumulator->AwaitsShapes()); }

    std::vector<BoxFetcher::Generation> boxes() const {
      std::vector<BoxFetcher::Generation> all = shapes;
      all.insert(all.end(), lights.begin(), lights.end());
      return all;
    }
    // Memory of images, if this worker's memory is limited: of its largest group, of its picture, and of shapes.
    std::uint64_t group_bytes = 0, picture_bytes = 0, shared_bytes = 0, tile_bytes = 0;
  };

  // ---- input from the coordinator and the executor. `actions` and `now` are those of the running Step.
  void On(MessageReceived&& event) {
    std::visit([&](auto& message) { On(std::move(message), event.payload); }, event.message);
  }
  void On(const ImageUnreadable& unreadable) {
    if (worker == 0 || unreadable.image.epoch == epoch) links.Refuse(unreadable.image, actions);  // it may have overtaken the Welcome
  }
  void On(const ChunkStored& stored) { boxes.OnStored(stored, now); }
  void On(const RenderDone& done);
  void On(const CombineDone& done);
  void On(const HiddenFound& found);
  void On(const TilesDrawn& drawn);
  void On(const SendFailed& failed);
  void On(const PartialSent& sent) { links.On(sent, now); }
  void On(const PeerUnreachable& peer);
  void On(const Moved& moved);
  void On(const LeaveRequested&);
  void On(const StopRequested&);
  void On(const Tick&) {}

  void On(const Welcome& welcome, const Bytes&);
  void On(const Ping& ping, const Bytes&);
  void On(GroupAssignment&& assignment, const Bytes&);
  void On(const Retire&, const Bytes&);
  void On(const Stop& stop, const Bytes&);
  void On(const Chunk& chunk, const Bytes& payload);
  void On(const ChunkRefused& refused, const Bytes&);
  void On(PartialImage&& partial, const Bytes& payload);
  void On(ShapeTiles&& tiles, const Bytes& payload);
  void On(const ImageReceived& received, const Bytes&) {
    if (received.epoch == epoch) links.On(received, now);
  }
  void On(const ImageRefused& refused, const Bytes&) {
    if (refused.epoch == epoch) links.On(refused, actions);
  }

  // ---- registration
  bool Heard(Epoch from);  // false: not from the coordinator that this worker is registered with
  void Unregister();
  void End();
  void KeepTime();

  // ---- frames
  bool Over(FrameId frame) const { return frame < finished_before || cancelled.count(frame) > 0; }
  void FinishBefore(FrameId frame);
  void DropFrame(FrameId id);
  void BeginAttempt(FrameId id, Frame& frame, const GroupAssignment& assignment);
  GroupRun* FindRun(const GroupKey& key);
  void AfterRun(GroupRun& run);  // ends the run if it failed or is finished: `run` is then gone
  void EndRun(GroupKey key);
  void EndRuns(const Frame& frame);
  void CheckAccumulator(FrameId id, Frame& frame);
  void AcquireShapes(FrameId id, Frame& frame, const FrameSetup& setup);
  void ShareTiles(Frame& frame, const GroupAssignment& assignment, const std::shared_ptr<const FrameSetup>& setup);
  void TakeTiles(const Frame& frame, ShapeTiles&& tiles, const Bytes& payload);
  void ForgetEarly(auto&& over);  // over(GroupKey, Epoch)
  void GiveShapes();              // to those that await them
  void Trouble(const GroupKey& key, Status status, WorkerId unreachable = 0);
  void Tend();  // what is due, and what voxels and renderings need
  void Measure();
  std::uint64_t RoomForVoxels() const;
  Time NextWake() const;
  void FailGroup(const GroupKey& key, const Status& status);
  void ReportFetchFailures();

  WorkerConfig config;
  Incarnation incarnation;  // of the current registration
  SlotPlace place;          // that a coordinator gave it last
  Duration heartbeat{}, timeout{};
  Time next_heartbeat;
  Time next_register = Time::min();
  Time next_measure = Time::min();
  std::optional<std::int64_t> measured;  // what is left for voxels and images, as it was measured last
  std::uint32_t rendered_ranks = 0;
  std::optional<Time> leave_by;  // it is leaving
  bool ended = false;
  ImageNames names;
  BoxFetcher boxes;
  RenderQueue renders;
  EarlyMessages<PartialImage> early_images;
  EarlyMessages<ShapeTiles> early_tiles;
  PeerLinks links;

  // All that most steps need.
  Epoch epoch = 0;                 // while registered
  WorkerId worker = 0;             // 0: unregistered
  bool brief = false;              // this Step has only to do with images: voxels, renderings and the coordinator are as they were
  GroupRun* latest_run = nullptr;  // that was found; null if it has ended
  Time last_heard;
  Time wake = NextWake();  // as of the last Step
  Time now;
  WorkerActions actions;
  std::map<FrameId, Frame> frames;
  FrameId finished_before = 0;
  std::set<FrameId> cancelled;  // not below finished_before
};

// ---------------------------------------------------------------- registration

bool WorkerMachine::State::Heard(Epoch from) {
  if (worker == 0 || from != epoch) return false;
  last_heard = now;
  return true;
}

void WorkerMachine::State::On(const Welcome& welcome, const Bytes&) {
  if (worker != 0 || ended || welcome.incarnation != incarnation) return;  // already registered, or an answer to an earlier registration
  epoch = welcome.epoch;
  worker = welcome.worker;
  heartbeat = std::chrono::milliseconds(welcome.heartbeat_ms);
  timeout = std::chrono::milliseconds(welcome.timeout_ms);
  last_heard = now;
  next_heartbeat = now;
  ForgetEarly([&](const GroupKey&, Epoch of) { return of != epoch; });
  links.Begin(epoch, worker, actions);
  actions.push_back(ConnectVoxels{welcome.voxels_endpoint});
}

void WorkerMachine::State::On(const Retire&, const Bytes&) {
  if (worker != 0) Unregister();  // also if it comes from another epoch: then this worker's coordinator is gone
}

void WorkerMachine::State::On(const Stop& stop, const Bytes&) {
  if (worker == 0 || stop.epoch == epoch) End();
}

// Others know this worker by its endpoint, so it is another one from now on.
void WorkerMachine::State::On(const Moved& moved) {
  config.images_endpoint = moved.images_endpoint;
  if (worker != 0) Unregister();
}

void WorkerMachine::State::On(const LeaveRequested&) {
  if (leave_by) return;
  leave_by = now + config.drain;
  next_heartbeat = now;
}

void WorkerMachine::State::On(const StopRequested&) {
  if (worker != 0) actions.push_back(SendControl{Leave{epoch, worker}});
  End();
}

void WorkerMachine::State::Unregister() {
  while (!frames.empty()) DropFrame(frames.begin()->first);
  ForgetEarly([](const GroupKey&, Epoch) { return true; });
  finished_before = 0;
  cancelled.clear();
  boxes.ForgetRequests();
  worker = 0;
  epoch = 0;
  ++incarnation;
  next_register = now;
}

void WorkerMachine::State::End() {
  if (ended) return;
  Unregister();
  ended = true;
  actions.push_back(StopProcess{rendered_ranks});
}

void WorkerMachine::State::KeepTime() {
  if (worker != 0 && now >= last_heard + timeout) Unregister();
  // Without its coordinator it has nothing to do, and will get nothing.
  if (leave_by && (worker == 0 || now >= *leave_by)) return On(StopRequested{});
  if (worker == 0 && now >= next_register) {
    actions.push_back(SendControl{Register{incarnation, config.pid, config.host, config.images_endpoint, config.threads,
                                           config.memory_bytes, config.memory_scope, config.lends_memory, config.images_key, place}});
    next_register = now + config.register_interval;
  }
  if (worker != 0 && now >= next_heartbeat) {
    actions.push_back(SendControl{Heartbeat{.epoch = epoch,
                                            .incarnation = incarnation,
                                            .worker = worker,
                                            .cached_bytes = boxes.cached_bytes(),
                                            .fetched_bytes = boxes.fetched_bytes(),
                                            .rendered_ranks = rendered_ranks,
                                            .leaving = leave_by.has_value(),
                                            .web = config.web_traffic ? config.web_traffic() : std::vector<WebTraffic>()}});
    next_heartbeat = now + heartbeat;
  }
}

// ---------------------------------------------------------------- frames and groups

void WorkerMachine::State::On(const Ping& ping, const Bytes&) {
  if (!Heard(ping.epoch)) return;
  place = ping.place;
  links.Gone(ping.gone, actions);
  actions.push_back(ForgetGroups{.finished_before = ping.finished_before, .cancelled = ping.cancelled});
  for (const FrameId frame : ping.cancelled) {
    if (frame < finished_before) continue;
    cancelled.insert(frame);
    DropFrame(frame);
  }
  FinishBefore(ping.finished_before);
}

void WorkerMachine::State::FinishBefore(FrameId frame) {
  finished_before = std::max(finished_before, frame);
  while (!frames.empty() && frames.begin()->first < finished_before) DropFrame(frames.begin()->first);
  cancelled.erase(cancelled.begin(), cancelled.lower_bound(finished_before));
  ForgetEarly([&](const GroupKey& key, Epoch) { return Over(key.frame); });
}

void WorkerMachine::State::ForgetEarly(auto&& over) {
  const auto forget = [&](const auto& message) { return over(message.key, message.epoch); };
  early_images.Forget(forget);
  early_tiles.Forget(forget);
}

void WorkerMachine::State::DropFrame(FrameId id) {
  const auto found = frames.find(id);
  if (found == frames.end()) return;
  EndRuns(found->second);
  if (found->second.accumulator) found->second.accumulator->Drop(actions);
  for (const BoxFetcher::Generation box : found->second.boxes()) boxes.Release(box);
  renders.ForgetTiles(id);
  frames.erase(found);
}

void WorkerMachine::State::AcquireShapes(FrameId id, Frame& frame, const FrameSetup& setup) {
  if (!frame.shapes.empty()) return;
  const auto acquire = [&](const CoarserLevel& volume) {
    return boxes.Acquire({frame.client, id}, volume.dataset, volume.description.geometry.bounds(), volume.description.type, volume.stored,
                         {}, actions);
  };
  for (const ShapeSetup& shape : setup.shapes) frame.shapes.push_back(acquire(shape.bytes));
  if (frame.shapes.empty()) return;
  for (const CoarserLevel* const light : LightVolumesOf(setup)) frame.lights.push_back(acquire(*light));
}

// Workers of one process share what they draw anyway.
void WorkerMachine::State::ShareTiles(Frame& frame, const GroupAssignment& assignment, const std::shared_ptr<const FrameSetup>& setup) {
  if (assignment.tiles.empty() || config.images_endpoint.starts_with("inproc://")) return;
  frame.setup = setup;
  const std::vector<WorkerId> displays = DisplaysOf(assignment.group, assignment.display);
  std::set<WorkerId> awaited;
  DrawTiles draw = {.client = assignment.client, .epoch = epoch, .from = worker, .key = assignment.key, .setup = setup};
  for (const TileOrder& order : assignment.tiles) {
    if (order.to == worker) awaited.insert(order.from);
    const Peer* const to = order.from == worker ? PeerIn(assignment, order.to) : nullptr;
    if (to == nullptr) continue;
    const bool colors = std::ranges::find(displays, order.to) != displays.end();
    draw.receivers.push_back({*to, order.tiles, colors});
  }
  if (!draw.receivers.empty()) frame.to_draw = std::move(draw);
  renders.AwaitTiles(assignment.key.frame, std::move(awaited), now + config.tile_patience);
  for (auto& [tiles, payload] : early_tiles.Take(assignment.key.frame)) TakeTiles(frame, std::move(tiles), payload);
}

void WorkerMachine::State::TakeTiles(const Frame& frame, ShapeTiles&& tiles, const Bytes& payload) {
  if (tiles.key.attempt != frame.attempt) return;
  renders.TilesCame(tiles.key.frame, tiles.from_worker);
  actions.push_back(KeepTiles{frame.setup, std::move(tiles), payload});
}

void WorkerMachine::State::GiveShapes() {
  for (auto& [id, frame] : frames) {
    if (!frame.AwaitsShapes()) continue;
    if (!std::ranges::all_of(frame.boxes(), [this](BoxFetcher::Generation box) { return boxes.complete(box); })) continue;
    const auto keys = [this](const std::vector<BoxFetcher::Generation>& of) {
      std::vector<BoxKey> result;
      for (const BoxFetcher::Generation box : of) result.push_back(boxes.key(box));
      return result;
    };
    const FrameAccumulator::ShapeBoxes shapes = {keys(frame.shapes), keys(frame.lights)};
    if (frame.to_draw) {
      frame.to_draw->shapes = shapes.shapes;
      frame.to_draw->lights = shapes.lights;
      actions.push_back(*std::exchange(frame.to_draw, std::nullopt));
    }
    if (frame.accumulator && frame.accumulator->AwaitsShapes()) frame.accumulator->SetShapes(shapes, now, actions);
  }
}

void WorkerMachine::State::On(GroupAssignment&& assignment, const Bytes&) {
  if (!Heard(assignment.epoch)) return;
  FinishBefore(assignment.finished_before);
  const GroupKey key = assignment.key;
  links.Name(assignment.peers, actions);
  links.Name(assignment.others, actions);
  if (Over(key.frame)) return;
  Frame& frame = frames[key.frame];
  if (key.attempt < frame.attempt) return;
  frame.client = assignment.client;
  if (key.attempt > frame.attempt) BeginAttempt(key.frame, frame, assignment);
  const auto [entry, added] = frame.groups.try_emplace(key.group);
  if (!added) return;
  actions.push_back(ForgetGroups{.finished_before = assignment.finished_before, .next = {key.frame, key.attempt, assignment.groups_done}});
  if (config.memory_bytes != 0) {
    frame.group_bytes = std::max(frame.group_bytes, GroupImageBytes(assignment.setup, assignment.group.placements));
    frame.picture_bytes = PictureBytes(assignment.setup);
    frame.shared_bytes = SharedBytes(assignment.setup);
    frame.tile_bytes = TileBytes(assignment.setup);
  }

  AcquireShapes(key.frame, frame, assignment.setup);
  if (const std::optional<std::size_t> share = ShareOf(assignment.group, assignment.display, worker)) {
    if (!frame.accumulator) frame.accumulator.emplace(assignment, worker, *share, names, config.preview_interval);
    if (frame.accumulator->groups_done() < assignment.first_group) {
      return Trouble(key, Status::DataLoss(fmt::format("the display worker holds {} groups of the frame, expected {}",
                                                       frame.accumulator->groups_done(), assignment.first_group)));
    }
    if (frame.accumulator->Has(key.group)) return frame.accumulator->Confirm(key.group, actions);
  }

  const auto setup = std::make_shared<const FrameSetup>(assignment.setup);
  const OcclusionMask accumulated = assignment.hidden;
  ShareTiles(frame, assignment, setup);
  assignment.tiles.clear();
  assignment.others.clear();
  GroupRun& run = entry->second.emplace(std::move(assignment), worker, names);
  for (const Rank rank : run.ranks()) {
    if (!run.failure().ok()) break;
    const Placement& placement = run.placement(rank);
    const auto hidden = std::make_shared<const OcclusionMask>(Union(accumulated, MaskBefore(placement.box, *setup)));
    // Voxels that are read in parts are not read for a box outside the picture.
    const bool outside = StoredOf(*setup, placement.level) && ReachOf(placement.box, *setup).empty();
    if (outside || HidesBox(*hidden, placement.box, *setup)) {
      run.LeaveOut(rank, {.worker = worker, .group = key.group, .rank = rank, .box = placement.id}, actions);
      ++rendered_ranks;
    } else {
      renders.Add(run.client(), key, rank, placement, setup, hidden, now, actions);
    }
  }
  for (auto& [partial, payload] : early_images.Take(key)) run.OnPartial(std::move(partial), payload, actions);
  AfterRun(run);
}

void WorkerMachine::State::BeginAttempt(FrameId id, Frame& frame, const GroupAssignment& assignment) {
  EndRuns(frame);
  frame.groups.clear();
  frame.met.clear();
  frame.to_draw.reset();
  frame.setup.reset();
  renders.ForgetTiles(id);
  frame.attempt = assignment.key.attempt;
  ForgetEarly([&](const GroupKey& key, Epoch) { return key.frame == id && key.attempt < frame.attempt; });
  if (!frame.accumulator) return;
  // Others may have lost their shares, and need what this worker rendered of them.
  const bool divided = frame.accumulator->share_count() > 1 || assignment.group.schedule.roots.size() > 1;
  if (assignment.display == worker && !divided) {
    frame.accumulator->SetAttempt(frame.attempt);
  } else {
    frame.accumulator->Drop(actions);
    frame.accumulator.reset();
  }
}

void WorkerMachine::State::On(PartialImage&& partial, const Bytes& payload) {
  // Once the coordinator has admitted this worker, others send it images, and these may overtake the Welcome.
  if (worker == 0) return (void)early_images.Keep(std::move(partial), payload, now);
  if (partial.epoch != epoch) return;
  links.Acknowledge(partial, payload.size(), actions);
  if (GroupRun* run = FindRun(partial.key)) {
    run->OnPartial(std::move(partial), payload, actions);
    return AfterRun(*run);
  }
  if (Over(partial.key.frame)) return;
  const auto frame = frames.find(partial.key.frame);
  if (frame != frames.end()) {
    if (partial.key.attempt < frame->second.attempt) return;
    if (partial.key.attempt == frame->second.attempt && frame->second.groups.contains(partial.key.group)) return;  // over
  }
  const GroupKey key = partial.key;
  if (const Status kept = early_images.Keep(std::move(partial), payload, now); !kept.ok()) Trouble(key, kept);
}

void WorkerMachine::State::On(ShapeTiles&& tiles, const Bytes& payload) {
  if (worker != 0 && (tiles.epoch != epoch || Over(tiles.key.frame))) return;
  const auto frame = frames.find(tiles.key.frame);
  if (frame != frames.end() && frame->second.setup != nullptr) return TakeTiles(frame->second, std::move(tiles), payload);
  if (frame != frames.end() && tiles.key.attempt < frame->second.attempt) return;
  (void)early_tiles.Keep(std::move(tiles), payload, now);  // without them, the tiles are drawn here
}

void WorkerMachine::State::On(const TilesDrawn& drawn) {
  const auto frame = frames.find(drawn.key.frame);
  if (frame != frames.end()) renders.Charge(frame->second.client, Duration(drawn.span.end_ns - drawn.span.begin_ns));
}

void WorkerMachine::State::On(const RenderDone& done) {
  std::optional<RankReport> report = renders.Finish(done, worker, now, actions);
  if (!report) return;
  if (!done.status.ok()) return FailGroup(done.key, done.status);
  ++rendered_ranks;
  GroupRun* run = FindRun(done.key);
  run->OnRendered(done.rank, done.image, std::move(*report), actions);
  AfterRun(*run);
}

void WorkerMachine::State::On(const CombineDone& done) {
  const auto frame = frames.find(done.key.frame);
  if (frame == frames.end()) return;
  renders.Charge(frame->second.client, Duration(done.span.end_ns - done.span.begin_ns));
  if (GroupRun* run = FindRun(done.key); run != nullptr && run->OnCombined(done, actions)) return AfterRun(*run);
  if (!frame->second.accumulator) return;
  if (frame->second.accumulator->OnCombined(done, now, actions)) CheckAccumulator(frame->first, frame->second);
}

void WorkerMachine::State::On(const HiddenFound& found) {
  const auto frame = frames.find(found.key.frame);
  if (frame != frames.end() && frame->second.accumulator) frame->second.accumulator->OnHiddenFound(found, now, actions);
}

void WorkerMachine::State::On(const SendFailed& failed) {
  const auto frame = frames.find(failed.key.frame);
  if (frame != frames.end() && frame->second.attempt == failed.key.attempt) FailGroup(failed.key, failed.status);
}

void WorkerMachine::State::On(const PeerUnreachable& peer) {
  for (const auto& [id, frame] : frames) {
    std::optional<std::uint32_t> last;  // the last group that may lack an image
    if (const auto met = frame.met.find(peer.worker); met != frame.met.end()) last = met->second;
    for (const auto& [group, run] : frame.groups) {
      if (run && run->HasPeer(peer.worker)) last = std::max(last.value_or(0), group);
    }
    if (last) {
      Trouble({id, frame.attempt, *last}, Status::Unavailable(fmt::format("worker {} cannot be reached", peer.worker)), peer.worker);
    }
  }
}

GroupRun* WorkerMachine::State::FindRun(const GroupKey& key) {
  if (latest_run != nullptr && latest_run->key() == key) return latest_run;
  const auto frame = frames.find(key.frame);
  if (frame == frames.end() || frame->second.attempt != key.attempt) return nullptr;
  const auto group = frame->second.groups.find(key.group);
  return group == frame->second.groups.end() || !group->second ? nullptr : latest_run = &*group->second;
}

void WorkerMachine::State::AfterRun(GroupRun& run) {
  const GroupKey key = run.key();
  if (!run.failure().ok()) return FailGroup(key, Status(run.failure()));
  std::optional<GroupImage> image = run.TakeGroupImage();
  if (run.finished()) EndRun(key);
  if (!image) return;
  Frame& frame = frames.at(key.frame);
  frame.accumulator->Add(std::move(*image), now, actions);
  CheckAccumulator(key.frame, frame);
}

// Ends the run, done or not. Late messages of its group are then ignored.
void WorkerMachine::State::EndRun(GroupKey key) {
  brief = false;
  latest_run = nullptr;
  renders.DropGroup(key, now, actions);
  Frame& frame = frames.at(key.frame);
  std::optional<GroupRun>& run = frame.groups.at(key.group);
  for (const Peer& peer : run->peers()) {
    std::uint32_t& last = frame.met[peer.worker];
    last = std::max(last, key.group);
  }
  run->Drop(actions);
  run.reset();
}

void WorkerMachine::State::EndRuns(const Frame& frame) {
  for (const auto& [group, run] : frame.groups) {
    if (run) EndRun(run->key());
  }
}

void WorkerMachine::State::CheckAccumulator(FrameId id, Frame& frame) {
  if (frame.accumulator->failure().ok()) return;
  Trouble({id, frame.attempt, frame.accumulator->groups_done()}, frame.accumulator->failure());
  frame.accumulator->Drop(actions);
  frame.accumulator.reset();
  EndRuns(frame);
}

void WorkerMachine::State::FailGroup(const GroupKey& key, const Status& status) {
  Trouble(key, status);
  if (FindRun(key) != nullptr) EndRun(key);
}

void WorkerMachine::State::Trouble(const GroupKey& key, Status status, WorkerId unreachable) {
  // Resources missing here, or errors here, need not occur on another worker.
  const bool elsewhere = status.code() == StatusCode::kResourceExhausted || status.code() == StatusCode::kInternal;
  actions.push_back(SendControl{WorkerTrouble{epoch, worker, key, unreachable, std::move(status), elsewhere}});
}

// ---------------------------------------------------------------- voxels

void WorkerMachine::State::On(const Chunk& chunk, const Bytes& payload) {
  if (Heard(chunk.epoch)) boxes.OnChunk(chunk, payload, actions);
}

void WorkerMachine::State::On(const ChunkRefused& refused, const Bytes&) {
  if (Heard(refused.epoch)) boxes.OnRefused(refused);
}

void WorkerMachine::State::ReportFetchFailures() {
  for (const BoxFetcher::Failure& failure : boxes.TakeFailures()) {
    for (const GroupKey& key : renders.GroupsOn(failure.padded)) FailGroup(key, failure.status);
    for (const auto& [id, frame] : frames) {
      if (!frame.accumulator || std::ranges::count(frame.boxes(), failure.padded) == 0) continue;
      FailGroup({id, frame.attempt, frame.accumulator->groups_done()}, failure.status);
    }
  }
}

// ---------------------------------------------------------------- the machine

WorkerMachine::WorkerMachine(WorkerConfig config) : state_(std::make_unique<State>(std::move(config))) {}
WorkerMachine::~WorkerMachine() = default;
WorkerMachine::WorkerMachine(WorkerMachine&&) noexcept = default;

WorkerActions WorkerMachine::Step(WorkerEvent&& event, Time now, WorkerActions memory) {
  State& s = *state_;
  memory.clear();
  s.actions = std::move(memory);
  s.now = now;
  if (s.worker != 0 && now > s.wake) s.last_heard += now - s.wake;
  const auto* message = std::get_if<MessageReceived>(&event);
  s.brief = now < s.wake && (message != nullptr ? std::holds_alternative<PartialImage>(message->message)
                                                : std::holds_alternative<CombineDone>(event) || std::holds_alternative<PartialSent>(event));
  std::visit([&](auto& e) { s.On(std::move(e)); }, event);
  if (!s.brief) s.Tend();
  for (WorkerAction& action : s.actions) {
    if (auto* send = std::get_if<SendPartial>(&action)) s.links.Deliver(*send, now);
  }
  return std::exchange(s.actions, {});
}

void WorkerMachine::State::Tend() {
  boxes.ExpireRequests(now);
  if (config.spare_for_images && now >= next_measure) Measure();
  if (config.memory_bytes != 0) boxes.SetRoom(RoomForVoxels());
  early_images.ForgetBefore(now - config.early_image_patience);
  early_tiles.ForgetBefore(now - config.early_image_patience);
  ReportFetchFailures();
  if (!ended) KeepTime();
  if (worker != 0) {
    GiveShapes();
    auto [by_client, of_next] = renders.BoxesInTurn();
    const bool renders_none = by_client.empty();
    for (const auto& [id, frame] : frames) {
      if (frame.AwaitsShapes()) by_client.push_back(frame.boxes());
    }
    if (renders_none && !by_client.empty()) of_next = by_client.front().size();
    boxes.RequestChunks(by_client, renders.AnyPaused() ? 0 : of_next, epoch, worker, now, actions);
    renders.StartNext(now, actions);
  }
  boxes.Trim(actions);
  wake = NextWake();
}

// The formula does not count everything: caches of renderers, holes in heaps, memory of other workers. What it leaves out takes room from
// voxels. Until the next look it counts as the same: what is dropped may be given back to the system only later.
void WorkerMachine::State::Measure() {
  measured = std::int64_t(boxes.HeldBytes()) + config.spare_for_images();
  next_measure = now + kMeasure;
}

// What the images of the present frames leave of memory_bytes.
std::uint64_t WorkerMachine::State::RoomForVoxels() const {
  const std::uint64_t others = IdleMemoryBytes(config.memory_bytes) + (boxes.reads_stored() ? SourceBytes(config.memory_bytes) : 0);
  std::uint64_t taken = 0, light = 0;  // frames share the light
  for (const auto& [id, frame] : frames) {
    light = std::max(light, frame.shared_bytes);
    const auto runs = std::ranges::count_if(frame.groups, [](const auto& group) { return group.second.has_value(); });
    taken += frame.group_bytes * std::uint64_t(runs) + frame.tile_bytes;
    if (frame.accumulator) taken += frame.group_bytes * frame.accumulator->groups_waiting() + frame.picture_bytes;
  }
  const std::int64_t all = std::min(std::int64_t(config.memory_bytes) - std::int64_t(others), measured.value_or(INT64_MAX));
  return std::uint64_t(std::max<std::int64_t>(all - std::int64_t(taken + light), 0));
}

Time WorkerMachine::State::NextWake() const {
  if (ended) return Time::max();
  if (worker == 0) return next_register;
  return std::min({next_heartbeat, last_heard + timeout, boxes.NextExpiry(), renders.NextStart(), leave_by.value_or(Time::max())});
}

Time WorkerMachine::NextWake() const { return state_->wake; }

bool WorkerMachine::registered() const { return state_->worker != 0; }
WorkerId WorkerMachine::worker() const { return state_->worker; }
const Peer* WorkerMachine::FindPeer(WorkerId worker) const { return state_->links.Find(worker); }
WorkerSizes WorkerMachine::sizes() const {
  const State& state = *state_;
  return {.frames = state.frames.size(),
          .cancelled = state.cancelled.size(),
          .early_images = state.early_images.size() + state.early_tiles.size(),
          .renders = state.renders.size(),
          .chunk_requests = state.boxes.chunk_requests(),
          .boxes = state.boxes.size()};
}

WorkerCounts WorkerMachine::counts() const {
  return {.sizes = sizes(),
          .cached_bytes = state_->boxes.cached_bytes(),
          .fetched_bytes = state_->boxes.fetched_bytes(),
          .registered = registered(),
          .leaving = state_->leave_by.has_value()};
}

}  // namespace slabstream
