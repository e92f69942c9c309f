#include "worker/machine/render_queue.h"

#include <algorithm>
#include <utility>

namespace slabstream {

bool RenderQueue::Busy(ClientId client) const {
  const auto first = waiting_.lower_bound({client, {}, 0});
  return begun_.contains(client) || (first != waiting_.end() && std::get<ClientId>(first->first) == client);
}

void RenderQueue::Add(ClientId client, const GroupKey& key, Rank rank, const Placement& placement,
                      const std::shared_ptr<const FrameSetup>& setup, const std::shared_ptr<const OcclusionMask>& hidden, Time now,
                      WorkerActions& actions) {
  if (!Busy(client)) {  // it begins where the others are
    if (turn_ && OnlyTurns()) {
      ChargeTurn(now);
      turns_.Take(turn_->client);
    }
    turns_.Join(client);
  }
  const std::uint8_t level = placement.level;
  Job& job = waiting_[{client, key, rank}];
  job.render = {.client = client, .key = key, .rank = rank, .placement = placement, .setup = setup, .hidden = hidden};
  const auto acquire = [&](DatasetId dataset, const Box& box, const SampleTypes& types, const std::optional<StoredAt>& stored,
                           const std::vector<FilledBox>& filled) {
    return boxes_.key(job.boxes.emplace_back(boxes_.Acquire({client, key.frame}, dataset, box, types, stored, filled, actions)));
  };
  const auto acquire_other = [&](const CoarserLevel& volume, const Box& box) {
    return acquire(volume.dataset, box, volume.description.type, volume.stored, {});
  };
  for (const CoarserLevel* const light : LightVolumesOf(*setup)) {
    job.render.lights.push_back(acquire_other(*light, light->description.geometry.bounds()));
  }
  for (const ShapeSetup& shape : setup->shapes) {
    job.render.shapes.push_back(acquire_other(shape.bytes, shape.bytes.description.geometry.bounds()));
  }
  for (const FieldSetup& field : setup->fields) {
    const Box box = PaddedBox(placement.at(), *setup, field);
    std::optional<BoxKey>& of_field = job.render.fields.emplace_back();
    if (!box.empty()) of_field = acquire_other(LevelOf(field, level), box);
  }
  job.render.padded =
      acquire(DatasetOf(*setup, level), PaddedBox(placement.at(), *setup), TypesOf(*setup), StoredOf(*setup, level), placement.filled);
  job.waited = !Complete(job);
}

void RenderQueue::AwaitTiles(FrameId frame, std::set<WorkerId> from, Time until) {
  if (!from.empty()) tiles_[frame] = {std::move(from), until};
}

void RenderQueue::TilesCame(FrameId frame, WorkerId from) {
  const auto awaited = tiles_.find(frame);
  if (awaited == tiles_.end()) return;
  awaited->second.from.erase(from);
  if (awaited->second.from.empty()) tiles_.erase(awaited);
}

bool RenderQueue::Complete(const Job& job) const {
  return !tiles_.contains(job.render.key.frame) &&
         std::ranges::all_of(job.boxes, [this](BoxFetcher::Generation box) { return boxes_.complete(box); });
}

bool RenderQueue::HasRoom(const Job& job) const {
  return std::ranges::all_of(job.boxes, [this](BoxFetcher::Generation box) {
    const auto uses = [box](const auto& begun) { return std::ranges::find(begun.second.job.boxes, box) != begun.second.job.boxes.end(); };
    return boxes_.HasRoomBeside(box) || std::ranges::none_of(begun_, uses);
  });
}

void RenderQueue::Release(const Job& job) {
  for (const BoxFetcher::Generation box : job.boxes) boxes_.Release(box);
}

void RenderQueue::DropGroup(const GroupKey& key, Time now, WorkerActions& actions) {
  std::erase_if(waiting_, [&](const auto& entry) {
    if (std::get<GroupKey>(entry.first) != key) return false;
    Release(entry.second);
    return true;
  });
  for (auto& [client, begun] : begun_) {
    if (begun.job.render.key != key || begun.dropped) continue;
    begun.dropped = true;
    actions.push_back(CancelRender{begun.job.render.image});
    if (turn_ && turn_->client == client) EndTurn(now);
  }
}

RenderQueue::Waiting::const_iterator RenderQueue::NextOf(ClientId client) const {
  if (!begun_.empty() && boxes_.TakesTooMuch()) return waiting_.end();
  for (auto job = waiting_.lower_bound({client, {}, 0}); job != waiting_.end() && std::get<ClientId>(job->first) == client; ++job) {
    if (Complete(job->second) && HasRoom(job->second)) return job;
  }
  return waiting_.end();
}

bool RenderQueue::WantsTurn(ClientId client) const {
  const auto begun = begun_.find(client);
  return begun != begun_.end() ? !begun->second.dropped : NextOf(client) != waiting_.end();
}

std::set<ClientId> RenderQueue::Clients() const {
  std::set<ClientId> clients;
  for (const auto& [client, begun] : begun_) clients.insert(client);
  for (auto job = waiting_.begin(); job != waiting_.end();) {
    const ClientId client = std::get<ClientId>(job->first);
    clients.insert(client);
    job = waiting_.lower_bound({client + 1, {}, 0});
    if (client + 1 == 0) break;
  }
  return clients;
}

bool RenderQueue::OnlyTurns() const {
  const auto other = [this](const auto& job) { return std::get<ClientId>(job.first) != turn_->client; };
  return begun_.size() == 1 && (waiting_.empty() || !(other(*waiting_.begin()) || other(*waiting_.rbegin())));
}

std::optional<ClientId> RenderQueue::NextInTurn() const {
  std::optional<ClientId> next;
  for (const ClientId client : Clients()) {
    if ((turn_ && turn_->client == client) || !WantsTurn(client)) continue;
    if (!next || turns_.TurnOf(client) < turns_.TurnOf(*next)) next = client;
  }
  return next;
}

void RenderQueue::ChargeTurn(Time now) {
  turns_.Charge(turn_->client, now - turn_->charged);
  turn_->charged = now;
}

void RenderQueue::EndTurn(Time now) {
  ChargeTurn(now);
  turn_.reset();
}

void RenderQueue::StartNext(Time now, WorkerActions& actions) {
  std::erase_if(tiles_, [now](const auto& awaited) { return awaited.second.until <= now; });
  if (turn_ && (OnlyTurns() || now < turn_->begin + kTurn)) return;
  const std::optional<ClientId> next = NextInTurn();
  if (!next) return;
  if (turn_) {
    ChargeTurn(now);
    if (turns_.TurnOf(*next).used > turns_.TurnOf(turn_->client).used) {  // another turn of the same client
      turn_->begin = now;
      return turns_.Take(turn_->client);
    }
    actions.push_back(PauseRender{begun_.at(turn_->client).job.render.image});
  }
  Begin(*next, now, actions);
}

void RenderQueue::Begin(ClientId client, Time now, WorkerActions& actions) {
  turns_.Take(client);
  turn_ = TurnNow{client, now, now};
  if (const auto paused = begun_.find(client); paused != begun_.end()) {
    actions.push_back(ResumeRender{paused->second.job.render.image});
    return;
  }
  const auto next = NextOf(client);
  Begun& begun = begun_.emplace(client, Begun{next->second}).first->second;
  waiting_.erase(next);
  begun.job.render.image = names_.Next();
  actions.push_back(begun.job.render);
}

Time RenderQueue::NextStart() const {
  Time next = turn_ && !OnlyTurns() && NextInTurn() ? turn_->begin + kTurn : Time::max();
  for (const auto& [group, awaited] : tiles_) next = std::min(next, awaited.until);
  return next;
}

std::optional<RankReport> RenderQueue::Finish(const RenderDone& done, WorkerId worker, Time now, WorkerActions& actions) {
  const auto ended = std::ranges::find_if(begun_, [&](const auto& begun) { return begun.second.job.render.image == done.image; });
  if (ended == begun_.end()) return std::nullopt;
  const ClientId client = ended->first;
  if (turn_ && turn_->client == client) EndTurn(now);
  const auto [job, dropped] = std::move(ended->second);
  begun_.erase(ended);
  const StartRender& render = job.render;
  if (done.status.ok()) {
    for (const BoxFetcher::Generation box : job.boxes) boxes_.Rendered(box);
  }
  boxes_.SetBytes(render.padded.generation, done.box_bytes);  // a cancelled frame derives data too
  for (std::size_t i = 0; i < done.field_bytes.size(); ++i) {
    if (render.fields[i]) boxes_.SetBytes(render.fields[i]->generation, done.field_bytes[i]);
  }
  if (waiting_.empty() && begun_.empty()) turns_.ForgetAll();
  turns_.ForgetIdle([this](ClientId each) { return Busy(each); });
  if (dropped) {
    Release(job);
    actions.push_back(ReleaseImage{done.image});
    return std::nullopt;
  }
  RankReport report = done.report;
  report.worker = worker;
  report.group = render.key.group;
  report.rank = render.rank;
  report.box = render.placement.id;
  if (job.waited) {
    for (const BoxFetcher::Generation box : job.boxes) {
      const BoxFetcher::FetchReport fetched = boxes_.TakeReport(box);
      report.voxel_bytes += fetched.voxel_bytes;
      report.stored_bytes += fetched.stored_bytes;
      report.sent_bytes += fetched.sent_bytes;
      if (fetched.voxel_bytes > 0) {
        AddStage(report, Stage::kFetch, fetched.begin.time_since_epoch().count(), fetched.end.time_since_epoch().count());
      }
    }
  }
  Release(job);
  if (!done.status.ok()) actions.push_back(ReleaseImage{done.image});
  return report;
}

RenderQueue::WantedBoxes RenderQueue::BoxesInTurn() const {
  struct OfClient {
    std::vector<BoxFetcher::Generation> boxes;
    std::set<BoxFetcher::Generation> listed;
    std::size_t of_first = 0;
  };
  std::vector<ClientId> clients;
  std::map<ClientId, OfClient> wanted;
  for (const auto& [name, job] : waiting_) {
    auto& [boxes, listed, of_first] = wanted[std::get<ClientId>(name)];
    for (const BoxFetcher::Generation box : job.boxes) {
      if (listed.insert(box).second) boxes.push_back(box);
    }
    if (of_first == 0) of_first = boxes.size();
  }
  for (const auto& [client, of_client] : wanted) clients.push_back(client);
  std::ranges::sort(clients, {}, [this](ClientId client) { return turns_.TurnOf(client); });
  WantedBoxes in_turn;
  for (const ClientId client : clients) in_turn.by_client.push_back(std::move(wanted[client].boxes));
  if (!clients.empty()) in_turn.of_next = wanted[clients.front()].of_first;
  return in_turn;
}

std::set<GroupKey> RenderQueue::GroupsOn(BoxFetcher::Generation box) const {
  std::set<GroupKey> groups;
  for (const auto& [name, job] : waiting_) {
    if (std::ranges::find(job.boxes, box) != job.boxes.end()) groups.insert(std::get<GroupKey>(name));
  }
  return groups;
}

}  // namespace slabstream
