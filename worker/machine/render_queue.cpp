#include "worker/machine/render_queue.h"

#include <algorithm>

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
  const Box voxels = PaddedBox(placement.at(), *setup);
  const std::uint8_t level = placement.level;
  const BoxFetcher::Use use{client, key.frame};
  BoxFetcher::Generation light = 0;
  if (setup->light) {
    const auto& [dataset, description, stored] = *setup->light;
    light = boxes_.Acquire(use, dataset, description.geometry.bounds(), {description.type, {}}, stored, {}, actions);
  }
  const BoxFetcher::Generation padded =
      boxes_.Acquire(use, DatasetOf(*setup, level), voxels, TypesOf(*setup), StoredOf(*setup, level), placement.filled, actions);
  Job& job = waiting_[{client, key, rank}] = {placement, setup, hidden, padded, light};
  job.waited = !Complete(job);
}

void RenderQueue::Release(const Job& job) {
  boxes_.Release(job.padded);
  if (job.light != 0) boxes_.Release(job.light);
}

void RenderQueue::DropGroup(const GroupKey& key, Time now, WorkerActions& actions) {
  std::erase_if(waiting_, [&](const auto& entry) {
    if (std::get<GroupKey>(entry.first) != key) return false;
    Release(entry.second);
    return true;
  });
  for (auto& [client, begun] : begun_) {
    if (begun.key != key || begun.dropped) continue;
    begun.dropped = true;
    actions.push_back(CancelRender{begun.image});
    if (turn_ && turn_->client == client) EndTurn(now);
  }
}

RenderQueue::Waiting::const_iterator RenderQueue::NextOf(ClientId client) const {
  for (auto job = waiting_.lower_bound({client, {}, 0}); job != waiting_.end() && std::get<ClientId>(job->first) == client; ++job) {
    const BoxFetcher::Generation padded = job->second.padded;
    const auto uses = [&](const auto& begun) { return begun.second.job.padded == padded; };
    if (Complete(job->second) && (boxes_.HasRoomBeside(padded) || std::ranges::none_of(begun_, uses))) return job;
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
  if (turn_ && (OnlyTurns() || now < turn_->begin + kTurn)) return;
  const std::optional<ClientId> next = NextInTurn();
  if (!next) return;
  if (turn_) {
    ChargeTurn(now);
    if (turns_.TurnOf(*next).used > turns_.TurnOf(turn_->client).used) {  // another turn of the same client
      turn_->begin = now;
      return turns_.Take(turn_->client);
    }
    actions.push_back(PauseRender{begun_.at(turn_->client).image});
  }
  Begin(*next, now, actions);
}

void RenderQueue::Begin(ClientId client, Time now, WorkerActions& actions) {
  turns_.Take(client);
  turn_ = TurnNow{client, now, now};
  if (const auto paused = begun_.find(client); paused != begun_.end()) {
    actions.push_back(ResumeRender{paused->second.image});
    return;
  }
  const auto next = NextOf(client);
  const auto& [of_client, key, rank] = next->first;
  const Begun& begun = begun_.emplace(client, Begun{key, rank, next->second, names_.Next()}).first->second;
  waiting_.erase(next);
  actions.push_back(StartRender{client, begun.key, begun.rank, boxes_.key(begun.job.padded), begun.job.placement, begun.job.setup,
                                begun.job.hidden, begun.image});
  if (begun.job.light != 0) std::get<StartRender>(actions.back()).light = boxes_.key(begun.job.light);
}

Time RenderQueue::NextTurn() const { return turn_ && !OnlyTurns() && NextInTurn() ? turn_->begin + kTurn : Time::max(); }

std::optional<RankReport> RenderQueue::Finish(const RenderDone& done, WorkerId worker, Time now, WorkerActions& actions) {
  const auto ended = std::ranges::find_if(begun_, [&](const auto& begun) { return begun.second.image == done.image; });
  if (ended == begun_.end()) return std::nullopt;
  const ClientId client = ended->first;
  if (turn_ && turn_->client == client) EndTurn(now);
  const Begun job = std::move(ended->second);
  begun_.erase(ended);
  const BoxFetcher::Generation padded = job.job.padded;
  if (done.status.ok()) {
    boxes_.Rendered(padded);
    if (job.job.light != 0) boxes_.Rendered(job.job.light);
  }
  boxes_.SetBytes(padded, done.box_bytes);  // a cancelled frame derives data too
  if (waiting_.empty() && begun_.empty()) turns_.ForgetAll();
  turns_.ForgetIdle([this](ClientId each) { return Busy(each); });
  if (job.dropped) {
    Release(job.job);
    actions.push_back(ReleaseImage{done.image});
    return std::nullopt;
  }
  RankReport report = done.report;
  report.worker = worker;
  report.group = job.key.group;
  report.rank = job.rank;
  report.box = job.job.placement.id;
  if (job.job.waited) {
    for (const BoxFetcher::Generation box : {padded, job.job.light}) {
      if (box == 0) continue;
      const BoxFetcher::FetchReport fetched = boxes_.TakeReport(box);
      report.voxel_bytes += fetched.voxel_bytes;
      report.stored_bytes += fetched.stored_bytes;
      if (fetched.voxel_bytes > 0) {
        AddStage(report, Stage::kFetch, fetched.begin.time_since_epoch().count(), fetched.end.time_since_epoch().count());
      }
    }
  }
  Release(job.job);
  if (!done.status.ok()) actions.push_back(ReleaseImage{done.image});
  return report;
}

std::vector<std::vector<BoxFetcher::Generation>> RenderQueue::BoxesInTurn() const {
  std::vector<ClientId> clients;
  std::map<ClientId, std::vector<BoxFetcher::Generation>> boxes;
  for (const auto& [name, job] : waiting_) {
    std::vector<BoxFetcher::Generation>& of_client = boxes[std::get<ClientId>(name)];
    if (job.light != 0 && std::ranges::find(of_client, job.light) == of_client.end()) of_client.push_back(job.light);
    of_client.push_back(job.padded);
  }
  for (const auto& [client, of_client] : boxes) clients.push_back(client);
  std::ranges::sort(clients, {}, [this](ClientId client) { return turns_.TurnOf(client); });
  std::vector<std::vector<BoxFetcher::Generation>> in_turn;
  for (const ClientId client : clients) in_turn.push_back(std::move(boxes[client]));
  return in_turn;
}

std::set<GroupKey> RenderQueue::GroupsOn(BoxFetcher::Generation padded) const {
  std::set<GroupKey> groups;
  for (const auto& [name, job] : waiting_) {
    if (job.padded == padded || job.light == padded) groups.insert(std::get<GroupKey>(name));
  }
  return groups;
}

}  // namespace slabstream
