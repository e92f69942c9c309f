#include "coordinator/frames/running_frame.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <string>

#include "common/base/check.h"
#include "common/planning/frame_occlusion.h"
#include "common/planning/placement.h"
#include "common/renderers/renderer_kind.h"

namespace slabstream {

namespace {

void AddOnce(std::vector<WorkerId>& workers, WorkerId worker) {
  if (worker != 0 && std::ranges::find(workers, worker) == workers.end()) workers.push_back(worker);
}

std::string WorkerName(WorkerId worker) { return "worker " + std::to_string(worker); }

std::int64_t Nanoseconds(Time time) { return time.time_since_epoch().count(); }

}  // namespace

RunningFrame::RunningFrame(FrameId id, OpenRequest request, const FrameLimits& limits, Time now)
    : id_(id),
      request_(std::move(request)),
      planned_(request_.plan<PlanMade>()->frame),
      fit_(*request_.plan<PlanMade>()->frame->fit),
      plan_(planned_->plan),
      roster_(planned_->asked.roster),
      limits_(limits),
      begin_(now),
      attempt_begin_(now),
      displays_{plan_.display},
      last_progress_(now),
      reports_(plan_.groups.size()),
      shares_(share_count()) {
  CHECK(!plan_.groups.empty()) << "frame " << id_;
}

std::uint32_t RunningFrame::unfinished_groups() const {
  return between_attempts() || next_group_ < groups_done_ ? 0 : next_group_ - groups_done_;
}

bool RunningFrame::waiting() const { return !between_attempts() && (next_group_ > groups_done_ || groups_done_ == group_count()); }

bool RunningFrame::HasPart(WorkerId worker) const { return IsDisplay(worker) || RendersFrom(groups_done_, worker); }

bool RunningFrame::RendersFrom(std::uint32_t group, WorkerId worker) const {
  return std::any_of(plan_.groups.begin() + group, plan_.groups.end(), [worker](const GroupPlan& of_frame) {
    return std::ranges::find(of_frame.placements, worker, &Placement::worker) != of_frame.placements.end();
  });
}

std::vector<WorkerId> RunningFrame::Renderers(std::uint32_t group) const {
  std::vector<WorkerId> workers;
  for (const Placement& placement : plan_.groups[group].placements) AddOnce(workers, placement.worker);
  return workers;
}

std::vector<WorkerId> RunningFrame::HaveRendered(std::uint32_t group) const {
  std::set<WorkerId> reported, rendered;
  for (const RankReport& report : reports_[group]) {
    reported.insert(report.worker);
    if (report.stage_ns[std::size_t(Stage::kRender)] > 0) rendered.insert(report.worker);
  }
  std::vector<WorkerId> workers = Renderers(group);
  std::erase_if(workers, [&](WorkerId worker) { return reported.contains(worker) && !rendered.contains(worker); });
  return workers;
}

std::vector<WorkerId> RunningFrame::Participants() const {
  std::vector<WorkerId> workers = {plan_.display};
  for (std::uint32_t group = 0; group < group_count(); ++group) {
    for (const WorkerId worker : Renderers(group)) AddOnce(workers, worker);
  }
  return workers;
}

bool RunningFrame::CanHandOut() const {
  if (has_suspects() && unfinished_groups() > 0) return false;  // one group at a time, so that nothing else is in the hands of their worker
  return under_way() != nullptr && !under_way()->handing_over && next_group_ < group_count();
}

bool RunningFrame::IsNextOf(WorkerId worker) const {
  return (next_group_ == 0 && worker == plan_.display) || RendersFrom(next_group_, worker);
}

void RunningFrame::HandOver(const Roster& roster) {
  if (under_way() == nullptr) return;
  under_way()->handing_over = std::ranges::any_of(roster.slots, [this](WorkerId worker) { return CanRender(worker); }) &&
                              std::ranges::any_of(roster.leaving, [this](WorkerId worker) { return IsNextOf(worker); });
}

bool RunningFrame::AttemptDue(Time now) const {
  if (const auto* between = std::get_if<BetweenAttempts>(&state_)) return now >= between->end;
  return under_way()->handing_over && unfinished_groups() == 0;
}

std::string RunningFrame::WhyAgain() const {
  const auto* const between = std::get_if<BetweenAttempts>(&state_);
  return between != nullptr ? between->why : "workers are leaving";
}

RunningFrame::HandOut RunningFrame::NextGroup(Time now) {
  CHECK(CanHandOut()) << "frame " << id_;
  if (unfinished_groups() == 0) last_progress_ = now;  // nothing was out: the wait begins here
  const std::uint32_t number = next_group_++;
  moved_on_.clear();
  HandOut out{.assignment = {.key = {.frame = id_, .attempt = attempt(), .group = number},
                             .group_count = group_count(),
                             .first_group = first_group_,
                             .previews = request_.submit.frame.previews,
                             .straight8 = request_.submit.frame.straight8,
                             .straight8_over = request_.submit.frame.straight8_over,
                             .display = plan_.display,
                             .setup = plan_.setup,
                             .group = plan_.groups[number],
                             .groups_done = std::min(groups_done_, number),
                             .client = request_.client},
              .workers = Renderers(number)};
  AddOnce(out.workers, plan_.display);
  for (const WorkerId worker : out.workers) out.assignment.peers.push_back({.worker = worker});
  if (hidden_by_ <= number) out.assignment.hidden = hidden_;
  if (number == 0 && attempt() == 1) {
    out.assignment.tiles = plan_.tiles;
    const std::size_t peers = out.workers.size();
    for (const TileOrder& order : plan_.tiles) {
      AddOnce(out.workers, order.from);
      AddOnce(out.workers, order.to);
    }
    for (std::size_t i = peers; i < out.workers.size(); ++i) out.assignment.others.push_back({.worker = out.workers[i]});
  }
  return out;
}

Status RunningFrame::BeginAttempt(const Roster& roster, const std::set<WorkerId>& busy, Time now) {
  Roster able = roster;
  for (WorkerId& worker : able.slots) {
    if (!CanRender(worker)) worker = 0;
  }
  // A display worker that is leaving stays one only for what it has accumulated.
  if (groups_done_ == 0 || display_in_doubt() || share_count() > 1) able.leaving.clear();
  Result<FramePlan> plan = Replan(plan_, able, {suspects_.boxes(), WorkerForTrial(able, busy)});
  if (!plan.ok()) return unable_.empty() ? plan.status() : inability_;
  const bool was_divided = share_count() > 1;
  const WorkerId display_before = plan_.display;
  plan_ = std::move(plan).value();
  shares_.assign(share_count(), {});
  if (was_divided) {  // each share has added its own
    reports_.front().clear();
    display_reports_.clear();
  }
  const bool keeps_accumulated = plan_.display == display_before && !display_in_doubt() && !was_divided && share_count() == 1;
  roster_ = std::move(able);
  displays_.push_back(plan_.display);
  if (!keeps_accumulated) {
    groups_done_ = 0;
    accumulating_since_ = attempt();
    hidden_ = {};
    hidden_by_ = 0;
  }
  // A display worker that has all groups is asked for the last one again: its answer is the picture that did not arrive.
  first_group_ = next_group_ = std::min(groups_done_, group_count() - 1);
  groups_done_ = first_group_;
  state_ = UnderWay{};
  last_progress_ = attempt_begin_ = now;
  return Status::Ok();
}

bool RunningFrame::Accept(std::uint32_t of_attempt, WorkerId sender) const {
  return IsDisplay(sender) && of_attempt >= accumulating_since_ && of_attempt <= attempt();
}

bool RunningFrame::Finish(std::uint32_t groups, Time now) {
  if (groups <= groups_done_) return false;
  groups_done_ = groups;
  next_group_ = std::max(next_group_, groups_done_);
  if (groups_done_ > furthest_done_) {
    furthest_done_ = groups_done_;
    stalls_ = 0;
    suspects_.Acquit();
  }
  last_progress_ = now;
  return true;
}

bool RunningFrame::OnGroupDone(const GroupDone& message, Time now) {
  if (!Accept(message.key.attempt, message.worker) || message.key.group >= group_count()) return false;
  if (share_count() > 1) {  // each tells of some ranks
    Share& share = shares_[*ShareOf(LastGroup(), plan_.display, message.worker)];
    if (std::exchange(share.group_done, true)) return false;
    reports_.front().insert(reports_.front().end(), message.reports.begin(), message.reports.end());
    return std::ranges::all_of(shares_, &Share::group_done) && Finish(1, now);
  }
  if (!message.reports.empty()) reports_[message.key.group] = message.reports;
  KeepHidden(message);
  return Finish(message.key.group + 1, now);
}

// A message of an older attempt may arrive after a mask of more groups.
void RunningFrame::KeepHidden(const GroupDone& message) {
  const std::uint32_t groups = message.key.group + 1;
  if (message.hidden.empty() || groups <= hidden_by_ || !CheckFits(message.hidden, plan_.setup).ok()) return;
  hidden_ = message.hidden;
  hidden_by_ = groups;
}

RunningFrame::Use RunningFrame::OnShare(const FrameImage& message, const Bytes& payload, Time now) {
  const bool expected = message.attempt == attempt() && message.share_count == share_count() && message.groups_done == group_count() &&
                        message.share == ShareOf(LastGroup(), plan_.display, message.worker);
  if (!expected || between_attempts() || shares_[message.share].picture) return Use::kNothing;
  shares_[message.share].picture = message.picture;
  shares_[message.share].payload = payload;
  display_reports_.insert(display_reports_.end(), message.reports.begin(), message.reports.end());
  last_progress_ = now;
  if (!std::ranges::all_of(shares_, [](const Share& share) { return share.picture.has_value(); })) return Use::kNothing;
  groups_done_ = group_count();
  return Use::kFinal;
}

std::pair<std::vector<PictureShare>, Bytes> RunningFrame::TakePicture() {
  std::vector<PictureShare> shares;
  std::vector<Bytes> payloads;
  for (Share& share : shares_) {
    shares.push_back(*std::exchange(share.picture, std::nullopt));
    if (!share.payload.empty()) payloads.push_back(std::exchange(share.payload, {}));
  }
  return {std::move(shares), Concatenated(payloads)};
}

RunningFrame::Use RunningFrame::OnImage(const FrameImage& message, const Bytes& payload, Time now) {
  if (share_count() > 1) return OnShare(message, payload, now);
  if (message.attempt == 0 || message.attempt > attempt() || message.worker != displays_[message.attempt - 1]) return Use::kNothing;
  if (message.group_count != group_count() || message.groups_done > group_count() || message.share_count != 1) return Use::kNothing;
  const auto use = [&](Use what) {
    shares_.front() = {.picture = message.picture, .payload = payload};
    return what;
  };
  if (message.groups_done == group_count()) {
    groups_done_ = group_count();
    display_reports_ = message.reports;
    return use(Use::kFinal);
  }
  if (Accept(message.attempt, message.worker)) Finish(message.groups_done, now);
  if (!request_.submit.frame.previews || message.groups_done <= groups_shown_) return Use::kNothing;
  groups_shown_ = message.groups_done;
  return use(Use::kPreview);
}

void RunningFrame::OnHeartbeat(WorkerId worker, bool progressed, Time now) {
  if (progressed && unfinished_groups() > 0 && HasPart(worker) && !moved_on_.contains(worker)) last_progress_ = now;
  if (under_way() == nullptr) return;
  std::optional<Suspicion>& suspicion = under_way()->suspicion;
  if (suspicion && suspicion->accused == worker && now > suspicion->proof_after) suspicion->until = now;
}

void RunningFrame::OnOvertaken(const std::vector<WorkerId>& workers) { moved_on_.insert(workers.begin(), workers.end()); }

Status RunningFrame::OnLoss(WorkerId worker, std::optional<Time> last_word, Time now) {
  if (!HasPart(worker)) {
    if (under_way() != nullptr && under_way()->suspicion && under_way()->suspicion->accused == worker) under_way()->suspicion.reset();
    return Status::Ok();
  }
  // A worker that was not heard since the attempt began may have died before, together with those whose boxes it got.
  const bool died_of_it = last_word && *last_word > attempt_begin_;
  const Status status = died_of_it ? NoteDeath(worker) : Status::Ok();
  state_ = BetweenAttempts{now, IsDisplay(worker) || display_in_doubt(), WorkerName(worker) + " is gone"};
  return status;
}

// In one attempt each box is in the hands of one worker, so deaths at the same time are never the same way.
Status RunningFrame::NoteDeath(WorkerId worker) {
  std::vector<Suspects::Part> held;
  if (IsDisplay(worker) && groups_done_ == group_count()) held.emplace_back();
  for (std::uint32_t group = groups_done_; group < next_group_; ++group) {
    for (const Placement& placement : plan_.groups[group].placements) {
      if (placement.worker == worker) held.emplace_back(placement.id);
    }
  }
  const std::optional<std::string> guilty = suspects_.OnDeath(held);
  if (!guilty) return Status::Ok();
  return Status::Unavailable(fmt::format("{} was lost with {} of the frame, as two workers before it: the frame may be what kills them",
                                         WorkerName(worker), *guilty));
}

WorkerId RunningFrame::WorkerForTrial(const Roster& roster, const std::set<WorkerId>& busy) const {
  const auto value = [&](WorkerId worker) { return (worker == plan_.display ? 2 : 0) + (busy.contains(worker) ? 1 : 0); };
  WorkerId least = 0;
  for (const WorkerId worker : roster.slots) {
    if (worker != 0 && (least == 0 || value(worker) < value(least))) least = worker;
  }
  return least;
}

// Messages on the old connection may be lost, so another attempt sends all of them again. A worker that has done its part answers at once.
void RunningFrame::OnReconnection(WorkerId worker, Time now) {
  if (HasPart(worker) && !between_attempts()) state_ = BetweenAttempts{now, false, WorkerName(worker) + " has another connection"};
}

Status RunningFrame::OnTrouble(const WorkerTrouble& message, Time now) {
  const bool no_picture = IsDisplay(message.worker) && groups_done_ == group_count();
  if (message.key.attempt != attempt() || (message.key.group < groups_done_ && !no_picture)) return Status::Ok();
  const Status reason(message.status.code(), WorkerName(message.worker) + ": " + message.status.message());
  if (message.elsewhere) {
    unable_.insert(message.worker);
    inability_ = reason;
  }
  if (between_attempts()) return Status::Ok();
  if (message.unreachable != 0) {
    if (!under_way()->suspicion) {
      under_way()->suspicion = {.accused = message.unreachable,
                                .accuser = message.worker,
                                .proof_after = now + limits_.proof_of_life,
                                .until = now + limits_.suspicion};
    }
    return Status::Ok();
  }
  const Duration pause = message.elsewhere ? Duration::zero() : limits_.pause * stalls_;
  return CountStall(reason, now + pause, IsDisplay(message.worker));
}

Status RunningFrame::Expire(Time now) {
  if (between_attempts()) return Status::Ok();
  if (const std::optional<Suspicion> suspicion = under_way()->suspicion; suspicion && now >= suspicion->until) {
    const Status reason =
        Status::Unavailable(WorkerName(suspicion->accuser) + " cannot reach " + WorkerName(suspicion->accused) + ", which is alive");
    if (const std::optional<WorkerId> culprit = CulpritOf(*suspicion)) {
      inability_ = reason;
      unable_.insert(*culprit);
    }
    return CountStall(reason, now);
  }
  if (waiting() && now >= last_progress_ + limits_.stall_timeout) {
    const auto seconds = std::chrono::duration_cast<std::chrono::seconds>(limits_.stall_timeout).count();
    return CountStall(Status::Unavailable("no progress for " + std::to_string(seconds) + " s"), now);
  }
  return Status::Ok();
}

// Nobody at first: a connection ends, too, if a busy machine takes nothing from it for some seconds, and then a new one is made. Else
// whoever had a part in more complaints; among equals the one that has not accumulated the frame, then the accused.
std::optional<WorkerId> RunningFrame::CulpritOf(const Suspicion& suspicion) {
  const int of_accused = ++complaints_[suspicion.accused], of_accuser = ++complaints_[suspicion.accuser];
  if (of_accused == 1 && of_accuser == 1) return std::nullopt;
  if (of_accused != of_accuser) return of_accused > of_accuser ? suspicion.accused : suspicion.accuser;
  return suspicion.accused == plan_.display ? suspicion.accuser : suspicion.accused;
}

void RunningFrame::Postpone(Duration duration) {
  last_progress_ += duration;
  if (under_way() == nullptr || !under_way()->suspicion) return;
  under_way()->suspicion->proof_after += duration;
  under_way()->suspicion->until += duration;
}

Status RunningFrame::CountStall(const Status& reason, Time again, bool display_in_doubt) {
  if (++stalls_ >= limits_.max_stalls) {
    return Status(reason.code(), fmt::format("{} ({} of {} groups were done at attempt {}; {} failures in a row is the limit)",
                                             reason.message(), groups_done_, group_count(), attempt(), stalls_));
  }
  state_ = BetweenAttempts{again, display_in_doubt, reason.message()};
  return Status::Ok();
}

Time RunningFrame::NextWake() const {
  if (const auto* between = std::get_if<BetweenAttempts>(&state_)) return between->end;
  Time wake = Time::max();
  if (waiting()) wake = last_progress_ + limits_.stall_timeout;
  if (under_way()->suspicion) wake = std::min(wake, under_way()->suspicion->until);
  return wake;
}

FrameProgress RunningFrame::Progress() const {
  return {.request = request_.submit.request,
          .phase = FramePhase::kRunning,
          .groups_done = groups_done_,
          .group_count = group_count(),
          .attempt = attempt(),
          .workers = std::uint32_t(Participants().size())};
}

Duration RunningFrame::WorkerTime() const {
  Duration time{};
  const auto add = [&time](const std::vector<RankReport>& reports) {
    for (const RankReport& report : reports) {
      for (const Stage stage : {Stage::kRender, Stage::kCombine, Stage::kEncode, Stage::kResolve}) {
        time += Duration(report.stage_ns[std::size_t(stage)]);
      }
    }
  };
  for (const auto& reports : reports_) add(reports);
  add(display_reports_);
  return time;
}

FrameStatistics RunningFrame::Statistics(Time now) const {
  const ResolvedPolicy& policy = planned_->asked.resolved->policy;
  FrameStatistics statistics{.workers = std::uint32_t(Participants().size()),
                             .groups = group_count(),
                             .attempts = attempt(),
                             .renderer = std::string(plan_.setup.renderer->name()),
                             .decomposition = std::string(policy.decomposition->name),
                             .balance_by = std::string(NameOf(policy.balance_by)),
                             .axis = std::string(1, Letter(policy.axis)),
                             .assignment = std::string(policy.assignment->name),
                             .balance = request_.submit.frame.policy.balance,
                             .combine = plan_.combine,
                             .queued_ns = (begin_ - request_.arrived).count(),
                             .begin_ns = Nanoseconds(begin_),
                             .end_ns = Nanoseconds(now),
                             .reports = {},
                             .display = plan_.display,
                             .grid = FrameBounds(plan_.setup),
                             .levels = {},
                             .lowered = request_.lowered,
                             .missing = planned_->asked.resolved->summary->missing,
                             .view = request_.dataset()->view};
  for (const int level : request_.dataset()->drawn) statistics.levels.push_back({.level = std::uint32_t(level)});
  for (const GroupPlan& group : plan_.groups) {
    for (const Placement& placement : group.placements) {
      LevelUse& use = statistics.levels[placement.level];
      ++use.boxes;
      use.voxels += std::uint64_t(VoxelsOf(placement.at(), plan_.setup).voxel_count());
    }
  }
  const auto append = [&](const std::vector<RankReport>& reports) {
    std::copy_n(reports.begin(), std::min(reports.size(), kMaxReports - statistics.reports.size()), std::back_inserter(statistics.reports));
  };
  for (const auto& reports : reports_) append(reports);
  append(display_reports_);
  return statistics;
}

}  // namespace slabstream
