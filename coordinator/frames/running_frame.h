// RunningFrame: one frame from its plan to its end. It knows which groups are handed out, which are done, on which attempt, and what was
// measured.
//
// An attempt hands out the groups [first group, group count) of one plan. Events that end it before the frame's end, and where the next one
// begins:
//   a worker with a part in it is lost                     the first unfinished group, now. What two workers have died with is tried alone
//                                                          then; the frame fails if the next one dies with it, too (Suspects)
//   a worker with a part in it has another connection      the first unfinished group, now: messages may be lost
//   no progress for stall_timeout                          the first unfinished group, now; counted
//   a worker could not do its part                         the first unfinished group, after a pause that grows; counted
//   the same, but another worker may be able to            the first unfinished group, now, without that worker; counted
//   a worker cannot reach another that is alive            the first unfinished group, once that is proved, without one of the two; counted
//   any of these, if the display worker was lost or had the trouble     group 0: what it accumulated is gone or in doubt
// A worker that leaves with notice ends no attempt: the groups that are out are finished. Then the next attempt gives the others to workers
// that stay, if there are any (HandOver). The display worker remains what it is, once it has accumulated a group.
// The frame fails after max_stalls counted events in a row, with no group finished for the first time between them. So every frame ends, as
// long as workers and connections are not lost for ever.
//
// A group is done when the display worker has accumulated it. It does so in order: group g done means 0 ... g done. That holds for the
// display worker's lifetime, not for an attempt, and a picture is right whoever makes it, so messages of older attempts count if their
// sender proves them.
//
// A picture in shares (ClientTakes::share_pixels) has a display worker for each share. It has one group, which is done when all of them
// have said so, and is finished when all shares are there. Those of one attempt count: the next one divides the picture among other
// workers.
//
// What is hidden (common/planning/frame_occlusion.h): each GroupDone of the present display worker may bring the mask of what it has
// accumulated; the mask of most groups is kept. The assignment of group g, in any attempt, carries it only if it was made from groups in
// front of g. When an attempt begins again with group 0, the mask is dropped. A mask that is missing or late costs work and no more.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <utility>
#include <variant>
#include <vector>

#include "common/base/status.h"
#include "common/base/time.h"
#include "common/memory/bytes.h"
#include "common/planning/frame_plan.h"
#include "common/wire/client_messages.h"
#include "common/wire/control_messages.h"
#include "coordinator/frames/request_queue.h"
#include "coordinator/frames/suspects.h"

namespace slabstream {

struct FrameLimits {
  Duration stall_timeout{};
  int max_stalls = 1;
  Duration pause{};          // before the second attempt after trouble; each further one waits this much longer
  Duration proof_of_life{};  // a heartbeat this much later than a complaint about its sender refutes "it is dead"
  Duration suspicion{};      // this much later the accused worker is lost, or alive for sure
};

class RunningFrame {
 public:
  // `request` is planned.
  RunningFrame(FrameId id, OpenRequest request, const FrameLimits& limits, Time now);

  FrameId id() const { return id_; }
  const OpenRequest& request() const { return request_; }
  const FramePlan& plan() const { return plan_; }
  const Roster& roster() const { return roster_; }
  const std::shared_ptr<const PlannedFrame>& planned() const { return planned_; }  // for the first attempt
  int fit() const { return fit_; }                                                 // FramesThatFit, of the present plan
  void SetFit(int fit) { fit_ = fit; }
  std::uint32_t attempt() const { return std::uint32_t(displays_.size()); }  // from 1
  WorkerId display() const { return plan_.display; }
  std::uint32_t group_count() const { return std::uint32_t(plan_.groups.size()); }
  std::uint32_t groups_done() const { return groups_done_; }
  std::uint32_t unfinished_groups() const;  // handed out and not done; 0 while a new attempt is due
  bool HasPart(WorkerId worker) const;      // in groups that are not done yet, or in the picture
  std::vector<WorkerId> Renderers(std::uint32_t group) const;
  // Those of them that rendered a box of the group, as far as is known: hidden boxes are left out, before older work is done.
  std::vector<WorkerId> HaveRendered(std::uint32_t group) const;
  std::vector<WorkerId> Participants() const;  // workers with a placement anywhere in the plan, and the display worker

  // ---- handing out
  bool CanHandOut() const;  // a group is left, and no new attempt is due or wanted
  struct HandOut {
    GroupAssignment assignment;  // epoch, finished_before and the endpoints of peers and others are left to the caller
    std::vector<WorkerId> workers;
  };
  HandOut NextGroup(Time now);  // needs CanHandOut()

  // `roster`: as for BeginAttempt. If groups are still to be handed out to workers that are leaving, and another one can have them, a new
  // attempt begins as soon as nothing is out. Call it again whenever the roster has changed.
  void HandOver(const Roster& roster);

  bool AttemptDue(Time now) const;
  bool between_attempts() const { return std::holds_alternative<BetweenAttempts>(state_); }
  std::string WhyAgain() const;  // of an attempt that is due: what ended the one before
  // Begins the next attempt over `roster` (same number of slots), without workers that could not do their part. If nobody is left, nothing
  // changes; the Status is the last such worker's reason, or Unavailable if there is none. A `busy` worker does not try a suspect if there
  // is another worker for it.
  Status BeginAttempt(const Roster& roster, const std::set<WorkerId>& busy, Time now);
  // While it has suspects, no other frame may have anything under way.
  bool has_suspects() const { return suspects_.any(); }
  bool waiting() const;  // for groups that are out, or for the finished picture

  // ---- what workers say
  bool OnGroupDone(const GroupDone& message, Time now);  // true: groups_done() rose
  enum class Use { kNothing, kPreview, kFinal };
  // What the picture is used for; a preview reports groups done, too. `payload` comes with the message.
  Use OnImage(const FrameImage& message, const Bytes& payload, Time now);
  // The picture that OnImage has found a use for, once: its shares, and what has come with them.
  std::pair<std::vector<PictureShare>, Bytes> TakePicture();
  void OnHeartbeat(WorkerId worker, bool progressed, Time now);
  // These workers have rendered a group of a younger frame of the same client. They render a client's frames in order, so what they do now
  // is no progress of this frame.
  void OnOvertaken(const std::vector<WorkerId>& workers);

  // ---- what goes wrong. A Status that is not ok: the frame has failed.
  // `worker` is no longer in the roster. `last_word`: it has died, and when it was heard last. Without it, it left or fell silent.
  Status OnLoss(WorkerId worker, std::optional<Time> last_word, Time now);
  void OnReconnection(WorkerId worker, Time now);  // messages from it or to it may be lost
  // Ignores trouble of another attempt or of a group that is done. message.unreachable, if any, must be in the roster. Trouble of the
  // display worker when all groups are done: it cannot make the picture.
  Status OnTrouble(const WorkerTrouble& message, Time now);
  Status Expire(Time now);           // stalls, suspicions
  void Postpone(Duration duration);  // both end later, since the listener itself was asleep

  Time NextWake() const;  // when Expire or AttemptDue has something to do; Time::max(): never

  FrameProgress Progress() const;
  FrameStatistics Statistics(Time now) const;
  Duration WorkerTime() const;  // time that workers spent on it, as far as they have reported

 private:
  struct Suspicion {
    WorkerId accused = 0, accuser = 0;
    Time proof_after;  // a heartbeat later than this proves that the accused is alive
    Time until;        // then it is alive, since it is not lost
  };
  struct UnderWay {
    bool handing_over;  // what is not handed out yet is left to the next attempt
    std::optional<Suspicion> suspicion;
  };
  struct BetweenAttempts {
    Time end;
    bool display_in_doubt;  // the next attempt begins with group 0
    std::string why;
  };
  UnderWay* under_way() { return std::get_if<UnderWay>(&state_); }  // null: between attempts
  const UnderWay* under_way() const { return std::get_if<UnderWay>(&state_); }
  bool display_in_doubt() const { return between_attempts() && std::get<BetweenAttempts>(state_).display_in_doubt; }
  const GroupPlan& LastGroup() const { return plan_.groups.back(); }
  std::size_t share_count() const { return LastGroup().schedule.roots.size(); }
  bool IsDisplay(WorkerId worker) const { return ShareOf(LastGroup(), plan_.display, worker).has_value(); }
  bool Accept(std::uint32_t attempt, WorkerId sender) const;
  Use OnShare(const FrameImage& message, const Bytes& payload, Time now);
  bool Finish(std::uint32_t groups, Time now);
  void KeepHidden(const GroupDone& message);
  bool CanRender(WorkerId worker) const { return worker != 0 && !unable_.contains(worker); }
  bool RendersFrom(std::uint32_t group, WorkerId worker) const;  // a box of that group or of a later one
  bool IsNextOf(WorkerId worker) const;                          // it has a part in what is not handed out yet
  Status NoteDeath(WorkerId worker);
  WorkerId WorkerForTrial(const Roster& roster, const std::set<WorkerId>& busy) const;
  Status CountStall(const Status& reason, Time again, bool display_in_doubt = false);
  std::optional<WorkerId> CulpritOf(const Suspicion& suspicion);

  FrameId id_;
  OpenRequest request_;
  std::shared_ptr<const PlannedFrame> planned_;
  int fit_;
  FramePlan plan_;
  Roster roster_;
  FrameLimits limits_;
  Time begin_, attempt_begin_;

  std::vector<WorkerId> displays_;        // by attempt - 1
  std::uint32_t accumulating_since_ = 1;  // the attempt that the present display worker began with nothing
  std::uint32_t first_group_ = 0;         // the first group of this attempt
  std::uint32_t next_group_ = 0;          // to be handed out
  std::uint32_t groups_done_ = 0;         // by the present display worker
  std::uint32_t furthest_done_ = 0;       // by any
  std::uint32_t groups_shown_ = 0;        // in the last preview
  OcclusionMask hidden_;                  // by the groups [0, hidden_by_), as the present display worker accumulated them
  std::uint32_t hidden_by_ = 0;
  std::variant<UnderWay, BetweenAttempts> state_ = UnderWay{};
  std::map<WorkerId, int> complaints_;  // proved suspicions that each worker had a part in
  std::set<WorkerId> unable_;           // workers that cannot do their part of this frame
  Status inability_;                    // reason of the last one of them
  Suspects suspects_;
  int stalls_ = 0;
  Time last_progress_;
  std::set<WorkerId> moved_on_;                   // workers that have rendered all that is handed out of this frame
  std::vector<std::vector<RankReport>> reports_;  // by group
  std::vector<RankReport> display_reports_;       // sent with the finished picture
  struct Share {
    bool group_done = false;  // its worker has said so
    std::optional<PictureShare> picture;
    Bytes payload;
  };
  std::vector<Share> shares_;  // the shares of this attempt
};

}  // namespace slabstream
