#include "worker/machine/frame_accumulator.h"

#include <algorithm>
#include <set>
#include <utility>

#include "common/base/check.h"
#include "common/planning/frame_occlusion.h"

namespace slabstream {

FrameAccumulator::FrameAccumulator(const GroupAssignment& assignment, WorkerId self, std::size_t share, ImageNames& names,
                                   Duration preview_interval)
    : epoch_(assignment.epoch),
      self_(self),
      client_(assignment.client),
      frame_(assignment.key.frame),
      group_count_(assignment.group_count),
      previews_(assignment.previews),
      straight8_(assignment.straight8),
      straight8_over_(assignment.straight8_over),
      setup_(std::make_shared<const FrameSetup>(assignment.setup)),
      pictures_(assignment.pictures),
      share_(share),
      share_count_(assignment.group.schedule.roots.size()),
      pixels_(Share(WholeFrame(assignment.setup), share_, share_count_)),
      names_(names),
      preview_interval_(preview_interval),
      attempt_(assignment.key.attempt) {
  if (setup_->shapes.empty()) shapes_.emplace();
}

void FrameAccumulator::SetShapes(ShapeBoxes boxes, Time now, WorkerActions& actions) {
  shapes_ = std::move(boxes);
  Advance(now, actions);
}

void FrameAccumulator::Add(GroupImage group, Time now, WorkerActions& actions) {
  CHECK(!Has(group.key.group)) << "group " << group.key.group;
  const std::uint32_t number = group.key.group;
  waiting_.emplace(number, std::move(group));
  Advance(now, actions);
}

bool FrameAccumulator::OnCombined(const CombineDone& done, Time now, WorkerActions& actions) {
  if (combining_ == 0 || done.image != image_) return false;
  --combining_;
  if (!done.status.ok()) {
    if (failure_.ok()) failure_ = done.status;
    return true;
  }
  std::vector<RankReport>& reports = reports_.back();
  const auto own = std::ranges::find(reports, self_, &RankReport::worker);
  if (own != reports.end()) AddStage(*own, Stage::kCombine, done.span.begin_ns, done.span.end_ns);
  Advance(now, actions);
  return true;
}

void FrameAccumulator::OnHiddenFound(const HiddenFound& found, Time now, WorkerActions& actions) {
  if (combining_ == 0 || found.image != image_) return;
  --combining_;
  hidden_ = found.hidden;
  Advance(now, actions);
}

void FrameAccumulator::Advance(Time now, WorkerActions& actions) {
  while (shapes_ && failure_.ok() && combining_ == 0) {
    if (group_started_) {
      FinishGroup(now, actions);
      continue;
    }
    const auto next = waiting_.find(groups_done_);
    if (next == waiting_.end()) return;
    GroupImage group = std::move(next->second);
    waiting_.erase(next);
    StartGroup(std::move(group), actions);
  }
}

void FrameAccumulator::StartGroup(GroupImage group, WorkerActions& actions) {
  group_started_ = true;
  reports_.push_back(std::move(group.reports));
  if (group.pieces.empty() && image_ == 0) {  // a frame that starts with an empty group starts with an empty picture
    group.pieces.push_back({pixels_, {}, 0, IncomingImage{.header = {.format = setup_->format}}});
  }
  std::set<ImageHandle> used;
  for (ImagePiece& piece : group.pieces) {
    if (image_ == 0 && piece.image != 0 && piece.pixels == pixels_) {
      image_ = piece.image;  // the first group's image becomes the frame
      continue;
    }
    if (image_ == 0) image_ = names_.Next();
    actions.push_back(StartCombine{.client = client_,
                                   .key = group.key,
                                   .image = image_,
                                   .other = piece.image,
                                   .incoming = std::move(piece.incoming),
                                   .side = Side::kBack,
                                   .pixels = piece.pixels == WholeFrame(*setup_) ? PixelRange{} : piece.pixels,
                                   .frame = FrameBounds(*setup_),
                                   .ranks = piece.ranks});
    ++combining_;
    if (piece.image != 0) used.insert(piece.image);
  }
  for (const ImageHandle image : used) actions.push_back(ReleaseImage{image});
  if (UsesOcclusion(*setup_) && groups_done_ + 1 < group_count_) {
    actions.push_back(FindHidden{client_, group.key, image_, setup_, hidden_});
    ++combining_;
  }
}

void FrameAccumulator::FinishGroup(Time now, WorkerActions& actions) {
  group_started_ = false;
  ++groups_done_;
  ReportDone(groups_done_ - 1, actions);
  if (groups_done_ == group_count_) return SendPicture(actions);
  if (!previews_ || (previewed_ && now < *previewed_ + preview_interval_)) return;
  SendPicture(actions);
  previewed_ = now;
}

void FrameAccumulator::Confirm(std::uint32_t group, WorkerActions& actions) {
  if (group >= groups_done_) return;
  ReportDone(group, actions);
  if (groups_done_ == group_count_ && frame_sent_attempt_ != attempt_) SendPicture(actions);
}

void FrameAccumulator::ReportDone(std::uint32_t group, WorkerActions& actions) const {
  GroupDone done{epoch_, self_, {frame_, attempt_, group}, reports_[group], {}};
  if (group + 1 == groups_done_ && groups_done_ < group_count_) done.hidden = hidden_;
  actions.push_back(SendControl{std::move(done)});
}

void FrameAccumulator::SendPicture(WorkerActions& actions) {
  FrameImage message{.epoch = epoch_,
                     .worker = self_,
                     .frame = frame_,
                     .attempt = attempt_,
                     .groups_done = groups_done_,
                     .group_count = group_count_,
                     .share = std::uint32_t(share_),
                     .share_count = std::uint32_t(share_count_)};
  message.picture.runs.image.format = setup_->format;
  actions.push_back(SendFrame{client_, std::move(message), image_, pixels_, straight8_, straight8_over_, setup_, pictures_, shapes_->shapes,
                              shapes_->lights});
  if (groups_done_ == group_count_) frame_sent_attempt_ = attempt_;
}

void FrameAccumulator::Drop(WorkerActions& actions) {
  std::set<ImageHandle> images;
  if (image_ != 0) images.insert(image_);
  for (const auto& [number, group] : waiting_) {
    for (const ImagePiece& piece : group.pieces) {
      if (piece.image != 0) images.insert(piece.image);
    }
  }
  for (const ImageHandle image : images) actions.push_back(ReleaseImage{image});
  image_ = 0;
  waiting_.clear();
  combining_ = 0;
}

}  // namespace slabstream
