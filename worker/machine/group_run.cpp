#include "worker/machine/group_run.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <iterator>
#include <ranges>
#include <string>

#include "common/base/check.h"

namespace slabstream {
namespace {

void Append(std::vector<RankReport>& reports, std::vector<RankReport> more) {
  if (reports.empty()) return reports.swap(more);
  reports.insert(reports.end(), std::make_move_iterator(more.begin()), std::make_move_iterator(more.end()));
}

std::shared_ptr<const std::vector<Peer>> ByWorker(std::vector<Peer> peers) {
  if (!std::ranges::is_sorted(peers, {}, &Peer::worker)) std::ranges::sort(peers, {}, &Peer::worker);
  return std::make_shared<const std::vector<Peer>>(std::move(peers));
}

ImagePiece PieceOf(PartialImage& message, const Bytes& payload) {
  ImagePiece piece{message.pixels, message.interval, 0, {}};
  if (message.image != RunImageHeader{} || message.shared || message.packed || !payload.empty()) {
    piece.incoming = IncomingImage{message.image, std::move(message.shared), std::move(message.packed), payload};
  }
  return piece;
}

std::vector<WorkerId> WorkersOf(const GroupPlan& group) {
  std::vector<WorkerId> workers;
  for (const Placement& placement : group.placements) workers.push_back(placement.worker);
  return workers;
}

std::vector<Rank> RanksOf(const GroupPlan& group, WorkerId worker) {
  std::vector<Rank> ranks;
  for (Rank rank = 0; rank < group.placements.size(); ++rank) {
    if (group.placements[rank].worker == worker) ranks.push_back(rank);
  }
  return ranks;
}

}  // namespace

GroupRun::GroupRun(GroupAssignment assignment, WorkerId self, ImageNames& names)
    : peers_(ByWorker(std::exchange(assignment.peers, {}))),
      assignment_(std::move(assignment)),
      workers_(WorkersOf(assignment_.group)),
      self_(self),
      names_(names),
      frame_(WholeFrame(assignment_.setup)),
      runner_(MakeRunner()),
      displayed_(ShareOf(assignment_.group, assignment_.display, self)),
      group_image_{key(), {}, {}} {
  for (const Rank rank : runner_.order().ranks()) ranks_[rank];
  const std::vector<Rank>& roots = assignment_.group.schedule.roots;
  for (std::size_t share = 0; share < roots.size(); ++share) {
    if (Mine(roots[share])) unfinished_.push_back(share);
  }
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
  state.reports.insert(state.reports.begin(), std::move(report));
  runner_.OnRendered(rank, {{rank, rank + 1}, image});
  Advance(actions);
}

void GroupRun::LeaveOut(Rank rank, RankReport report, WorkerActions& actions) {
  const ImageHandle image = names_.Next();
  Start({.image = image, .incoming = IncomingImage{.header = {.format = assignment_.setup.format}}}, rank, actions);
  OnRendered(rank, image, std::move(report), actions);
}

void GroupRun::OnPartial(PartialImage&& message, const Bytes& payload, WorkerActions& actions) {
  const GroupPlan& group = assignment_.group;
  if (!failure_.ok() || group.placements.empty() || PixelCount(message.pixels) == 0) return;
  if (message.image.format != assignment_.setup.format) return;  // such pixels combine with no others of the frame
  if (message.step == step_count()) return CollectGroupPiece(std::move(message), payload);
  const std::optional<std::uint32_t> turn = runner_.order().Awaited(message.step);
  if (!turn) return;
  const Step& step = runner_.order().schedule().steps()[message.step];
  const bool inside = message.pixels.begin >= step.pixels.begin && message.pixels.end <= step.pixels.end;
  if (WorkerOf(step.from) != message.from_worker || !inside) return;
  const auto [begin, end] = arrivals_.equal_range(*turn);
  if (std::any_of(begin, end, [&](const auto& known) { return Overlap(known.second.piece.pixels, message.pixels); })) return;
  runner_.order().OnArrived(*turn, PixelCount(message.pixels));
  arrivals_.emplace_hint(end, *turn, Arrival{PieceOf(message, payload)});
  if (!message.reports.empty()) Append(ranks_.at(step.to).reports, std::move(message.reports));
  Advance(actions);
}

bool GroupRun::OnCombined(const CombineDone& done, WorkerActions& actions) {
  const auto started = std::ranges::find(combining_, done.image, &std::pair<ImageHandle, Rank>::first);
  if (started == combining_.end()) return false;
  const Rank number = started->second;
  combining_.erase(started);
  RankState& rank = ranks_.at(number);
  runner_.order().OnCombined(number);
  if (!done.status.ok()) {
    if (failure_.ok()) failure_ = done.status;
    return true;
  }
  if (!rank.reports.empty() && rank.reports.front().rank == number) {
    AddStage(rank.reports.front(), Stage::kCombine, done.span.begin_ns, done.span.end_ns);
  }
  Advance(actions);
  return true;
}

std::optional<GroupImage> GroupRun::TakeGroupImage() {
  if (!failure_.ok() || group_image_taken_ || !displayed_) return std::nullopt;
  const bool empty = assignment_.group.placements.empty();
  if (!empty && group_pixels_ != PixelCount(PixelsOf(*displayed_))) return std::nullopt;
  group_image_taken_ = true;
  return std::move(group_image_);
}

bool GroupRun::finished() const {
  if (!combining_.empty() || (displayed_ && !group_image_taken_)) return false;
  return std::ranges::all_of(runner_.held(), [&](const auto& rank) { return runner_.order().Done(rank.first) && rank.second.empty(); });
}

void GroupRun::Drop(WorkerActions& actions) {
  std::vector<Held> held;
  for (const auto& [rank, state] : ranks_) {
    const std::vector<Held> of_rank = runner_.held(rank).Take(frame_);
    held.insert(held.end(), of_rank.begin(), of_rank.end());
  }
  for (const ImagePiece& piece : group_image_.pieces) {
    if (piece.image != 0) held.push_back({piece.pixels, {piece.ranks, piece.image}});
  }
  ReleaseUnused(held, actions);
  ranks_.clear();
  arrivals_.clear();
  combining_.clear();
  group_image_ = {};
}

void GroupRun::Advance(WorkerActions& actions) {
  while (failure_.ok()) {
    std::optional<Runner::Taken> taken = runner_.TakeNext();
    if (!taken) return FinishShares(actions);
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
  const auto [begin, end] = arrivals_.equal_range(taken.turn);
  for (Arrival& arrival : std::ranges::subrange(begin, end) | std::views::values) {
    if (!std::exchange(arrival.taken, true)) Merge(taken.rank, std::move(arrival.piece), actions);
  }
  if (taken.last) arrivals_.erase(begin, end);
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
  if (incoming) ReleaseUnused(std::array{Held{piece.pixels, {piece.ranks, piece.image}}}, actions);
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

void GroupRun::Combine(Rank rank, const Held& held, const ImagePiece& piece, Rare<IncomingImage>&& incoming, WorkerActions& actions) {
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
  combine.client = assignment_.client;
  combine.key = key();
  combine.frame = FrameBounds(assignment_.setup);
  combining_.emplace_back(combine.image, rank);
  runner_.order().OnCombineStarted(rank);
  actions.push_back(std::move(combine));
}

PixelRange GroupRun::PixelsOf(std::size_t share) const { return Share(frame_, share, assignment_.group.schedule.roots.size()); }

void GroupRun::FinishShares(WorkerActions& actions) {
  std::erase_if(unfinished_, [&](std::size_t share) {
    if (!runner_.order().Done(RootOf(share))) return false;
    FinishShare(share, actions);
    return true;
  });
}

void GroupRun::FinishShare(std::size_t share, WorkerActions& actions) {
  const Rank root = RootOf(share);
  const std::uint64_t expected = PixelCount(PixelsOf(share));
  const std::vector<Held> parts = runner_.held(root).Take(PixelsOf(share));
  const RankInterval all{0, assignment_.group.schedule.ranks};
  std::uint64_t held = 0;
  for (const Held& part : parts) held += part.value.ranks == all ? PixelCount(part.pixels) : 0;
  if (held != expected) {
    for (const Held& part : parts) runner_.held(root).Put(part);  // Drop releases them
    return Fail(fmt::format("the schedule is over, but its root {} holds only {} of {} pixels of all ranks", root, held, expected));
  }
  if (!displayed_) {
    SendFragments(root, parts, step_count(), assignment_.display, TakeReports(root), actions);
    ReleaseUnused(parts, actions);
    return;
  }
  for (const Held& part : parts) group_image_.pieces.push_back({part.pixels, part.value.ranks, part.value.image, {}});
  Append(group_image_.reports, TakeReports(root));
  group_pixels_ += held;
}

void GroupRun::CollectGroupPiece(PartialImage&& message, const Bytes& payload) {
  const bool from_root = displayed_ && WorkerOf(RootOf(*displayed_)) == message.from_worker && !Mine(RootOf(*displayed_));
  const bool whole = message.interval == RankInterval{0, assignment_.group.schedule.ranks};
  if (!from_root || !whole || message.pixels.end > frame_.end) return;
  const auto known = [&](const ImagePiece& piece) { return Overlap(piece.pixels, message.pixels); };
  if (group_image_taken_ || std::ranges::any_of(group_image_.pieces, known)) return;
  group_pixels_ += PixelCount(message.pixels);
  group_image_.pieces.push_back(PieceOf(message, payload));
  Append(group_image_.reports, std::move(message.reports));
}

void GroupRun::SendFragments(Rank rank, std::span<const Held> fragments, std::uint32_t step, WorkerId to, std::vector<RankReport> reports,
                             WorkerActions& actions) {
  const Peer* peer = FindPeer(to);
  if (peer == nullptr) return Fail(fmt::format("worker {} takes part in the group but has no endpoint in it", to));
  for (const Held& fragment : fragments) {
    actions.push_back(SendPartial{.client = assignment_.client,
                                  .to = {peers_, peer},
                                  .message = {.epoch = assignment_.epoch,
                                              .from_worker = self_,
                                              .key = key(),
                                              .step = step,
                                              .interval = fragment.value.ranks,
                                              .pixels = fragment.pixels,
                                              .image = {.format = assignment_.setup.format}},
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
void GroupRun::ReleaseUnused(std::span<const Held> taken, WorkerActions& actions) {
  const auto release = [&](ImageHandle image) {
    if (std::ranges::none_of(ranks_, [&](const auto& rank) { return Uses(rank.first, image); })) actions.push_back(ReleaseImage{image});
  };
  if (taken.size() == 1) return release(taken.front().value.image);
  std::vector<ImageHandle> images;
  images.reserve(taken.size());
  for (const Held& part : taken) images.push_back(part.value.image);
  std::ranges::sort(images);
  images.erase(std::unique(images.begin(), images.end()), images.end());
  std::ranges::for_each(images, release);
}

// Reports leave with the rank's last pixels, so that they include all its combining.
std::vector<RankReport> GroupRun::TakeReports(Rank rank) {
  return runner_.order().HasOpenSteps(rank) ? std::vector<RankReport>() : std::exchange(ranks_.at(rank).reports, {});
}

const Peer* GroupRun::FindPeer(WorkerId worker) const {
  const auto found = std::ranges::lower_bound(*peers_, worker, {}, &Peer::worker);
  return found == peers_->end() || found->worker != worker ? nullptr : &*found;
}

void GroupRun::Fail(std::string why) {
  if (failure_.ok()) failure_ = Status::Internal(std::move(why));
}

}  // namespace slabstream
