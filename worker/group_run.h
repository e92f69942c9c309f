// GroupRun: one group of one attempt on one worker. It runs the group's schedule for the ranks that this worker renders, whatever family
// made it, and on the display worker collects the group image.
//
// A step may be taken at a rank when the rank is rendered, everything combined for it so far is done, and all earlier steps of the rank
// that touch the same pixels are taken: so what meets is the same in any order of arrival, and steps of disjoint pixels do not wait for
// each other. A step travels as one PartialImage for each of the sender's fragments in its range (one, unless the schedule divides images);
// the receiver counts pixels until the range is covered. A step between two ranks of this worker moves fragments without a message.
//
// Whatever goes wrong is kept in failure(); the run then does nothing any more and waits to be dropped.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include "worker/fragment_set.h"
#include "worker/image_names.h"

namespace slabstream {

// Part of an image: pixels of `image`, or if that is 0 what came from another worker.
struct ImagePiece {
  PixelRange pixels;
  RankInterval ranks;
  ImageHandle image = 0;
  IncomingImage incoming;
};

// All pixels of a group (no pieces: the group is empty), on the display worker. Who takes it owns the images.
struct GroupImage {
  GroupKey key;
  std::vector<ImagePiece> pieces;
  std::vector<RankReport> reports;
};

class GroupRun {
 public:
  // `assignment` of any content; what does not fit together is a failure. `names` must outlive the run.
  GroupRun(GroupAssignment assignment, WorkerId self, ImageNames& names);

  const GroupAssignment& assignment() const { return assignment_; }
  const GroupKey& key() const { return assignment_.key; }
  const Status& failure() const { return failure_; }

  // Takes over `image`, the picture of one of this worker's ranks.
  void OnRendered(Rank rank, ImageHandle image, RankReport report, WorkerActions& actions);
  // One of this worker's ranks shows nothing and is not rendered: its picture is empty.
  void LeaveOut(Rank rank, RankReport report, WorkerActions& actions);
  void OnPartial(const PartialImage& message, Bytes payload, WorkerActions& actions);
  void OnCombined(const CombineDone& done, WorkerActions& actions);

  std::optional<GroupImage> TakeGroupImage();  // display worker, once
  bool finished() const;                       // this worker has nothing more to do for it, and holds nothing of it
  void Drop(WorkerActions& actions);           // releases what it holds

 private:
  struct RankState {
    bool rendered = false;
    ImageHandle own = 0;  // its picture, once rendered
    int combining = 0;    // StartCombine without CombineDone
    FragmentSet fragments;
    std::vector<std::uint32_t> open_steps;  // not taken yet, in order
    std::vector<RankReport> reports;        // on their way with this rank
  };
  struct Arrivals {  // of one step that this worker receives
    std::vector<PixelRange> seen;
    std::vector<ImagePiece> waiting;
    std::vector<RankReport> reports;
    std::uint64_t merged = 0;  // pixels
  };

  bool Mine(Rank rank) const { return ranks_.count(rank) > 0; }
  bool Ready(const RankState& rank, std::uint32_t step) const;
  void Advance(WorkerActions& actions);
  bool TakeStep(Rank rank, std::uint32_t step, WorkerActions& actions);
  void Send(RankState& from, Rank rank, std::uint32_t step, WorkerActions& actions);
  void MoveLocally(RankState& from, RankState& to, std::uint32_t step, WorkerActions& actions);
  bool Receive(RankState& to, Rank rank, std::uint32_t step, WorkerActions& actions);
  void Merge(RankState& to, Rank rank, ImagePiece piece, WorkerActions& actions);
  void Combine(RankState& to, Rank rank, const Fragment& held, const ImagePiece& piece, WorkerActions& actions);
  bool ComesHome(const RankState& to, Rank rank, const ImagePiece& piece) const;
  void TakeHome(RankState& to, Rank rank, ImagePiece piece, WorkerActions& actions);
  // Fills in key and frame.
  void Start(StartCombine combine, RankState& to, Rank rank, WorkerActions& actions);
  void FinishRoot(WorkerActions& actions);
  void CollectGroupPiece(const PartialImage& message, Bytes payload);
  void SendFragments(Rank rank, const std::vector<Fragment>& fragments, std::uint32_t step, WorkerId to, std::vector<RankReport> reports,
                     WorkerActions& actions);
  void ReleaseUnused(std::vector<Fragment> taken, WorkerActions& actions);
  std::vector<RankReport> TakeReports(RankState& rank);
  const Peer* FindPeer(WorkerId worker) const;
  void Fail(std::string why);

  const GroupAssignment assignment_;
  const WorkerId self_;
  ImageNames& names_;
  const PixelRange frame_;
  std::map<Rank, RankState> ranks_;                      // of this worker
  std::map<std::uint32_t, Arrivals> arrivals_;           // by step; also of steps that are done, to know duplicates
  std::vector<std::pair<ImageHandle, Rank>> combining_;  // StartCombine without CombineDone
  bool root_done_ = false;
  Arrivals group_pieces_;  // display worker
  bool group_image_taken_ = false;
  Status failure_;
};

}  // namespace slabstream
