// FrameAccumulator: a frame, or a share of one, on its display worker. It accumulates the images of groups front to back; an image that
// comes early waits. After each group it reports GroupDone and sends a preview if they are wanted and the last one is long enough ago;
// after the last group it sends the frame. If frames use occlusion masks, it first finds the hidden tiles and adds them to the report,
// except after the last group, when nobody needs them. It outlives attempts: accumulated pixels are right whoever rendered them. It keeps
// the picture until the frame is over, because the coordinator may ask again (Confirm).
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "worker/machine/group_run.h"

namespace slabstream {

class FrameAccumulator {
 public:
  // `assignment`: of any group of the frame, of which this worker gets the share `share`. `names` must outlive the accumulator.
  // `preview_interval`: from one preview to the next, at least.
  FrameAccumulator(const GroupAssignment& assignment, WorkerId self, std::size_t share, ImageNames& names, Duration preview_interval);

  // True if the group's image is here: accumulated, being combined, or waiting.
  bool Has(std::uint32_t group) const { return group < groups_done_ + (group_started_ ? 1U : 0U) || waiting_.count(group) > 0; }
  std::uint32_t groups_done() const { return groups_done_; }
  std::size_t groups_waiting() const { return waiting_.size(); }  // for one in front of them; their images are here
  std::size_t share_count() const { return share_count_; }
  const Status& failure() const { return failure_; }  // the picture is lost: drop the accumulator

  // What its picture is made with: SendFrame::shapes and lights. Until they are there, groups wait.
  struct ShapeBoxes {
    std::vector<BoxKey> shapes, lights;
  };
  bool AwaitsShapes() const { return !shapes_; }
  void SetShapes(ShapeBoxes boxes, Time now, WorkerActions& actions);

  // Later reports and pictures carry this attempt.
  void SetAttempt(std::uint32_t attempt) { attempt_ = attempt; }

  void Add(GroupImage group, Time now, WorkerActions& actions);                // takes over its images
  bool OnCombined(const CombineDone& done, Time now, WorkerActions& actions);  // false: not one of its combines
  void OnHiddenFound(const HiddenFound& found, Time now, WorkerActions& actions);

  // If the group is done, reports it again; if the frame is finished, sends it again, once for each attempt.
  void Confirm(std::uint32_t group, WorkerActions& actions);

  void Drop(WorkerActions& actions);  // releases what it holds

 private:
  void Advance(Time now, WorkerActions& actions);
  void StartGroup(GroupImage group, WorkerActions& actions);
  void FinishGroup(Time now, WorkerActions& actions);
  void ReportDone(std::uint32_t group, WorkerActions& actions) const;
  void SendPicture(WorkerActions& actions);

  const Epoch epoch_;
  const WorkerId self_;
  const ClientId client_;
  const FrameId frame_;
  const std::uint32_t group_count_;
  const bool previews_, straight8_;
  const std::optional<Rgb> straight8_over_;
  const std::shared_ptr<const FrameSetup> setup_;
  const std::optional<PicturesAddress> pictures_;
  const std::size_t share_, share_count_;
  const PixelRange pixels_;  // the share's pixels
  ImageNames& names_;
  const Duration preview_interval_;

  std::optional<ShapeBoxes> shapes_;  // none: they are not there yet
  std::uint32_t attempt_ = 0;
  std::uint32_t groups_done_ = 0;                    // accumulated, nearest first
  std::optional<std::uint32_t> frame_sent_attempt_;  // the latest attempt for which the finished frame was sent
  std::optional<Time> previewed_;                    // the last preview
  ImageHandle image_ = 0;                            // 0: none yet
  int combining_ = 0;                                // StartCombine and FindHidden of image_ that have not been answered
  bool group_started_ = false;
  OcclusionMask hidden_;                          // by the groups done
  std::map<std::uint32_t, GroupImage> waiting_;   // complete, but a group in front of them is missing
  std::vector<std::vector<RankReport>> reports_;  // reports of the groups done, and of the one being combined
  Status failure_;
};

}  // namespace slabstream
