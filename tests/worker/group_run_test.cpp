// Runs one group on several workers with symbols for pixels, messages in any order and some of them twice.
#include "worker/machine/group_run.h"

#include <gtest/gtest.h>

#include <deque>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "tests/support/random.h"
#include "tests/support/random_combining.h"
#include "tests/support/symbolic_images.h"

namespace slabstream {
namespace {

constexpr int kWidth = 6, kHeight = 4;
constexpr PixelRange kFrame{0, kWidth* kHeight};

struct Worker {
  ImageNames names;
  SymbolicImages images;
  std::unique_ptr<GroupRun> run;
  std::deque<CombineDone> combined;
  std::vector<Rank> to_render;
  std::optional<GroupImage> group_image;
};

// The workers of one group (numbered from 1), and the messages between them.
class Cluster {
 public:
  Cluster(Random& random, GroupAssignment assignment, std::size_t workers) : random_(random), workers_(workers) {
    for (WorkerId id = 1; id <= workers; ++id) assignment.peers.push_back({id, "inproc://" + std::to_string(id)});
    for (WorkerId id = 1; id <= workers; ++id) {
      Worker& worker = workers_[id - 1];
      worker.run = std::make_unique<GroupRun>(assignment, id, worker.names);
      for (Rank rank = 0; rank < assignment.group.placements.size(); ++rank) {
        if (assignment.group.placements[rank].worker == id) worker.to_render.push_back(rank);
      }
    }
  }

  // One random thing that may happen next. False: nothing is left to happen.
  bool Step() {
    std::vector<std::function<void()>> choices;
    for (Worker& worker : workers_) {
      if (!worker.to_render.empty()) choices.emplace_back([this, &worker] { Render(worker); });
      if (!worker.combined.empty()) choices.emplace_back([this, &worker] { AnswerCombine(worker); });
    }
    for (std::size_t i = 0; i < messages_.size(); ++i) choices.emplace_back([this, i] { Deliver(i); });
    if (choices.empty()) return false;
    choices[random_.Integer<std::size_t>(0, choices.size() - 1)]();
    return true;
  }

  Worker& worker(WorkerId id) { return workers_[id - 1]; }
  std::vector<Worker>& workers() { return workers_; }
  std::size_t messages_sent() const { return messages_sent_; }

 private:
  struct Message {
    WorkerId to = 0;
    PartialImage partial;
    Bytes payload;
  };

  void Render(Worker& worker) {
    const std::size_t which = random_.Integer<std::size_t>(0, worker.to_render.size() - 1);
    const Rank rank = worker.to_render[which];
    worker.to_render.erase(worker.to_render.begin() + std::ptrdiff_t(which));
    const ImageHandle image = worker.names.Next();
    worker.images.Render(image, rank, kFrame.end);
    RankReport report;
    report.worker = WorkerId(&worker - workers_.data()) + 1;
    report.rank = rank;
    WorkerActions actions;
    worker.run->OnRendered(rank, image, report, actions);
    Perform(worker, actions);
  }

  void AnswerCombine(Worker& worker) {
    const CombineDone done = worker.combined.front();
    worker.combined.pop_front();
    WorkerActions actions;
    worker.run->OnCombined(done, actions);
    Perform(worker, actions);
  }

  void Deliver(std::size_t which) {
    const Message message = messages_[which];
    if (random_.Chance(0.7)) messages_.erase(messages_.begin() + std::ptrdiff_t(which));  // else it comes once more
    WorkerActions actions;
    worker(message.to).run->OnPartial(PartialImage(message.partial), message.payload, actions);
    Perform(worker(message.to), actions);
  }

  void Perform(Worker& worker, const WorkerActions& actions) {
    for (const WorkerAction& action : actions) {
      if (const auto* combine = std::get_if<StartCombine>(&action)) {
        worker.images.Combine(*combine);
        worker.combined.push_back({combine->key, combine->image, {}, {Stage::kCombine, 0, 10}});
      } else if (const auto* send = std::get_if<SendPartial>(&action)) {
        messages_.push_back({send->to->worker, send->message, worker.images.Encode(send->image, send->message.pixels)});
        ++messages_sent_;
      } else if (const auto* release = std::get_if<ReleaseImage>(&action)) {
        worker.images.Release(release->image);
      } else {
        ADD_FAILURE() << "a group run starts nothing else; action " << action.index();
      }
    }
    ASSERT_TRUE(worker.run->failure().ok()) << worker.run->failure().message();
    if (auto image = worker.run->TakeGroupImage()) worker.group_image = std::move(image);
  }

  Random& random_;
  std::vector<Worker> workers_;
  std::vector<Message> messages_;
  std::size_t messages_sent_ = 0;
};

// The images of which its group image consists; that of a message has no handle.
void ReleaseGroupImage(Worker& worker) {
  std::set<ImageHandle> images;
  for (const ImagePiece& piece : worker.group_image->pieces) images.insert(piece.image);
  images.erase(0);
  for (const ImageHandle image : images) worker.images.Release(image);
}

void ExpectNothingLeft(Cluster& cluster) {
  for (Worker& worker : cluster.workers()) {
    EXPECT_TRUE(worker.run->finished());
    EXPECT_EQ(worker.images.size(), 0U);
  }
}

GroupAssignment MakeAssignment(Rank ranks, const std::string& combining, Rank root) {
  GroupAssignment assignment;
  assignment.epoch = 5;
  assignment.key = {1, 1, 0};
  assignment.setup.sheets.width = kWidth;
  assignment.setup.sheets.height = kHeight;
  for (Rank rank = 0; rank < ranks; ++rank) assignment.group.placements.push_back({rank, {}, 1});
  assignment.group.schedule = {combining, ranks, {root}};
  return assignment;
}

TEST(GroupRun, EveryScheduleGivesTheGroupImageOnceInOrder) {
  Random random(11);
  SCOPED_TRACE(random.trace());
  for (const CombiningEntry& scheme : CombiningSchemes()) {
    for (int trial = 0; trial < 60; ++trial) {
      const auto ranks = random.Integer<Rank>(1, 9);
      const std::string combining = RandomArguments(scheme, random);
      GroupAssignment assignment = MakeAssignment(ranks, combining, random.Integer<Rank>(0, ranks - 1));
      SCOPED_TRACE(combining + ", " + std::to_string(ranks) + " ranks, trial " + std::to_string(trial));
      const WorkerId workers = random.Integer<WorkerId>(1, 5);
      for (Placement& placement : assignment.group.placements) placement.worker = random.Integer<WorkerId>(1, workers);
      assignment.display = random.Integer<WorkerId>(1, workers);

      Cluster cluster(random, assignment, workers);
      while (cluster.Step()) {
        if (HasFatalFailure()) return;
      }
      if (workers == 1) {
        EXPECT_EQ(cluster.messages_sent(), 0U) << "ranks of one worker combine without messages";
      }

      Worker& display = cluster.worker(assignment.display);
      ASSERT_TRUE(display.group_image.has_value());
      SymbolicPixel all(ranks);
      for (Rank rank = 0; rank < ranks; ++rank) all[rank] = rank;
      SymbolicImage picture;
      for (const ImagePiece& piece : display.group_image->pieces) {
        const SymbolicImage source =
            piece.image == 0 ? UnpackSymbols(piece.incoming ? piece.incoming->payload : Bytes()) : display.images.Get(piece.image);
        for (std::uint64_t i = piece.pixels.begin; i < piece.pixels.end; ++i) EXPECT_TRUE(picture.emplace(i, source.at(i)).second);
      }
      EXPECT_EQ(picture.size(), kFrame.end);
      for (const auto& [index, pixel] : picture) EXPECT_EQ(pixel, all) << "pixel " << index;

      // Every rank is reported once, and nothing is left behind.
      std::multiset<Rank> reported;
      for (const RankReport& report : display.group_image->reports) reported.insert(report.rank);
      EXPECT_EQ(reported, std::multiset<Rank>(all.begin(), all.end()));
      ReleaseGroupImage(display);
      ExpectNothingLeft(cluster);
    }
  }
}

// Each worker with ranks displays a share.
TEST(GroupRun, EveryScheduleGivesEachDisplayItsShare) {
  Random random(13);
  SCOPED_TRACE(random.trace());
  for (const CombiningEntry& scheme : CombiningSchemes()) {
    for (int trial = 0; trial < 60; ++trial) {
      const auto ranks = random.Integer<Rank>(2, 9);
      GroupAssignment assignment = MakeAssignment(ranks, RandomArguments(scheme, random), 0);
      SCOPED_TRACE(assignment.group.schedule.scheme + ", " + std::to_string(ranks) + " ranks, trial " + std::to_string(trial));
      for (Placement& placement : assignment.group.placements) placement.worker = random.Integer<WorkerId>(1, 4);
      std::vector<Rank>& roots = assignment.group.schedule.roots;
      roots.clear();
      for (WorkerId worker = 1; worker <= 4; ++worker) {
        for (Rank rank = 0; rank < ranks; ++rank) {
          if (assignment.group.placements[rank].worker != worker) continue;
          roots.push_back(rank);
          break;
        }
      }
      if (roots.size() < 2) continue;
      assignment.display = assignment.group.placements[roots.front()].worker;

      Cluster cluster(random, assignment, 4);
      while (cluster.Step()) {
        if (HasFatalFailure()) return;
      }
      SymbolicPixel all(ranks);
      for (Rank rank = 0; rank < ranks; ++rank) all[rank] = rank;
      std::multiset<Rank> reported;
      for (std::size_t share = 0; share < roots.size(); ++share) {
        Worker& display = cluster.worker(assignment.group.placements[roots[share]].worker);
        ASSERT_TRUE(display.group_image.has_value());
        std::uint64_t pixels = 0;
        for (const ImagePiece& piece : display.group_image->pieces) {
          const SymbolicImage source = display.images.Get(piece.image);
          for (std::uint64_t i = piece.pixels.begin; i < piece.pixels.end; ++i) EXPECT_EQ(source.at(i), all) << "pixel " << i;
          EXPECT_GE(piece.pixels.begin, Share(kFrame, share, roots.size()).begin);
          EXPECT_LE(piece.pixels.end, Share(kFrame, share, roots.size()).end);
          pixels += PixelCount(piece.pixels);
        }
        EXPECT_EQ(pixels, PixelCount(Share(kFrame, share, roots.size())));
        for (const RankReport& report : display.group_image->reports) reported.insert(report.rank);
        ReleaseGroupImage(display);
      }
      EXPECT_EQ(reported, std::multiset<Rank>(all.begin(), all.end()));
      ExpectNothingLeft(cluster);
    }
  }
}

TEST(GroupRun, DropReleasesWhateverItHolds) {
  Random random(12);
  SCOPED_TRACE(random.trace());
  for (const CombiningEntry& scheme : CombiningSchemes()) {
    for (int trial = 0; trial < 40; ++trial) {
      const auto ranks = random.Integer<Rank>(1, 7);
      GroupAssignment assignment = MakeAssignment(ranks, RandomArguments(scheme, random), random.Integer<Rank>(0, ranks - 1));
      for (Placement& placement : assignment.group.placements) placement.worker = random.Integer<WorkerId>(1, 3);
      assignment.display = random.Integer<WorkerId>(1, 3);
      Cluster cluster(random, assignment, 3);
      for (int steps = random.Integer(0, 40); steps > 0 && cluster.Step(); --steps) {
      }
      for (Worker& worker : cluster.workers()) {
        WorkerActions actions;
        worker.run->Drop(actions);
        if (worker.group_image) ReleaseGroupImage(worker);  // it is no longer the run's
        for (const WorkerAction& action : actions) worker.images.Release(std::get<ReleaseImage>(action).image);
        EXPECT_EQ(worker.images.size(), 0U) << scheme.name << ", trial " << trial;
      }
    }
  }
}

TEST(GroupRun, ImagesOfRanksThatAreNotAdjacentAreAFailure) {
  GroupAssignment assignment = MakeAssignment(3, "fan-in", 0);
  assignment.group.placements[1].worker = 2;
  ImageNames names;
  GroupRun run(assignment, 1, names);
  WorkerActions actions;
  run.OnRendered(0, names.Next(), {}, actions);
  PartialImage wrong;  // rank 1 sends what it should not have
  wrong.key = assignment.key;
  wrong.from_worker = 2;
  wrong.interval = {2, 3};
  wrong.pixels = kFrame;
  run.OnPartial(PartialImage(wrong), {}, actions);
  EXPECT_EQ(run.failure().code(), StatusCode::kInternal);
  EXPECT_NE(run.failure().message().find("not adjacent"), std::string::npos) << run.failure().message();
}

TEST(GroupRun, AScheduleThatDoesNotFitIsAFailure) {
  ImageNames names;
  GroupAssignment too_few = MakeAssignment(3, "fan-in", 0);
  too_few.group.placements.pop_back();
  EXPECT_FALSE(GroupRun(too_few, 1, names).failure().ok());
  for (const ScheduleName& name : {ScheduleName{"fan-in", 3, {3}}, ScheduleName{"glue", 3, {0}}, ScheduleName{"fan-in", 4, {0}}}) {
    GroupAssignment wrong = MakeAssignment(3, "fan-in", 0);
    wrong.group.schedule = name;
    EXPECT_FALSE(GroupRun(wrong, 1, names).failure().ok()) << name.scheme << ", " << name.ranks << " ranks, root " << name.roots.front();
  }
}

TEST(GroupRun, ImagesFromWorkersThatDoNotOwnTheRankOrOfAnotherFormatAreIgnored) {
  GroupAssignment assignment = MakeAssignment(2, "fan-in", 0);
  assignment.group.placements[1].worker = 2;
  assignment.display = 1;
  ImageNames names;
  GroupRun run(assignment, 1, names);
  WorkerActions actions;
  run.OnRendered(0, names.Next(), {}, actions);
  PartialImage stranger;
  stranger.key = assignment.key;
  stranger.from_worker = 3;
  stranger.interval = {1, 2};
  stranger.pixels = kFrame;
  run.OnPartial(PartialImage(stranger), {}, actions);
  EXPECT_TRUE(actions.empty());
  stranger.from_worker = 2;
  for (const PixelFormat format : {PixelFormat::kDepth, PixelFormat::kRgbaDepth, PixelFormat::kMaximum, PixelFormat::kSum}) {
    stranger.image.format = format;
    run.OnPartial(PartialImage(stranger), {}, actions);
    EXPECT_TRUE(actions.empty()) << "it combines with no image of the frame";
  }
  stranger.image.format = assignment.setup.format;
  run.OnPartial(PartialImage(stranger), {}, actions);
  EXPECT_EQ(actions.size(), 1U);
}

TEST(GroupRun, AnEmptyGroupIsDoneAtOnce) {
  GroupAssignment assignment;
  assignment.setup.sheets.width = kWidth;
  assignment.setup.sheets.height = kHeight;
  assignment.display = 1;
  ImageNames names;
  GroupRun run(assignment, 1, names);
  const auto image = run.TakeGroupImage();
  ASSERT_TRUE(image.has_value());
  EXPECT_TRUE(image->pieces.empty());
  EXPECT_TRUE(run.finished());
}

}  // namespace
}  // namespace slabstream
