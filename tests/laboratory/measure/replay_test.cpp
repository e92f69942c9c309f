#include "laboratory/measure/replay.h"
#include "common/json/json.h"
#include "common/renderers/registry.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>

#include "client/client.h"
#include "client/embedded/embedded_service.h"
#include "common/combining/schemes.h"
#include "common/volume/sphere.h"
#include "tests/laboratory/measure/recorded.h"

namespace slabstream {
namespace {

using ::testing::HasSubstr;

TEST(Replay, ChangesAreParsed) {
  const std::vector<std::string> texts = {"combine=radix-k:2x2", "link=10gbit:5,20", "workers=16"};
  const ReplayChange change = ParseReplayChange(texts).value();
  EXPECT_EQ(change.combine, "radix-k:2x2");
  EXPECT_DOUBLE_EQ(change.link->latency_seconds, 5e-6);
  EXPECT_EQ(change.workers, 16);
  for (const char* text : {"", "combine", "combine=", "combine=stirring", "combine=auto", "link=string", "workers=0", "workers=-1",
                           "workers=2x", "workers=", "speed=3", "workers=99999999999"}) {
    const std::vector<std::string> wrong = {text};
    const auto parsed = ParseReplayChange(wrong);
    ASSERT_FALSE(parsed.ok()) << text;
    EXPECT_THAT(parsed.status().message(), HasSubstr("--with"));
  }
  const std::vector<std::string> twice = {"workers=1", "workers=2"};
  EXPECT_THAT(ParseReplayChange(twice).status().message(), HasSubstr("twice"));
}

TEST(Replay, WithoutAChangeNothingChanges) {
  Random random(3);
  SCOPED_TRACE(random.trace());
  for (int i = 0; i < 10; ++i) {
    const std::vector<RecordedFrame> frames = RandomRecording(random, 4, random.Integer(1U, 8U));
    const ReplayReport report = Replay(frames, {}, MachineModel(), MachineModel()).value();
    EXPECT_EQ(report.as_it_was.latency, report.changed.latency);
    EXPECT_EQ(report.as_it_was.image_bytes, report.changed.image_bytes);
    EXPECT_NEAR(report.as_it_was.imbalance, report.measured.imbalance, 1e-9);
    EXPECT_EQ(report.in_flight, 1);
  }
}

TEST(Replay, FramesThatOverlapWereInFlightTogether) {
  Random random(4);
  SCOPED_TRACE(random.trace());
  std::vector<RecordedFrame> frames = RandomRecording(random, 6, 2);
  for (std::size_t i = 0; i < frames.size(); ++i) {
    frames[i].arrived = double(i);
    frames[i].end = frames[i].arrived + 2.5;
  }
  EXPECT_EQ(Replay(frames, {}, MachineModel(), MachineModel()).value().in_flight, 3);
}

// One box each, nothing but rendering: twice the workers take half the time.
TEST(Replay, MoreWorkersShareTheBoxes) {
  std::vector<RecordedFrame> frames(1);
  frames[0].grid = {0, 0, 64, 64};
  frames[0].display = 1;
  frames[0].combine = "fan-in";
  frames[0].groups.resize(8);
  for (BoxId box = 0; box < 8; ++box) frames[0].groups[box] = {{box, 1, 1.0, {}, 0}};
  frames[0].latency = frames[0].end = 8;
  for (const int workers : {1, 2, 4, 8}) {
    const ReplayReport report = Replay(frames, {.workers = workers}, MachineModel(), MachineModel()).value();
    EXPECT_NEAR(report.changed.latency, 8.0 / workers, 0.01) << workers;
    EXPECT_NEAR(report.as_it_was.latency, 8, 0.01);
  }
  const auto too_many = Replay(frames, {.workers = 9}, MachineModel(), MachineModel());
  ASSERT_FALSE(too_many.ok());
  EXPECT_THAT(too_many.status().message(), HasSubstr("at most 8"));
}

// Recorded times hold what the machine did to them, such as the wake-ups to and from the client.
TEST(Replay, WhatWasRecordedIsNotChargedTwice) {
  RecordedFrame frame{.grid = {0, 0, 16, 16}, .display = 1, .combine = "fan-in", .end = 10, .latency = 11, .picture_seconds = 1};
  frame.groups = {{{.box = 0, .worker = 1, .render_seconds = 8, .bounds = frame.grid, .pixels = 256}}};
  MachineModel machine;
  machine.plan_seconds = machine.message_seconds = machine.link.latency_seconds = 0;
  machine.wake_ups = {.awake = 0.1, .asleep = 0.1};
  const ReplayReport report = Replay(std::span(&frame, 1), {}, machine, machine).value();
  // Eight wake-ups between the coordinator's taking the request and its having the picture (two of them for the plan), and a second
  // outside.
  EXPECT_NEAR(report.as_it_was.latency, 8 + 1 + 8 * 0.1 + 1, 1e-6);
}

TEST(Replay, SlowerLinksTakeLonger) {
  Random random(5);
  SCOPED_TRACE(random.trace());
  const std::vector<RecordedFrame> frames = RandomRecording(random, 3, 6);
  double last = 0;
  for (const char* rate : {"100", "1", "0.01"}) {
    const ReplayChange change = {.link = ParseLink("link", std::string("10gbit:1,") + rate).value()};
    MachineModel changed;
    changed.link = *change.link;
    const double latency = Replay(frames, change, MachineModel(), changed).value().changed.latency;
    EXPECT_GT(latency, last);
    last = latency;
  }
}

// What a service reports can be recorded, written, read and replayed, under every scheme.
TEST(Replay, FramesOfTheServiceCanBeReplayed) {
  const auto volume = std::make_shared<const Volume>(MakeSphere({SphereClass::kHollow, 48, 0.1}).value());
  Context context;
  EmbeddedOptions options;
  options.workers = 3;
  options.coordinator.catalogue["sphere"] = [volume]() -> Result<std::shared_ptr<const Volume>> { return volume; };
  const std::unique_ptr<EmbeddedService> service = EmbeddedService::Start(context, std::move(options)).value();
  Client client = service->Connect().value();
  std::vector<RecordedFrame> frames;
  for (int i = 0; i < 3; ++i) {
    FrameRequest request;
    request.dataset = "sphere";
    request.size = {96, 96};
    request.view.azimuth_degrees = 40.0 * i;
    request.policy.groups = 2;
    const Picture picture = client.Render(request).value();
    frames.push_back(Record(picture.statistics, picture.latency));
    const RecordedFrame& frame = frames.back();
    ASSERT_EQ(frame.groups.size(), 2U);
    EXPECT_FALSE(frame.grid.empty());
    EXPECT_GT(frame.picture_seconds, 0);
    EXPECT_GE(frame.latency, frame.end - frame.begin);
    for (const auto& group : frame.groups) {
      for (const RecordedRank& rank : group) {
        EXPECT_TRUE(frame.grid.Contains(rank.bounds));
        EXPECT_GT(rank.render_seconds, 0);
        EXPECT_GT(rank.pixels, 0);
        EXPECT_LE(rank.pixels, double(rank.bounds.pixel_count()));
      }
    }
  }
  const Json trace = {{kRecordingKey, RecordingJson(frames)}};
  const std::vector<RecordedFrame> read = ParseRecording(trace.dump()).value();
  for (const CombiningEntry& scheme : CombiningSchemes()) {
    const ReplayReport report = Replay(read, {.combine = std::string(scheme.name)}, MachineModel(), MachineModel()).value();
    EXPECT_GT(report.changed.latency, 0) << scheme.name;
    EXPECT_GT(report.changed.image_bytes, 0) << scheme.name;
    EXPECT_GT(report.measured.latency, 0);
  }
}

}  // namespace
}  // namespace slabstream
