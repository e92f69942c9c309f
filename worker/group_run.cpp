#include "worker/group_run.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <string>
#include <utility>

#include "common/base/check.h"

namespace slabstream {
namespace {

std::string Text(const RankInterval& ranks) { return fmt::format("[{}, {})", ranks.begin, ranks.end); }

// False if some of `pixels` has been seen: a duplicate.
bool Remember(std::vector<PixelRange>& seen, const PixelRange& pixels) {
  if (std::any_of(seen.begin(), seen.end(), [&](const PixelRange& old) { return Overlap(old, pixels); })) return false;
  seen.push_back(pixels);
  return true;
}

void Append(std::vector<RankReport>& reports, std::vector<RankReport> more) {
  reports.insert(reports.end(), std::make_move_iterator(more.begin()), std::make_move_iterator(more.end()));
}

}  // namespace

GroupRun::GroupRun(GroupAssignment assignment, WorkerId self, ImageNames& names)
    : assignment_(std::move(assignment)), self_(self), names_(names), frame_(WholeFrame(assignment_.setup)) {
  const GroupPlan& group = assignment_.group;
  if (group.placements.empty()) return;
  if (group.schedule.ranks != group.placements.size() || group.schedule.root >= group.schedule.ranks) {
    Fail(fmt::format("a schedule of {} ranks with root {} does not fit {} boxes", group.schedule.ranks, group.schedule.root,
                     group.placements.size()));
    return;
  }
  for (Rank rank = 0; rank < group.schedule.ranks; ++rank) {
    if (group.placements[rank].worker == self_) ranks_[rank];
  }
  for (std::uint32_t i = 0; i < group.schedule.steps.size(); ++i) {
    const Step& step = group.schedule.steps[i];
    if (step.from >= group.schedule.ranks || step.to >= group.schedule.ranks || step.from == step.to) {
      Fail(fmt::format("step {} goes from rank {} to rank {} of {}", i, step.from, step.to, group.schedule.ranks));
      return;
    }
    if (PixelCount(step.pixels) == 0) continue;
    for (const Rank rank : {step.from, step.to}) {
      if (const auto mine = ranks_.find(rank); mine != ranks_.end()) mine->second.open_steps.push_back(i);
    }
  }
}

void GroupRun::OnRendered(Rank rank, ImageHandle image, RankReport report, WorkerActions& actions) {
  const auto mine = ranks_.find(rank);
  CHECK(mine != ranks_.end() && !mine->second.rendered) << "rank " << rank;
  mine->second.rendered = true;
  mine->second.own = image;
  mine->second.fragments.Insert({frame_, {rank, rank + 1}, image});
  mine->second.reports.push_back(std::move(report));
  Advance(actions);
}

void GroupRun::LeaveOut(Rank rank, RankReport report, WorkerActions& actions) {
  RunImageHeader nothing;
  nothing.format = assignment_.setup.format;
  const ImageHandle image = names_.Next();
  Start({.image = image, .incoming = {.header = nothing}}, ranks_.at(rank), rank, actions);
  OnRendered(rank, image, std::move(report), actions);
}

void GroupRun::OnPartial(const PartialImage& message, Bytes payload, WorkerActions& actions) {
  const GroupPlan& group = assignment_.group;
  if (!failure_.ok() || group.placements.empty() || PixelCount(message.pixels) == 0) return;
  if (message.step == group.schedule.steps.size()) {
    CollectGroupPiece(message, std::move(payload));
    return;
  }
  if (message.step > group.schedule.steps.size()) return;
  const Step& step = group.schedule.steps[message.step];
  const bool inside = message.pixels.begin >= step.pixels.begin && message.pixels.end <= step.pixels.end;
  if (!Mine(step.to) || Mine(step.from) || group.placements[step.from].worker != message.from_worker || !inside) return;
  Arrivals& arrivals = arrivals_[message.step];
  if (!Remember(arrivals.seen, message.pixels)) return;
  arrivals.waiting.push_back({message.pixels, message.interval, 0, {message.image, message.shared, message.packed, std::move(payload)}});
  Append(arrivals.reports, message.reports);
  Advance(actions);
}

void GroupRun::OnCombined(const CombineDone& done, WorkerActions& actions) {
  const auto started = std::find_if(combining_.begin(), combining_.end(), [&](const auto& combine) { return combine.first == done.image; });
  if (started == combining_.end()) return;
  const Rank number = started->second;
  combining_.erase(started);
  RankState& rank = ranks_.at(number);
  --rank.combining;
  if (!done.status.ok()) {
    if (failure_.ok()) failure_ = done.status;
    return;
  }
  const auto own = std::find_if(rank.reports.begin(), rank.reports.end(), [&](const RankReport& r) { return r.rank == number; });
  if (own != rank.reports.end()) {
    own->stage_ns[static_cast<int>(Stage::kCombine)] += done.span.end_ns - done.span.begin_ns;
    if (own->spans.size() < std::size_t(kMaxSpans)) own->spans.push_back(done.span);
  }
  Advance(actions);
}

std::optional<GroupImage> GroupRun::TakeGroupImage() {
  if (!failure_.ok() || group_image_taken_ || assignment_.display != self_) return std::nullopt;
  const bool empty = assignment_.group.placements.empty();
  if (!empty && group_pieces_.merged != PixelCount(frame_)) return std::nullopt;
  group_image_taken_ = true;
  return GroupImage{key(), std::move(group_pieces_.waiting), std::move(group_pieces_.reports)};
}

bool GroupRun::finished() const {
  if (!combining_.empty() || (assignment_.display == self_ && !group_image_taken_)) return false;
  return std::all_of(ranks_.begin(), ranks_.end(), [](const auto& entry) {
    const RankState& rank = entry.second;
    return rank.rendered && rank.open_steps.empty() && rank.fragments.empty();
  });
}

void GroupRun::Drop(WorkerActions& actions) {
  std::vector<Fragment> held;
  for (auto& [number, rank] : ranks_) {
    const std::vector<Fragment> of_rank = rank.fragments.Take(frame_);
    held.insert(held.end(), of_rank.begin(), of_rank.end());
  }
  for (const ImagePiece& piece : group_pieces_.waiting) {
    if (piece.image != 0) held.push_back({piece.pixels, piece.ranks, piece.image});
  }
  ReleaseUnused(std::move(held), actions);
  ranks_.clear();
  arrivals_.clear();
  combining_.clear();
  group_pieces_ = {};
}

bool GroupRun::Ready(const RankState& rank, std::uint32_t step) const {
  if (!rank.rendered || rank.combining > 0) return false;
  const std::vector<Step>& steps = assignment_.group.schedule.steps;
  for (const std::uint32_t earlier : rank.open_steps) {
    if (earlier == step) return true;
    if (Overlap(steps[earlier].pixels, steps[step].pixels)) return false;
  }
  return false;  // taken already
}

void GroupRun::Advance(WorkerActions& actions) {
  bool progress = true;
  while (progress && failure_.ok()) {
    progress = false;
    for (auto& [number, rank] : ranks_) {
      const std::vector<std::uint32_t> candidates = rank.open_steps;
      for (const std::uint32_t step : candidates) {
        if (!failure_.ok()) return;
        if (Ready(rank, step)) progress |= TakeStep(number, step, actions);
      }
    }
  }
  if (failure_.ok()) FinishRoot(actions);
}

bool GroupRun::TakeStep(Rank rank, std::uint32_t index, WorkerActions& actions) {
  const Step& step = assignment_.group.schedule.steps[index];
  if (rank == step.to && !Mine(step.from)) return Receive(ranks_.at(rank), rank, index, actions);
  if (rank == step.to) return false;  // taken from the sender's side
  RankState& from = ranks_.at(rank);
  std::uint64_t held = 0;
  for (const Fragment& part : from.fragments.Within(step.pixels)) held += PixelCount(part.pixels);
  if (held != PixelCount(step.pixels)) {
    Fail(fmt::format("rank {} is to send {} pixels in step {} but holds {} of them", rank, PixelCount(step.pixels), index, held));
    return false;
  }
  if (!Mine(step.to)) {
    Send(from, rank, index, actions);
    return true;
  }
  RankState& to = ranks_.at(step.to);
  if (!Ready(to, index)) return false;
  MoveLocally(from, to, index, actions);
  return true;
}

void GroupRun::Send(RankState& from, Rank rank, std::uint32_t index, WorkerActions& actions) {
  const Step& step = assignment_.group.schedule.steps[index];
  std::erase(from.open_steps, index);
  const std::vector<Fragment> parts = from.fragments.Take(step.pixels);
  SendFragments(rank, parts, index, assignment_.group.placements[step.to].worker, TakeReports(from), actions);
  ReleaseUnused(parts, actions);
}

void GroupRun::MoveLocally(RankState& from, RankState& to, std::uint32_t index, WorkerActions& actions) {
  const Step& step = assignment_.group.schedule.steps[index];
  std::erase(from.open_steps, index);
  std::erase(to.open_steps, index);
  const std::vector<Fragment> parts = from.fragments.Take(step.pixels);
  for (const Fragment& part : parts) Merge(to, step.to, {part.pixels, part.ranks, part.image, {}}, actions);
  ReleaseUnused(parts, actions);
  Append(to.reports, TakeReports(from));
}

bool GroupRun::Receive(RankState& to, Rank rank, std::uint32_t index, WorkerActions& actions) {
  Arrivals& arrivals = arrivals_[index];
  if (arrivals.waiting.empty()) return false;
  for (ImagePiece& piece : std::exchange(arrivals.waiting, {})) {
    arrivals.merged += PixelCount(piece.pixels);
    Merge(to, rank, std::move(piece), actions);
  }
  Append(to.reports, std::exchange(arrivals.reports, {}));
  if (arrivals.merged == PixelCount(assignment_.group.schedule.steps[index].pixels)) std::erase(to.open_steps, index);
  return true;
}

void GroupRun::Merge(RankState& to, Rank rank, ImagePiece piece, WorkerActions& actions) {
  const std::vector<Fragment> held = to.fragments.Within(piece.pixels);
  // The usual case: it goes straight into the one image that is there.
  if (piece.image == 0 && held.size() == 1 && held[0].pixels == piece.pixels) return Combine(to, rank, held[0], piece, actions);
  if (held.empty() && ComesHome(to, rank, piece)) return TakeHome(to, rank, std::move(piece), actions);
  const bool incoming = piece.image == 0;
  if (incoming) {
    piece.image = names_.Next();
    Start({.image = piece.image, .incoming = std::move(piece.incoming), .pixels = piece.pixels}, to, rank, actions);
  }
  std::uint64_t gap_begin = piece.pixels.begin;
  const auto take_gap = [&](std::uint64_t end) {
    if (gap_begin < end) to.fragments.Insert({{gap_begin, end}, piece.ranks, piece.image});
  };
  for (const Fragment& part : held) {
    take_gap(part.pixels.begin);
    gap_begin = part.pixels.end;
    Combine(to, rank, part, piece, actions);
  }
  take_gap(piece.pixels.end);
  if (incoming) ReleaseUnused({{piece.pixels, piece.ranks, piece.image}}, actions);
}

// True if the rank passed these pixels on before and gets them back now, combined with others': then whoever read them has done so, and
// their place in the rank's own image is free.
bool GroupRun::ComesHome(const RankState& to, Rank rank, const ImagePiece& piece) const {
  return to.own != 0 && piece.image != to.own && piece.ranks.begin <= rank && rank < piece.ranks.end && to.fragments.Uses(to.own);
}

void GroupRun::TakeHome(RankState& to, Rank rank, ImagePiece piece, WorkerActions& actions) {
  Start({.image = to.own, .other = piece.image, .incoming = std::move(piece.incoming), .replace = true, .pixels = piece.pixels}, to, rank,
        actions);
  to.fragments.Insert({piece.pixels, piece.ranks, to.own});
}

void GroupRun::Combine(RankState& to, Rank rank, const Fragment& held, const ImagePiece& piece, WorkerActions& actions) {
  const bool in_front = piece.ranks.end == held.ranks.begin;
  if (!in_front && held.ranks.end != piece.ranks.begin) {
    return Fail(fmt::format("images of ranks {} and {} are to be combined, which are not adjacent", Text(piece.ranks), Text(held.ranks)));
  }
  Start({.image = held.image,
         .other = piece.image,
         .incoming = piece.incoming,
         .side = in_front ? Side::kFront : Side::kBack,
         .pixels = held.pixels == frame_ ? PixelRange{} : held.pixels},
        to, rank, actions);
  to.fragments.Take(held.pixels);
  to.fragments.Insert(
      {held.pixels, {std::min(piece.ranks.begin, held.ranks.begin), std::max(piece.ranks.end, held.ranks.end)}, held.image});
}

void GroupRun::Start(StartCombine combine, RankState& to, Rank rank, WorkerActions& actions) {
  combine.key = key();
  combine.frame = FrameBounds(assignment_.setup);
  combining_.emplace_back(combine.image, rank);
  ++to.combining;
  actions.push_back(std::move(combine));
}

void GroupRun::FinishRoot(WorkerActions& actions) {
  const Rank root = assignment_.group.schedule.root;
  const auto mine = ranks_.find(root);
  if (root_done_ || mine == ranks_.end()) return;
  RankState& rank = mine->second;
  if (!rank.rendered || rank.combining > 0 || !rank.open_steps.empty()) return;
  root_done_ = true;
  const std::vector<Fragment> parts = rank.fragments.Take(frame_);
  const RankInterval all{0, assignment_.group.schedule.ranks};
  std::uint64_t held = 0;
  for (const Fragment& part : parts) held += part.ranks == all ? PixelCount(part.pixels) : 0;
  if (held != PixelCount(frame_)) {
    for (const Fragment& part : parts) rank.fragments.Insert(part);  // Drop releases them
    return Fail(fmt::format("the schedule is over, but the root holds only {} of {} pixels of all ranks", held, PixelCount(frame_)));
  }
  if (assignment_.display != self_) {
    SendFragments(root, parts, std::uint32_t(assignment_.group.schedule.steps.size()), assignment_.display, TakeReports(rank), actions);
    ReleaseUnused(parts, actions);
    return;
  }
  for (const Fragment& part : parts) group_pieces_.waiting.push_back({part.pixels, part.ranks, part.image, {}});
  Append(group_pieces_.reports, TakeReports(rank));
  group_pieces_.merged = held;
}

void GroupRun::CollectGroupPiece(const PartialImage& message, Bytes payload) {
  const GroupPlan& group = assignment_.group;
  const bool from_root = group.placements[group.schedule.root].worker == message.from_worker && !Mine(group.schedule.root);
  const bool whole = message.interval == RankInterval{0, group.schedule.ranks};
  if (assignment_.display != self_ || !from_root || !whole || message.pixels.end > frame_.end) return;
  if (group_image_taken_ || !Remember(group_pieces_.seen, message.pixels)) return;
  group_pieces_.waiting.push_back(
      {message.pixels, message.interval, 0, {message.image, message.shared, message.packed, std::move(payload)}});
  group_pieces_.merged += PixelCount(message.pixels);
  Append(group_pieces_.reports, message.reports);
}

void GroupRun::SendFragments(Rank rank, const std::vector<Fragment>& fragments, std::uint32_t step, WorkerId to,
                             std::vector<RankReport> reports, WorkerActions& actions) {
  const Peer* peer = FindPeer(to);
  if (peer == nullptr) return Fail(fmt::format("worker {} takes part in the group but has no endpoint in it", to));
  for (const Fragment& fragment : fragments) {
    PartialImage message;
    message.epoch = assignment_.epoch;
    message.from_worker = self_;
    message.key = key();
    message.step = step;
    message.interval = fragment.ranks;
    message.pixels = fragment.pixels;
    actions.push_back(
        SendPartial{*peer, std::move(message), fragment.image, FrameBounds(assignment_.setup), assignment_.group.color, rank});
  }
  if (!fragments.empty()) std::get<SendPartial>(actions.back()).message.reports = std::move(reports);
}

// Releases the images of fragments that were taken, once each, unless other fragments still use them.
void GroupRun::ReleaseUnused(std::vector<Fragment> taken, WorkerActions& actions) {
  const auto by_image = [](const Fragment& a, const Fragment& b) { return a.image < b.image; };
  const auto same_image = [](const Fragment& a, const Fragment& b) { return a.image == b.image; };
  std::sort(taken.begin(), taken.end(), by_image);
  taken.erase(std::unique(taken.begin(), taken.end(), same_image), taken.end());
  for (const Fragment& part : taken) {
    const bool used = std::any_of(ranks_.begin(), ranks_.end(), [&](const auto& rank) { return rank.second.fragments.Uses(part.image); });
    if (!used) actions.push_back(ReleaseImage{part.image});
  }
}

// Reports leave a rank with its last pixels, so that all that the rank combined is in them.
std::vector<RankReport> GroupRun::TakeReports(RankState& rank) {
  return rank.open_steps.empty() ? std::exchange(rank.reports, {}) : std::vector<RankReport>();
}

const Peer* GroupRun::FindPeer(WorkerId worker) const {
  const auto found =
      std::find_if(assignment_.peers.begin(), assignment_.peers.end(), [&](const Peer& peer) { return peer.worker == worker; });
  return found == assignment_.peers.end() ? nullptr : &*found;
}

void GroupRun::Fail(std::string why) {
  if (failure_.ok()) failure_ = Status::Internal(std::move(why));
}

}  // namespace slabstream
