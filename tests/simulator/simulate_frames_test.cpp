#include "simulator/simulate_frames.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <memory>
#include <set>
#include <tuple>

#include "common/planning/frame_occlusion.h"
#include "common/planning/frame_window.h"
#include "tests/simulator/support.h"
#include "tests/support/random_combining.h"
#include "tests/support/renderers.h"

namespace slabstream {
namespace {

using ::testing::HasSubstr;

constexpr std::int32_t kSide = 64;
constexpr double kRelative = 1e-5;  // a full tile counts as full but for e^-16

// Of a machine on which bringing a whole image over a wire takes `transfer` seconds and combining it `combine`.
MachineModel SimpleMachine(Contention contention, double transfer, double combine) {
  MachineModel machine = WithoutDelays();
  machine.link = {contention, 0, 24.0 * kSide * kSide / transfer};
  machine.combining.combine_pixel = combine / (kSide * kSide);
  return machine;
}

double Latency(const std::string& combining, std::uint32_t workers, double render, const MachineModel& machine) {
  const MadeFrame frame(workers, 1, kSide, 1, render, combining);
  return Simulate({frame.input()}, machine).frames[0].latency();
}

TEST(SimulateFrames, OneWorkerTakesTheSumOfWhatThereIsToDo) {
  MachineModel machine = WithoutDelays();
  machine.link.latency_seconds = 0.01;
  machine.plan_seconds = 0.1;
  machine.message_seconds = 0.001;
  machine.client_seconds = 0.2;
  MadeFrame frame(1, 1, kSide, 1, 2, "fan-in");
  frame.finish_seconds = 0.5;
  const Timeline timeline = Simulate({frame.input()}, machine);
  // The request, the assignment and the picture travel; the coordinator takes the request, sends the assignment, takes "done" and picture.
  const double messages = 3 * 0.01 + 2 * 0.001 + 0.001;
  EXPECT_NEAR(timeline.frames[0].latency(), messages + 0.1 + 2 + 0.5 + 0.2, 1e-9);
  EXPECT_EQ(timeline.frames[0].image_bytes, 0);
  EXPECT_EQ(timeline.frames[0].imbalance, 1);
}

// From thread to thread: client, coordinator, planner, coordinator, worker, render lane, worker, finish lane, worker, coordinator, client.
TEST(SimulateFrames, EveryWakeUpTakesItsTime) {
  MachineModel machine = WithoutDelays();
  machine.wake_ups = {.awake = 0.01, .asleep = 0.07, .doze = 0};
  MadeFrame frame(1, 1, kSide, 1, 2, "fan-in");
  frame.finish_seconds = 0.5;
  EXPECT_NEAR(Simulate({frame.input()}, machine).frames[0].latency(), 2 + 0.5 + 10 * 0.07, 1e-9);
  machine.wake_ups.doze = 100;
  EXPECT_NEAR(Simulate({frame.input()}, machine).frames[0].latency(), 2 + 0.5 + 10 * 0.01, 1e-9);
  // Who has waited for a second is asleep: nobody when the frame begins; when it is rendered the worker and its finish lane; when the
  // picture is made the client alone, since coordinator and worker have had to do with the group's end.
  machine.wake_ups.doze = 1;
  EXPECT_NEAR(Simulate({frame.input()}, machine).frames[0].latency(), 2 + 0.5 + 5 * 0.01 + 2 * 0.07 + 2 * 0.01 + 0.07, 1e-9);
}

// An image of another worker comes in addition: told of by its worker, at the other one, at its combining lane and back. One that travels
// is encoded by a lane of its own first.
TEST(SimulateFrames, WakeUpsOfAnImageDependOnHowItTravels) {
  MachineModel machine = WithoutDelays();
  machine.wake_ups = {.awake = 0.01, .asleep = 0.01};
  const MadeFrame one(1, 1, kSide, 1, 2, "fan-in"), two(2, 1, kSide, 1, 2, "fan-in");
  const double alone = Simulate({one.input()}, machine).frames[0].latency();
  EXPECT_NEAR(Simulate({two.input()}, machine).frames[0].latency(), alone + 5 * 0.01, 1e-9);
  machine.combining.lent = true;
  EXPECT_NEAR(Simulate({two.input()}, machine).frames[0].latency(), alone + 3 * 0.01, 1e-9);
}

TEST(SimulateFrames, ARenderingIsOrderedWhenTheLastOneIsKnown) {
  MachineModel machine = WithoutDelays();
  machine.wake_ups = {.awake = 0.01, .asleep = 0.01};
  const MadeFrame frame(1, 2, kSide, 1, 2, "fan-in");
  const Timeline timeline = Simulate({frame.input()}, machine);
  ASSERT_GE(timeline.spans.size(), 2U);
  EXPECT_NEAR(timeline.spans[1].begin - timeline.spans[0].end, 2 * 0.01, 1e-9);
}

TEST(SimulateFrames, ColoursInFewerBitsAreFewerBytes) {
  for (const RendererKind* renderer : Renderers()) {
    std::map<ColorCoding, double> bytes;
    for (const ColorCoding color : {ColorCoding::kFloat32, ColorCoding::kHalf, ColorCoding::kFixed16, ColorCoding::kStraight8}) {
      MadeFrame frame(5, 2, kSide, 0.5, 1, "fan-in", renderer);
      for (GroupPlan& group : frame.plan().groups) group.color = color;
      bytes[color] = Simulate({frame.input()}, WithoutDelays()).frames[0].image_bytes;
    }
    const double share = renderer->format() == PixelFormat::kRgba ? 0.5 : 1;  // others are not coded in 16 bits
    EXPECT_GT(bytes[ColorCoding::kFloat32], 0);
    EXPECT_DOUBLE_EQ(bytes[ColorCoding::kHalf], share * bytes[ColorCoding::kFloat32]);
    EXPECT_DOUBLE_EQ(bytes[ColorCoding::kFixed16], share * bytes[ColorCoding::kFloat32]);
    const double of_floats = renderer->format() == PixelFormat::kRgba    ? 4.0 / 16
                             : renderer->format() == PixelFormat::kDepth ? 12.0 / 24
                                                                         : 1;
    EXPECT_DOUBLE_EQ(bytes[ColorCoding::kStraight8], of_floats * bytes[ColorCoding::kFloat32]);
  }
}

TEST(SimulateFrames, AChainTakesOneHopForEachWorker) {
  for (const std::uint32_t p : {1U, 2U, 5U, 8U}) {
    for (const Contention contention : {Contention::kNone, Contention::kSwitched, Contention::kSharedBus}) {
      const double expected = 10 + (p - 1) * (3.0 + 2.0);
      EXPECT_NEAR(Latency("chain:strips=1", p, 10, SimpleMachine(contention, 3, 2)), expected, expected * kRelative) << p;
    }
  }
}

// Each message is encrypted by its sender and decrypted by its receiver, whatever the colours take.
TEST(SimulateFrames, EncryptionTakesProcessorTimeAtBothEndsOfEveryMessage) {
  constexpr double kByte = 1e-6;
  for (const RendererKind* renderer : Renderers()) {
    for (const ColorCoding color : {ColorCoding::kFloat32, ColorCoding::kHalf}) {
      MadeFrame frame(4, 1, kSide, 1, 10, "chain:strips=1", renderer);
      frame.plan().groups[0].color = color;
      MachineModel machine = WithoutDelays();
      machine.cores_a_host = 1;
      const SimulatedFrame plain = Simulate({frame.input()}, machine).frames[0];
      machine.combining.cipher_byte = kByte;
      const SimulatedFrame encrypted = Simulate({frame.input()}, machine).frames[0];
      EXPECT_EQ(encrypted.image_bytes, plain.image_bytes);
      const double expected = plain.latency() + 2 * kByte * plain.image_bytes;  // all of a chain's messages follow each other
      EXPECT_GT(expected, plain.latency() + 0.01);
      EXPECT_NEAR(encrypted.latency(), expected, expected * kRelative) << renderer->name();
    }
  }
}

constexpr double kPictureBytes = 1000, kLinkByte = 1e-3, kCipherByte = 2e-3;

// A picture of kPictureBytes comes so much later than one that has no way.
void ExpectPictureTakes(double seconds, const PictureWay& way) {
  MadeFrame frame(2, 1, kSide, 1, 1, "fan-in");
  MachineModel machine = WithoutDelays();
  const double expected = Simulate({frame.input()}, machine).frames[0].latency() + seconds;
  frame.picture_bytes = kPictureBytes;
  machine.picture = way;
  EXPECT_NEAR(Simulate({frame.input()}, machine).frames[0].latency(), expected, expected * kRelative);
}

TEST(SimulateFrames, PicturesTravelOverTheCoordinatorToTheClient) {
  ExpectPictureTakes(0, WithoutDelays().picture);
  // Four times it is encrypted or decrypted, by three processes, and it takes two connections. The coordinator does half of the work.
  const PictureWay way = {.link_byte = kLinkByte, .cipher_byte = kCipherByte};
  ExpectPictureTakes(kPictureBytes * (2 * kLinkByte + 4 * kCipherByte), way);

  MadeFrame frame(2, 1, kSide, 1, 1, "fan-in");
  frame.picture_bytes = kPictureBytes;
  MachineModel machine = WithoutDelays();
  machine.picture = way;
  const std::vector<FrameInput> many(20, frame.input());
  const Timeline timeline = SimulateFrames(many, machine, {.in_flight = 10, .keep_spans = false}).value();
  const double period = (timeline.frames[19].received - timeline.frames[9].received) / 10;
  EXPECT_NEAR(period, kPictureBytes * 2 * kCipherByte, kRelative * period) << "the coordinator is busy all the time";
}

// Twice it is encrypted or decrypted, and it takes one connection; the coordinator has nothing to do with it.
TEST(SimulateFrames, DirectPicturesTravelToTheClient) {
  ExpectPictureTakes(kPictureBytes * (kLinkByte + 2 * kCipherByte), {.link_byte = kLinkByte, .cipher_byte = kCipherByte, .direct = true});
}

// Yagel and Machiraju, Eq. 18: one round for each doubling of the workers, if messages do not get in each other's way.
TEST(SimulateFrames, ATreeTakesLogarithmicallyManyRounds) {
  for (std::uint32_t rounds = 0; rounds <= 6; ++rounds) {
    for (const Contention contention : {Contention::kNone, Contention::kSwitched}) {
      const double expected = 10 + rounds * (3.0 + 2.0);
      EXPECT_NEAR(Latency("fan-in", 1U << rounds, 10, SimpleMachine(contention, 3, 2)), expected, expected * kRelative) << rounds;
    }
  }
}

// Eq. 19: on a bus the messages of all rounds follow each other, p / 2 + p / 4 + ... = p - 1 of them.
TEST(SimulateFrames, OnABusATreeTakesOneMessageAfterAnother) {
  for (const std::uint32_t p : {2U, 4U, 8U, 32U}) {
    const double expected = 10 + (p - 1) * 3.0;
    EXPECT_NEAR(Latency("fan-in", p, 10, SimpleMachine(Contention::kSharedBus, 3, 0)), expected, expected * kRelative) << p;
  }
}

TEST(SimulateFrames, OneWorkerThatTakesAllImagesIsWhereTheyQueue) {
  for (const std::uint32_t p : {2U, 5U, 9U}) {
    const double by_wire = 10 + (p - 1) * 3.0 + 2, by_combining = 10 + 2 + (p - 1) * 3.0, side_by_side = 10 + 3 + (p - 1) * 2.0;
    EXPECT_NEAR(Latency("centralized", p, 10, SimpleMachine(Contention::kSwitched, 3, 2)), by_wire, by_wire * kRelative);
    EXPECT_NEAR(Latency("centralized", p, 10, SimpleMachine(Contention::kSwitched, 2, 3)), by_combining, by_combining * kRelative);
    EXPECT_NEAR(Latency("centralized", p, 10, SimpleMachine(Contention::kNone, 3, 2)), side_by_side, side_by_side * kRelative);
  }
}

// Everybody combines one share of the picture of all others; then the shares go to the root, which copies them.
TEST(SimulateFrames, DirectSendDividesTheWork) {
  for (const std::uint32_t p : {2U, 4U, 16U}) {
    const double expected = 10 + 2 * (3.0 / p + (p - 1) * 2.0 / p);
    EXPECT_NEAR(Latency("direct-send", p, 10, SimpleMachine(Contention::kNone, 3, 2)), expected, expected * kRelative) << p;
  }
}

TEST(SimulateFrames, PerfectBalanceWithoutCommunicationIsPerfect) {
  for (const std::uint32_t p : {1U, 3U, 30U}) {
    const MadeFrame frame(p, 4, kSide, 0.5, 1, "fan-in");
    const Timeline timeline = Simulate({frame.input(), frame.input(), frame.input()}, WithoutDelays(), 2);
    double rendering = 0;
    for (const SimulatedSpan& span : timeline.spans) rendering += span.stage == Stage::kRender ? span.end - span.begin : 0;
    EXPECT_NEAR(rendering / (timeline.end * p), 1, 1e-9);
    EXPECT_NEAR(timeline.end, 12, 1e-9);
    for (const SimulatedFrame& result : timeline.frames) EXPECT_NEAR(result.imbalance, 1, 1e-12);
  }
}

// The next group renders while one combines: a frame takes the longer of the two for each group, and the shorter one once.
TEST(SimulateFrames, GroupsHideTheirCombining) {
  const MachineModel machine = SimpleMachine(Contention::kNone, 1e-9, 4);
  const MadeFrame frame(2, 5, kSide, 1, 10, "fan-in");
  // Each group: render 10, combine at the root 4; accumulating in place takes its turn on the same lane, but no time here.
  EXPECT_NEAR(Simulate({frame.input()}, machine).frames[0].latency(), 5 * 10 + 4, 1e-3);
  const MachineModel slow = SimpleMachine(Contention::kNone, 1e-9, 25);
  // A group is accumulated when the next one is combined, so that the window opens late: the last group is not rendered meanwhile.
  EXPECT_NEAR(Simulate({frame.input()}, slow).frames[0].latency(), 10 + 5 * 25 + 10, 1e-2);
}

TEST(SimulateFrames, ImbalanceAndIdleShareAreThoseOfTheReports) {
  MadeFrame frame(4, 1, kSide, 0.5, 1, "fan-in");
  frame.costs()[2].seconds = 3;
  const SimulatedFrame result = Simulate({frame.input()}, WithoutDelays()).frames[0];
  EXPECT_NEAR(result.imbalance, 3 / 1.5, 1e-9);
  EXPECT_NEAR(result.idle_share, 1 - 6.0 / 12, 1e-9);
}

TEST(SimulateFrames, WorkersOfOneHostShareItsCores) {
  MachineModel machine = WithoutDelays();
  machine.workers_a_host = 4;
  machine.cores_a_host = 2;
  const MadeFrame frame(4, 1, kSide, 0.5, 1, "fan-in");
  EXPECT_NEAR(Simulate({frame.input()}, machine).frames[0].latency(), 2, 1e-9);
  machine.memory_slowdown = 0.25;
  EXPECT_NEAR(Simulate({frame.input()}, machine).frames[0].latency(), 2.5, 1e-9);
}

TEST(SimulateFrames, VoxelsComeBeforeRendering) {
  MachineModel machine = WithoutDelays();
  machine.link = {Contention::kSwitched, 0, 100};
  MadeFrame frame(2, 1, kSide, 0, 1, "fan-in");
  for (RenderCost& cost : frame.costs()) cost.voxel_bytes = 500;
  const SimulatedFrame result = Simulate({frame.input()}, machine).frames[0];
  EXPECT_NEAR(result.latency(), 10 + 1, 1e-9);  // one after the other out of the coordinator
  EXPECT_EQ(result.voxel_bytes, 1000);
}

// What cells and the voxels of other fields weigh is in the boxes' bytes: their chunks are not simulated one by one.
TEST(SimulateFrames, TheVoxelsOfABoxTravelAtOnceWhateverTheDatasetHas) {
  MadeFrame frame(2, 1, kSide, 0, 1, "fan-in");
  for (RenderCost& cost : frame.costs()) cost.voxel_bytes = 500;
  const double alone = Simulate({frame.input()}, WithoutDelays()).frames[0].latency();
  frame.plan().setup.cells = true;
  const VolumeDescription labels = {{{64, 64, 64}}, ScalarType::kUint64, {}};
  frame.plan().setup.fields.push_back({.levels = {{2, labels, {}}}, .of_volume = {0}, .look = {}, .labels = LabelLook()});
  const SimulatedFrame result = Simulate({frame.input()}, WithoutDelays()).frames[0];
  EXPECT_EQ(result.latency(), alone);
  EXPECT_EQ(result.voxel_bytes, 1000);
}

// A random run: several frames and groups, workers with several ranks or none, empty groups, any scheme, any machine.
struct RandomRun {
  std::vector<std::unique_ptr<MadeFrame>> frames;
  std::vector<FrameInput> inputs;
  MachineModel machine;
  int in_flight = 1;
};

RandomRun MakeRandomRun(Random& random) {
  RandomRun run;
  const auto workers = random.Integer<std::uint32_t>(1, 12);
  const int count = random.Integer(1, 4);
  for (int f = 0; f < count; ++f) {
    const auto groups = random.Integer<std::uint32_t>(1, 5);
    auto frame = std::make_unique<MadeFrame>(workers, groups, kSide, random.Real(0, 1), 0, RandomCombining(random),
                                             random.Chance(0.5) ? Splatting() : ZBuffer());
    const std::string combining = RandomCombining(random);
    for (RenderCost& cost : frame->costs()) cost.seconds = random.Real(0, 0.01);
    const auto owners = random.Integer<WorkerId>(1, workers);
    frame->plan().display = random.Integer<WorkerId>(1, workers);
    for (GroupPlan& group : frame->plan().groups) {
      if (random.Chance(0.1)) {
        group = {};
        continue;
      }
      for (Placement& placement : group.placements) placement.worker = (placement.worker - 1) % owners + 1;
      group.schedule = {combining, workers, {random.Integer<Rank>(0, workers - 1)}};
    }
    run.inputs.push_back(frame->input());
    run.inputs.back().finish_seconds = random.Real(0, 0.01);
    run.frames.push_back(std::move(frame));
  }
  run.machine.link = LinkPresets()[random.Integer<std::size_t>(0, LinkPresets().size() - 1)].link;
  run.machine.workers_a_host = random.Integer(0, 4);
  run.machine.cores_a_host = random.Integer(1, 4);
  run.machine.memory_slowdown = random.Real(0, 0.3);
  run.in_flight = random.Integer(1, 3);
  return run;
}

TEST(SimulateFrames, NothingHappensTwiceOrBeforeItsTime) {
  Random random(11);
  SCOPED_TRACE(random.trace());
  for (int i = 0; i < 200; ++i) {
    const RandomRun run = MakeRandomRun(random);
    const Timeline timeline = Simulate(run.inputs, run.machine, run.in_flight);

    std::map<std::pair<std::uint32_t, Lane>, double> lane_free;
    std::map<std::tuple<std::uint32_t, std::uint32_t, Rank>, double> rendered;
    std::vector<SimulatedSpan> spans = timeline.spans;
    std::stable_sort(spans.begin(), spans.end(), [](const SimulatedSpan& a, const SimulatedSpan& b) { return a.begin < b.begin; });
    for (const SimulatedSpan& span : spans) {
      double& free = lane_free[{span.worker, span.lane}];
      EXPECT_GE(span.begin, free - 1e-12);
      EXPECT_GE(span.end, span.begin);
      free = span.end;
      const std::tuple key(span.frame, span.group, span.rank);
      EXPECT_TRUE(span.stage != Stage::kRender || rendered.emplace(key, span.end).second);
    }

    std::size_t boxes = 0, steps = 0, group_images = 0;
    for (std::uint32_t f = 0; f < run.inputs.size(); ++f) {
      const FramePlan& plan = *run.inputs[f].plan;
      EXPECT_EQ(timeline.frames[f].groups_done.size(), plan.groups.size());
      for (std::uint32_t g = 0; g < plan.groups.size(); ++g) {
        const GroupPlan& group = plan.groups[g];
        boxes += group.placements.size();
        if (group.placements.empty()) continue;
        const SharedSchedule schedule = DeriveSchedule(group.schedule, WholeFrame(plan.setup)).value();
        for (const Step& step : schedule->steps()) {
          steps += group.placements[step.from].worker != group.placements[step.to].worker ? 1 : 0;
        }
        group_images += group.placements[group.schedule.roots.front()].worker != plan.display ? 1 : 0;
      }
    }
    EXPECT_EQ(rendered.size(), boxes);

    std::set<std::tuple<std::uint32_t, std::uint32_t, std::uint32_t>> partials;
    std::size_t images_sent = 0;
    for (const SimulatedMessage& message : timeline.messages) {
      EXPECT_NE(message.from, message.to);
      EXPECT_GE(message.begin, message.ready);
      EXPECT_GE(message.end, message.begin);
      if (message.kind == SimulatedMessage::Kind::kGroupImage) ++images_sent;
      if (message.kind != SimulatedMessage::Kind::kPartial) continue;
      EXPECT_TRUE(partials.emplace(message.frame, message.group, message.step).second);
      const FramePlan& plan = *run.inputs[message.frame].plan;
      const SharedSchedule schedule = DeriveSchedule(plan.groups[message.group].schedule, WholeFrame(plan.setup)).value();
      const Rank from = schedule->steps()[message.step].from;
      EXPECT_GE(message.ready, rendered.at({message.frame, message.group, from}));
    }
    EXPECT_EQ(partials.size(), steps);
    EXPECT_EQ(images_sent, group_images);

    // The window: when a group begins, no more are unfinished than it allows, over all frames and of a frame with masks.
    std::map<std::pair<std::uint32_t, std::uint32_t>, double> begun;
    for (const SimulatedSpan& span : spans) {
      if (span.stage == Stage::kRender) begun.try_emplace({span.frame, span.group}, span.begin);
    }
    const int window = WindowFor(timeline.workers, 1, 0).groups;
    for (const auto& [group, time] : begun) {
      int unfinished = 0, of_frame = 0;
      for (const auto& [other, begin] : begun) {
        if (begin > time || timeline.frames[other.first].groups_done[other.second] <= time) continue;
        ++unfinished;
        of_frame += other.first == group.first ? 1 : 0;
      }
      EXPECT_LE(unfinished, window);
      if (UsesOcclusion(run.inputs[group.first].plan->setup)) {
        EXPECT_LE(of_frame, kMaskedGroups);
      }
    }
    for (const SimulatedFrame& frame : timeline.frames) {
      EXPECT_GE(frame.planned, frame.submitted);
      EXPECT_GT(frame.received, frame.done);
      EXPECT_GE(frame.imbalance, 1 - 1e-12);
      EXPECT_TRUE(frame.idle_share >= 0 && frame.idle_share <= 1);
    }
  }
}

TEST(SimulateFrames, TheSameRunIsTheSameToTheLastBit) {
  Random random(12);
  SCOPED_TRACE(random.trace());
  for (int i = 0; i < 20; ++i) {
    const RandomRun run = MakeRandomRun(random);
    const Timeline a = Simulate(run.inputs, run.machine, run.in_flight), b = Simulate(run.inputs, run.machine, run.in_flight);
    EXPECT_EQ(a.end, b.end);
    ASSERT_EQ(a.spans.size(), b.spans.size());
    for (std::size_t s = 0; s < a.spans.size(); ++s) EXPECT_EQ(a.spans[s].end, b.spans[s].end);
  }
}

// With turns, p workers make pictures side by side; without, one makes them all.
TEST(SimulateFrames, PicturesAreMadeBesideEachOtherIfWorkersTakeTurns) {
  constexpr std::uint32_t kWorkers = 8;
  std::vector<std::unique_ptr<MadeFrame>> frames;
  std::vector<FrameInput> taking_turns, one_displays;
  for (std::uint32_t f = 0; f < 40; ++f) {
    for (std::vector<FrameInput>* inputs : {&taking_turns, &one_displays}) {
      frames.push_back(std::make_unique<MadeFrame>(kWorkers, 1, kSide, 0.5, 1, "fan-in"));
      frames.back()->plan().display = inputs == &taking_turns ? f % kWorkers + 1 : 1;
      frames.back()->plan().groups[0].schedule = {"fan-in", kWorkers, {frames.back()->plan().display - 1}};
      frames.back()->finish_seconds = 4;
      inputs->push_back(frames.back()->input());
    }
  }
  const double turns = Simulate(taking_turns, WithoutDelays(), 16).end, one = Simulate(one_displays, WithoutDelays(), 16).end;
  EXPECT_NEAR(turns, 40 + 4, 1e-9) << "rendering and the last picture";
  EXPECT_NEAR(one, 1 + 40 * 4, 1e-9) << "picture after picture";
}

// When so many frames end, four of them in flight. The workers of one process render each for 1 s and make its picture in `finish_seconds`.
double EndOfFrames(std::size_t count, std::uint32_t workers, double finish_seconds, const MachineModel& machine) {
  MadeFrame frame(workers, 1, kSide, 0.5, 1, "fan-in");
  frame.finish_seconds = finish_seconds;
  return Simulate(std::vector<FrameInput>(count, frame.input()), machine, 4).end;
}

// A worker of one core renders, combines and makes pictures one after the other, whatever number of threads it has.
TEST(SimulateFrames, AThreadIsNoCore) {
  MachineModel machine = WithoutDelays();
  machine.workers_a_host = machine.cores_a_host = 1;
  EXPECT_NEAR(EndOfFrames(20, 1, 0.5, machine), 20 * 1.5, 1e-9);
  machine.cores_a_host = 2;
  EXPECT_NEAR(EndOfFrames(20, 1, 0.5, machine), 20 + 0.5, 1e-9);
}

TEST(SimulateFrames, FewerCoresNeverHelpAlone) {
  MachineModel machine = WithoutDelays();
  machine.workers_a_host = 8;
  const MadeFrame frame(8, 2, kSide, 0.5, 1, "fan-in");
  double last = 0;
  for (machine.cores_a_host = 16; machine.cores_a_host >= 1; machine.cores_a_host /= 2) {
    const double latency = Simulate({frame.input()}, machine).frames[0].latency();
    EXPECT_GE(latency, last);
    last = latency;
  }
}

TEST(SimulateFrames, AThousandWorkersTakeEachStepOfTheScheduleOnce) {
  constexpr std::uint32_t kWorkers = 1024;
  for (const char* scheme : {"fan-in", "radix-k"}) {
    const MadeFrame frame(kWorkers, 1, kSide, 0.5, 1, scheme);
    const Timeline timeline = SimulateFrames(std::vector{frame.input()}, WithoutDelays(), {.keep_spans = false}).value();
    const PixelRange pixels = {0, std::uint64_t(kSide) * kSide};
    EXPECT_EQ(timeline.frames[0].messages, DeriveSchedule({scheme, kWorkers, {0}}, pixels).value()->steps().size()) << scheme;
    EXPECT_NEAR(timeline.frames[0].latency(), 1, 1e-9) << scheme;
  }
}

TEST(SimulateFrames, WhatDoesNotFitIsNamed) {
  const MachineModel machine;
  const auto message = [&](const FrameInput& input, const MachineModel& on) {
    const std::vector<FrameInput> frames = {input};
    return SimulateFrames(frames, on).status().message();
  };
  const MadeFrame frame(2, 1, kSide, 0.5, 1, "fan-in");
  FrameInput input = frame.input();
  input.boxes.pop_back();
  EXPECT_THAT(message(input, machine), HasSubstr("box 1 has no cost"));
  input = frame.input();
  input.boxes[0].seconds = -1;
  EXPECT_THAT(message(input, machine), HasSubstr("-1"));
  input = frame.input();
  const CoverageMap other = UniformCoverage({}, 0, 8, 8);
  input.boxes[0].coverage = &other;
  EXPECT_THAT(message(input, machine), HasSubstr("8 x 8"));
  EXPECT_THAT(SimulateFrames({}, machine, {.in_flight = 0}).status().message(), HasSubstr("in_flight is 0, but must be in [1, 256]"));
  MachineModel slow;
  slow.link.bytes_per_second = 0;
  EXPECT_THAT(message(frame.input(), slow), HasSubstr("link.bytes_per_second"));
  EXPECT_THAT(message({}, machine), HasSubstr("frames[0]"));
}

}  // namespace
}  // namespace slabstream
