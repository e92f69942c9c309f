#include "worker/group_run.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <string>
#include <utility>

#include "common/base/check.h"

namespace slabstream {
namespace {

void Append(std::vector<RankReport>& reports, std::vector<RankReport> more) {
  if (reports.empty()) return reports.swap(more);
  reports.insert(reports.end(), std::make_move_iterator(more.begin()), std::make_move_iterator(more.end()));
}

GroupAssignment PeersByWorker(GroupAssignment assignment) {
  if (!std::ranges::is_sorted(assignment.peers, {}, &Peer::worker)) std::ranges::sort(assignment.peers, {}, &Peer::worker);
  return assignment;
}

std::vector<Rank> RanksOf(const GroupPlan& group, WorkerId worker) {
  std::vector<Rank> ranks;
  for (Rank rank = 0; rank < group.placements.size(); ++rank) {
    if (group.placements[rank].worker == worker) ranks.push_back(rank);
  }
  return ranks;
}

}  // namespace

bool GroupRun::Arrivals::Has(const PixelRange& pixels) const {
  return std::ranges::any_of(pieces, [&](const ImagePiece& piece) { return Overlap(piece.pixels, pixels); });
}

void GroupRun::Arrivals::Add(PartialImage&& message, Bytes payload) {
  pieces.push_back({message.pixels, message.interval, 0, {message.image, std::move(message.shared), message.packed, std::move(payload)}});
  Append(reports, std::move(message.reports));
}

GroupRun::GroupRun(GroupAssignment assignment, WorkerId self, ImageNames& names)
    : assignment_(PeersByWorker(std::move(assignment))),
      self_(self),
      names_(names),
      frame_(WholeFrame(assignment_.setup)),
      runner_(MakeRunner()),
      arrivals_(runner_.order().turn_count()) {
  for (const Rank rank : runner_.order().ranks()) ranks_[rank];
}

// If the schedule does not fit the group: a runner without ranks.
GroupRun::Runner GroupRun::MakeRunner() {
  const GroupPlan& group = assignment_.group;
  Result<SharedSchedule> schedule = DeriveSchedule(group.schedule, frame_);
  if (!schedule.ok()) {
    failure_ = schedule.status();
  } else if (group.schedule.ranks != group.placements.size()) {
    Fail(fmt::format("a schedule of {} ranks does not fit {} boxes", group.schedule.ranks, group.placements.size()));
  } else {
    return {*std::move(schedule), frame_, RanksOf(group, self_)};
  }
  return {DeriveSchedule({}, frame_).value(), frame_, {}};
}

void GroupRun::OnRendered(Rank rank, ImageHandle image, RankReport report, WorkerActions& actions) {
  CHECK(Mine(rank)) << "rank " << rank;
  RankState& state = ranks_.at(rank);
  state.own = image;
  state.reports.push_back(std::move(report));
  runner_.OnRendered(rank, {{rank, rank + 1}, image});
  Advance(actions);
}

void GroupRun::LeaveOut(Rank rank, RankReport report, WorkerActions& actions) {
  const ImageHandle image = names_.Next();
  Start({.image = image, .incoming = {.header = {.format = assignment_.setup.format}}}, rank, actions);
  OnRendered(rank, image, std::move(report), actions);
}

void GroupRun::OnPartial(PartialImage message, Bytes payload, WorkerActions& actions) {
  const GroupPlan& group = assignment_.group;
  if (!failure_.ok() || group.placements.empty() || PixelCount(message.pixels) == 0) return;
  if (message.step == step_count()) return CollectGroupPiece(std::move(message), std::move(payload));
  const std::optional<std::uint32_t> turn = runner_.order().Awaited(message.step);
  if (!turn) return;
  const Step& step = runner_.order().schedule().steps()[message.step];
  const bool inside = message.pixels.begin >= step.pixels.begin && message.pixels.end <= step.pixels.end;
  if (WorkerOf(step.from) != message.from_worker || !inside) return;
  if (arrivals_[*turn].Has(message.pixels)) return;
  runner_.order().OnArrived(message.step, PixelCount(message.pixels));
  arrivals_[*turn].Add(std::move(message), std::move(payload));
  Advance(actions);
}

void GroupRun::OnCombined(const CombineDone& done, WorkerActions& actions) {
  const auto started = std::ranges::find(combining_, done.image, &std::pair<ImageHandle, Rank>::first);
  if (started == combining_.end()) return;
  const Rank number = started->second;
  combining_.erase(started);
  RankState& rank = ranks_.at(number);
  runner_.order().OnCombined(number);
  if (!done.status.ok()) {
    if (failure_.ok()) failure_ = done.status;
    return;
  }
  const auto own = std::ranges::find(rank.reports, number, &RankReport::rank);
  if (own != rank.reports.end()) AddStage(*own, Stage::kCombine, done.span.begin_ns, done.span.end_ns);
  Advance(actions);
}

std::optional<GroupImage> GroupRun::TakeGroupImage() {
  if (!failure_.ok() || group_image_taken_ || assignment_.display != self_) return std::nullopt;
  const bool empty = assignment_.group.placements.empty();
  if (!empty && group_pixels_ != PixelCount(frame_)) return std::nullopt;
  group_image_taken_ = true;
  return GroupImage{key(), std::move(group_pieces_.pieces), std::move(group_pieces_.reports)};
}

bool GroupRun::finished() const {
  if (!combining_.empty() || (assignment_.display == self_ && !group_image_taken_)) return false;
  return std::ranges::all_of(runner_.held(), [&](const auto& rank) { return runner_.order().Done(rank.first) && rank.second.empty(); });
}

void GroupRun::Drop(WorkerActions& actions) {
  std::vector<Held> held;
  for (const auto& [rank, state] : ranks_) {
    const std::vector<Held> of_rank = runner_.held(rank).Take(frame_);
    held.insert(held.end(), of_rank.begin(), of_rank.end());
  }
  for (const ImagePiece& piece : group_pieces_.pieces) {
    if (piece.image != 0) held.push_back({piece.pixels, {piece.ranks, piece.image}});
  }
  ReleaseUnused(held, actions);
  ranks_.clear();
  arrivals_.clear();
  combining_.clear();
  group_pieces_ = {};
}

void GroupRun::Advance(WorkerActions& actions) {
  while (failure_.ok()) {
    std::optional<Runner::Taken> taken = runner_.TakeNext();
    if (!taken) return FinishRoot(actions);
    if (taken->kind == StepOrder::Kind::kReceive) {
      Receive(*taken, actions);
      continue;
    }
    const Step& step = *taken->step;
    if (const std::uint64_t held = PixelCount(taken->parts); held != PixelCount(step.pixels)) {
      Fail(fmt::format("rank {} is to send {} pixels in step {} but holds {} of them", step.from, PixelCount(step.pixels), taken->index,
                       held));
      for (const Held& part : taken->parts) runner_.held(step.from).Put(part);  // Drop releases them
    } else if (taken->kind == StepOrder::Kind::kSend) {
      SendFragments(step.from, taken->parts, taken->index, WorkerOf(step.to), TakeReports(step.from), actions);
      ReleaseUnused(taken->parts, actions);
    } else {
      MoveLocally(*taken, actions);
    }
  }
}

void GroupRun::MoveLocally(const Runner::Taken& taken, WorkerActions& actions) {
  const Step& step = *taken.step;
  for (const Held& part : taken.parts) Merge(step.to, {part.pixels, part.value.ranks, part.value.image, {}}, actions);
  ReleaseUnused(taken.parts, actions);
  Append(ranks_.at(step.to).reports, TakeReports(step.from));
}

void GroupRun::Receive(const Runner::Taken& taken, WorkerActions& actions) {
  Arrivals& arrivals = arrivals_[taken.turn];
  for (; arrivals.taken < arrivals.pieces.size(); ++arrivals.taken) {
    Merge(taken.step->to, std::move(arrivals.pieces[arrivals.taken]), actions);
  }
  Append(ranks_.at(taken.step->to).reports, std::exchange(arrivals.reports, {}));
  if (taken.last) arrivals = {};
}

void GroupRun::Merge(Rank rank, ImagePiece&& piece, WorkerActions& actions) {
  // The usual case: the piece goes straight into the only image.
  if (const Held* only = runner_.held(rank).Find(piece.pixels); only != nullptr && piece.image == 0) {
    return Combine(rank, Held(*only), piece, std::move(piece.incoming), actions);
  }
  const std::vector<Held> held = runner_.held(rank).Within(piece.pixels);
  if (held.empty() && ComesHome(rank, piece)) return TakeHome(rank, std::move(piece), actions);
  const bool incoming = piece.image == 0;
  if (incoming) {
    piece.image = names_.Next();
    Start({.image = piece.image, .incoming = std::move(piece.incoming), .pixels = piece.pixels}, rank, actions);
  }
  std::uint64_t gap_begin = piece.pixels.begin;
  const auto take_gap = [&](std::uint64_t end) {
    if (gap_begin < end) runner_.held(rank).Put({{gap_begin, end}, {piece.ranks, piece.image}});
  };
  for (const Held& part : held) {
    take_gap(part.pixels.begin);
    gap_begin = part.pixels.end;
    Combine(rank, part, piece, {}, actions);
  }
  take_gap(piece.pixels.end);
  if (incoming) ReleaseUnused({{piece.pixels, {piece.ranks, piece.image}}}, actions);
}

// True if the rank passed these pixels on before and now gets them back, combined with others: then their reader has finished, and their
// place in the rank's own image is free.
bool GroupRun::ComesHome(Rank rank, const ImagePiece& piece) const {
  const ImageHandle own = ranks_.at(rank).own;
  return own != 0 && piece.image != own && piece.ranks.begin <= rank && rank < piece.ranks.end && Uses(rank, own);
}

void GroupRun::TakeHome(Rank rank, ImagePiece&& piece, WorkerActions& actions) {
  const ImageHandle own = ranks_.at(rank).own;
  Start({.image = own,
         .other = piece.image,
         .incoming = std::move(piece.incoming),
         .replace = true,
         .pixels = piece.pixels,
         .ranks = piece.ranks},
        rank, actions);
  runner_.held(rank).Put({piece.pixels, {piece.ranks, own}});
}

void GroupRun::Combine(Rank rank, const Held& held, const ImagePiece& piece, IncomingImage&& incoming, WorkerActions& actions) {
  const std::optional<RankInterval> both = Joined(piece.ranks, held.value.ranks);
  if (!both) {
    return Fail(fmt::format("images of ranks [{}, {}) and [{}, {}) are to be combined, which are not adjacent", piece.ranks.begin,
                            piece.ranks.end, held.value.ranks.begin, held.value.ranks.end));
  }
  Start({.image = held.value.image,
         .other = piece.image,
         .incoming = std::move(incoming),
         .side = piece.ranks.end == held.value.ranks.begin ? Side::kFront : Side::kBack,
         .pixels = held.pixels == frame_ ? PixelRange{} : held.pixels,
         .ranks = piece.ranks},
        rank, actions);
  runner_.held(rank).Replace({held.pixels, {*both, held.value.image}});
}

void GroupRun::Start(StartCombine&& combine, Rank rank, WorkerActions& actions) {
  combine.key = key();
  combine.frame = FrameBounds(assignment_.setup);
  combining_.emplace_back(combine.image, rank);
  runner_.order().OnCombineStarted(rank);
  actions.push_back(std::move(combine));
}

void GroupRun::FinishRoot(WorkerActions& actions) {
  if (root_done_ || !Mine(root()) || !runner_.order().Done(root())) return;
  root_done_ = true;
  const std::vector<Held> parts = runner_.held(root()).Take(frame_);
  const RankInterval all{0, assignment_.group.schedule.ranks};
  std::uint64_t held = 0;
  for (const Held& part : parts) held += part.value.ranks == all ? PixelCount(part.pixels) : 0;
  if (held != PixelCount(frame_)) {
    for (const Held& part : parts) runner_.held(root()).Put(part);  // Drop releases them
    return Fail(fmt::format("the schedule is over, but the root holds only {} of {} pixels of all ranks", held, PixelCount(frame_)));
  }
  if (assignment_.display != self_) {
    SendFragments(root(), parts, step_count(), assignment_.display, TakeReports(root()), actions);
    ReleaseUnused(parts, actions);
    return;
  }
  for (const Held& part : parts) group_pieces_.pieces.push_back({part.pixels, part.value.ranks, part.value.image, {}});
  Append(group_pieces_.reports, TakeReports(root()));
  group_pixels_ = held;
}

void GroupRun::CollectGroupPiece(PartialImage&& message, Bytes payload) {
  const bool from_root = WorkerOf(root()) == message.from_worker && !Mine(root());
  const bool whole = message.interval == RankInterval{0, assignment_.group.schedule.ranks};
  if (assignment_.display != self_ || !from_root || !whole || message.pixels.end > frame_.end) return;
  if (group_image_taken_ || group_pieces_.Has(message.pixels)) return;
  group_pixels_ += PixelCount(message.pixels);
  group_pieces_.Add(std::move(message), std::move(payload));
}

void GroupRun::SendFragments(Rank rank, const std::vector<Held>& fragments, std::uint32_t step, WorkerId to,
                             std::vector<RankReport> reports, WorkerActions& actions) {
  const Peer* peer = FindPeer(to);
  if (peer == nullptr) return Fail(fmt::format("worker {} takes part in the group but has no endpoint in it", to));
  for (const Held& fragment : fragments) {
    actions.push_back(SendPartial{.to = *peer,
                                  .message = {.epoch = assignment_.epoch,
                                              .from_worker = self_,
                                              .key = key(),
                                              .step = step,
                                              .interval = fragment.value.ranks,
                                              .pixels = fragment.pixels},
                                  .image = fragment.value.image,
                                  .frame = FrameBounds(assignment_.setup),
                                  .color = assignment_.group.color,
                                  .rank = rank});
  }
  if (!fragments.empty()) std::get<SendPartial>(actions.back()).message.reports = std::move(reports);
}

bool GroupRun::Uses(Rank rank, ImageHandle image) const {
  return std::ranges::any_of(runner_.held().at(rank).list(), [&](const Held& part) { return part.value.image == image; });
}

// Releases the images of taken fragments, once each, unless other fragments still use them.
void GroupRun::ReleaseUnused(const std::vector<Held>& taken, WorkerActions& actions) {
  std::vector<ImageHandle> images;
  images.reserve(taken.size());
  for (const Held& part : taken) images.push_back(part.value.image);
  std::ranges::sort(images);
  images.erase(std::unique(images.begin(), images.end()), images.end());
  for (const ImageHandle image : images) {
    if (std::ranges::none_of(ranks_, [&](const auto& rank) { return Uses(rank.first, image); })) actions.push_back(ReleaseImage{image});
  }
}

// Reports leave with the rank's last pixels, so that they include all its combining.
std::vector<RankReport> GroupRun::TakeReports(Rank rank) {
  return runner_.order().HasOpenSteps(rank) ? std::vector<RankReport>() : std::exchange(ranks_.at(rank).reports, {});
}

const Peer* GroupRun::FindPeer(WorkerId worker) const {
  const auto found = std::ranges::lower_bound(assignment_.peers, worker, {}, &Peer::worker);
  return found == assignment_.peers.end() || found->worker != worker ? nullptr : &*found;
}

void GroupRun::Fail(std::string why) {
  if (failure_.ok()) failure_ = Status::Internal(std::move(why));
}

}  // namespace slabstream
