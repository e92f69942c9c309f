// GroupRun: one group of one attempt on one worker. It runs the group's schedule for the ranks that this worker renders (ScheduleRunner),
// and on the display worker it collects the group image.
//
// A step travels as one PartialImage for each of the sender's fragments in its range (one, unless the schedule divides images). The
// receiver counts pixels until the range is covered. A step between two ranks of this worker moves fragments without a message.
//
// After the first failure, kept in failure(), the run does nothing more and waits to be dropped.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "common/combining/schedule_runner.h"
#include "worker/machine/worker_machine.h"

namespace slabstream {

// Part of an image: pixels of `image`, or if that is 0, pixels from another worker.
struct ImagePiece {
  PixelRange pixels;
  RankInterval ranks;
  ImageHandle image = 0;
  Rare<IncomingImage> incoming;  // none: an empty image
};

// The pixels of a group, or of a share of it, on the display worker; an empty group has no pieces. The taker owns the images.
struct GroupImage {
  GroupKey key;
  std::vector<ImagePiece> pieces;
  std::vector<RankReport> reports;
};

class GroupRun {
 public:
  // An inconsistent assignment is a failure. `names` must outlive the run.
  GroupRun(GroupAssignment assignment, WorkerId self, ImageNames& names);

  const std::vector<Peer>& peers() const { return *peers_; }  // by ascending worker
  bool HasPeer(WorkerId worker) const { return FindPeer(worker) != nullptr; }
  const GroupKey& key() const { return assignment_.key; }
  ClientId client() const { return assignment_.client; }
  // This worker's ranks; none if the assignment is inconsistent.
  const std::vector<Rank>& ranks() const { return runner_.order().ranks(); }
  const Placement& placement(Rank rank) const { return assignment_.group.placements[rank]; }
  const Status& failure() const { return failure_; }

  // Takes over `image`, the picture of one of this worker's ranks.
  void OnRendered(Rank rank, ImageHandle image, RankReport report, WorkerActions& actions);
  // One of this worker's ranks draws nothing: it is not rendered and its picture is empty.
  void LeaveOut(Rank rank, RankReport report, WorkerActions& actions);
  void OnPartial(PartialImage&& message, const Bytes& payload, WorkerActions& actions);
  bool OnCombined(const CombineDone& done, WorkerActions& actions);  // false: not one of its combines

  std::optional<GroupImage> TakeGroupImage();  // display worker, once
  bool finished() const;                       // this worker has nothing more to do for the group, and holds nothing of it
  void Drop(WorkerActions& actions);           // releases what it holds

 private:
  // Where pixels of a rank are stored, and the ranks that were combined into them. Fragments may share an image; their pixels are then
  // disjoint, also between ranks.
  struct ImagePart {
    RankInterval ranks;
    ImageHandle image = 0;
    friend bool operator==(const ImagePart&, const ImagePart&) = default;
  };
  using Runner = ScheduleRunner<ImagePart>;
  using Held = Fragment<ImagePart>;
  struct RankState {
    ImageHandle own = 0;              // its picture, once rendered
    std::vector<RankReport> reports;  // on their way with this rank: its own, then those that have come
  };
  struct Arrival {
    ImagePiece piece;
    bool taken = false;  // the piece has given its image away
  };

  bool Mine(Rank rank) const { return ranks_.contains(rank); }
  WorkerId WorkerOf(Rank rank) const { return workers_[rank]; }
  std::uint32_t step_count() const { return std::uint32_t(runner_.order().schedule().steps().size()); }
  Runner MakeRunner();
  void Advance(WorkerActions& actions);
  void MoveLocally(const Runner::Taken& taken, WorkerActions& actions);
  void Receive(const Runner::Taken& taken, WorkerActions& actions);
  void Merge(Rank rank, ImagePiece&& piece, WorkerActions& actions);
  // Passes on `incoming`, what has come of the piece.
  void Combine(Rank rank, const Held& held, const ImagePiece& piece, Rare<IncomingImage>&& incoming, WorkerActions& actions);
  bool ComesHome(Rank rank, const ImagePiece& piece) const;
  void TakeHome(Rank rank, ImagePiece&& piece, WorkerActions& actions);
  // Fills in key and frame.
  void Start(StartCombine&& combine, Rank rank, WorkerActions& actions);
  // Finishes each share whose root is one of this worker's ranks, when that rank is done.
  void FinishShares(WorkerActions& actions);
  void FinishShare(std::size_t share, WorkerActions& actions);
  Rank RootOf(std::size_t share) const { return assignment_.group.schedule.roots[share]; }
  PixelRange PixelsOf(std::size_t share) const;
  void CollectGroupPiece(PartialImage&& message, const Bytes& payload);
  // The messages carry `reports`.
  void SendFragments(Rank rank, std::span<const Held> fragments, std::uint32_t step, WorkerId to, std::vector<RankReport> reports,
                     WorkerActions& actions);
  bool Uses(Rank rank, ImageHandle image) const;
  void ReleaseUnused(std::span<const Held> taken, WorkerActions& actions);
  std::vector<RankReport> TakeReports(Rank rank);
  const Peer* FindPeer(WorkerId worker) const;  // null: no peer
  void Fail(std::string why);

  const std::shared_ptr<const std::vector<Peer>> peers_;  // by ascending worker
  const GroupAssignment assignment_;                      // without its peers
  const std::vector<WorkerId> workers_;                   // by rank
  const WorkerId self_;
  ImageNames& names_;
  const PixelRange frame_;
  Status failure_;
  Runner runner_;
  std::map<Rank, RankState> ranks_;                      // this worker's ranks
  std::multimap<std::uint32_t, Arrival> arrivals_;       // by the turn that waits for more of them; of a turn, at most one of any pixel
  std::vector<std::pair<ImageHandle, Rank>> combining_;  // StartCombine without CombineDone
  std::vector<std::size_t> unfinished_;                  // shares that end at this worker's ranks
  const std::optional<std::size_t> displayed_;           // the share that this worker displays
  GroupImage group_image_;                               // what has come of it
  std::uint64_t group_pixels_ = 0;                       // in its pieces
  bool group_image_taken_ = false;
};

}  // namespace slabstream
