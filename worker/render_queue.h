// RenderQueue: the ranks that this worker has yet to render, in order of frame, group and rank, and the one that it renders now. The first
// rank with a complete padded box goes next; only one is rendered at a time. Each job pins its padded box.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "worker/box_fetcher.h"

namespace slabstream {

class RenderQueue {
 public:
  // Both must outlive the queue.
  RenderQueue(BoxFetcher& boxes, ImageNames& names) : boxes_(boxes), names_(names) {}

  void Add(const GroupKey& key, Rank rank, const Placement& placement, const std::shared_ptr<const FrameSetup>& setup,
           const std::shared_ptr<const OcclusionMask>& hidden, WorkerActions& actions);
  void DropGroup(const GroupKey& key, WorkerActions& actions);  // its running render is cancelled
  void StartNext(WorkerActions& actions);                       // if nothing is rendered and a padded box is complete

  // Call when the running render ends. Returns the executor's report with identities and fetch figures filled in, or nothing if the group
  // was dropped (the image is then released).
  std::optional<RankReport> Finish(const RenderDone& done, WorkerId worker, WorkerActions& actions);

  std::vector<BoxFetcher::Generation> BoxesInOrder() const;  // of waiting jobs
  std::set<GroupKey> GroupsOn(BoxFetcher::Generation padded) const;
  std::size_t size() const { return waiting_.size() + (running_ ? 1 : 0); }

 private:
  struct Job {
    Placement placement;
    std::shared_ptr<const FrameSetup> setup;
    std::shared_ptr<const OcclusionMask> hidden;
    BoxFetcher::Generation padded = 0;
  };
  struct Running {
    GroupKey key;
    Rank rank = 0;
    Job job;
    ImageHandle image = 0;
    bool dropped = false;
  };

  BoxFetcher& boxes_;
  ImageNames& names_;
  std::map<std::pair<GroupKey, Rank>, Job> waiting_;
  std::optional<Running> running_;
};

}  // namespace slabstream
