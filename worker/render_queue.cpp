#include "worker/render_queue.h"

#include <algorithm>

namespace slabstream {

void RenderQueue::Add(const GroupKey& key, Rank rank, const Placement& placement, const std::shared_ptr<const FrameSetup>& setup,
                      const std::shared_ptr<const OcclusionMask>& hidden, WorkerActions& actions) {
  const Box voxels = PaddedBox(placement.box, *setup);
  waiting_[{key, rank}] = {placement, setup, hidden, boxes_.Acquire(setup->dataset, voxels, TypesOf(*setup), actions)};
}

void RenderQueue::DropGroup(const GroupKey& key, WorkerActions& actions) {
  std::erase_if(waiting_, [&](const auto& entry) {
    if (entry.first.first != key) return false;
    boxes_.Release(entry.second.padded);
    return true;
  });
  if (running_ && running_->key == key && !running_->dropped) {
    running_->dropped = true;
    actions.push_back(CancelRender{key});
  }
}

void RenderQueue::StartNext(WorkerActions& actions) {
  if (running_) return;
  const auto next = std::ranges::find_if(waiting_, [&](const auto& entry) { return boxes_.complete(entry.second.padded); });
  if (next == waiting_.end()) return;
  running_ = Running{next->first.first, next->first.second, std::move(next->second), names_.Next(), false};
  waiting_.erase(next);
  actions.push_back(StartRender{running_->key, running_->rank, boxes_.key(running_->job.padded), running_->job.placement,
                                running_->job.setup, running_->job.hidden, running_->image});
}

std::optional<RankReport> RenderQueue::Finish(const RenderDone& done, WorkerId worker, WorkerActions& actions) {
  if (!running_ || running_->image != done.image) return std::nullopt;
  const Running job = *std::exchange(running_, std::nullopt);
  const BoxFetcher::Generation padded = job.job.padded;
  if (done.status.ok()) boxes_.Rendered(padded);
  boxes_.SetBytes(padded, done.box_bytes);  // a cancelled frame derives data too
  if (job.dropped) {
    boxes_.Release(padded);
    actions.push_back(ReleaseImage{done.image});
    return std::nullopt;
  }
  RankReport report = done.report;
  report.worker = worker;
  report.group = job.key.group;
  report.rank = job.rank;
  report.box = job.job.placement.id;
  const BoxFetcher::FetchReport fetched = boxes_.TakeReport(padded);
  report.voxel_bytes = fetched.voxel_bytes;
  if (fetched.voxel_bytes > 0) {
    AddStage(report, Stage::kFetch, fetched.begin.time_since_epoch().count(), fetched.end.time_since_epoch().count());
  }
  boxes_.Release(padded);
  if (!done.status.ok()) actions.push_back(ReleaseImage{done.image});
  return report;
}

std::vector<BoxFetcher::Generation> RenderQueue::BoxesInOrder() const {
  std::vector<BoxFetcher::Generation> boxes;
  for (const auto& [name, job] : waiting_) boxes.push_back(job.padded);
  return boxes;
}

std::set<GroupKey> RenderQueue::GroupsOn(BoxFetcher::Generation padded) const {
  std::set<GroupKey> groups;
  for (const auto& [name, job] : waiting_) {
    if (job.padded == padded) groups.insert(name.first);
  }
  return groups;
}

}  // namespace slabstream
