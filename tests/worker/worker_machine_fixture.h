// What tests of the worker machine have in common. They are scripted events: what it does about each, in each state.
#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <optional>
#include <vector>

#include "worker/machine/worker_machine.h"

namespace slabstream {

using std::chrono::milliseconds;
using std::chrono::seconds;
using testing::ElementsAre;
using testing::IsEmpty;
using testing::SizeIs;

inline constexpr Epoch kEpoch = 77;
inline constexpr WorkerId kSelf = 3, kPeer = 4;
using Actions = std::vector<WorkerAction>;

template <class T>
std::vector<T> All(const Actions& actions) {
  std::vector<T> found;
  for (const WorkerAction& action : actions) {
    if (const T* match = std::get_if<T>(&action)) found.push_back(*match);
  }
  return found;
}

template <class T>
std::vector<T> Sent(const Actions& actions) {
  std::vector<T> found;
  for (const SendControl& send : All<SendControl>(actions)) {
    if (const T* match = std::get_if<T>(&send.message)) found.push_back(*match);
  }
  return found;
}

// A machine and its time, registered unless the test says otherwise.
class WorkerMachineTest : public testing::Test {
 protected:
  static WorkerConfig Config() {
    WorkerConfig config;
    config.incarnation = 1000;
    config.host = "here";
    config.images_endpoint = "inproc://self";
    return config;
  }

  void SetUp() override { Start(Config()); }

  void Start(const WorkerConfig& config, bool registered = true) {
    machine.emplace(config);
    if (!registered) return;
    Tell(Tick{});
    Tell(WelcomeTo(config.incarnation));
    ASSERT_TRUE(machine->registered());
  }

  static Welcome WelcomeTo(Incarnation incarnation, Epoch epoch = kEpoch, WorkerId worker = kSelf) {
    return {epoch, incarnation, worker, "inproc://voxels", 500, 6000};
  }

  Actions Tell(WorkerEvent event) { return machine->Step(std::move(event), now); }
  Actions Tell(const MessageToWorker& message, Bytes payload = {}) {
    return Tell(WorkerEvent(MessageReceived{message, std::move(payload)}));
  }
  // Ticks at the end, and before that whenever the machine asks for it.
  Actions After(Duration time) {
    Actions actions;
    const Time end = now + time;
    do {
      now = std::clamp(machine->NextWake(), now, end);
      const Actions more = Tell(Tick{});
      actions.insert(actions.end(), more.begin(), more.end());
    } while (now < end);
    return actions;
  }

  // One group of a frame of 4 x 2 pixels: rank r shows box r, which is one MiB and a bit with its halo. Nothing is ever hidden.
  static GroupAssignment Assignment(FrameId frame, std::vector<WorkerId> placements, std::uint32_t group = 0, std::uint32_t group_count = 1,
                                    std::uint32_t attempt = 1) {
    GroupAssignment a;
    a.epoch = kEpoch;
    a.key = {frame, attempt, group};
    a.group_count = group_count;
    a.display = kSelf;
    a.setup.dataset = 1;
    a.setup.description.geometry.size = {128, 128, 640};
    a.setup.sheets.width = 4;
    a.setup.sheets.height = 2;
    a.setup.termination = 0;
    for (Rank rank = 0; rank < placements.size(); ++rank) {
      const std::int32_t padded = std::int32_t(group * 4 + rank);
      a.group.placements.push_back({BoxId(padded), {{0, 0, padded * 64}, {128, 128, padded * 64 + 64}}, placements[rank]});
    }
    a.group.schedule = {"fan-in", Rank(placements.size()), {0}};
    a.peers = {{kSelf, "inproc://self"}, {kPeer, "inproc://peer"}};
    return a;
  }

  static PartialImage FromPeer(const GroupKey& key) {  // rank 1 to rank 0
    PartialImage partial;
    partial.epoch = kEpoch;
    partial.from_worker = kPeer;
    partial.key = key;
    partial.interval = {1, 2};
    partial.pixels = {0, 8};
    partial.reports.resize(1);
    partial.reports[0].rank = 1;
    partial.reports[0].worker = kPeer;
    return partial;
  }

  static Chunk Answer(const ChunkRequest& request) {
    Chunk chunk;
    chunk.epoch = kEpoch;
    chunk.dataset = request.dataset;
    chunk.box = request.box;
    chunk.chunk = request.chunk;
    if (IsCellChunk(request.chunk)) {
      chunk.cell_bytes = chunk.raw_bytes = 100;
      return chunk;
    }
    const auto total = std::uint64_t(request.box.voxel_count());
    chunk.raw_bytes = std::uint32_t(std::min<std::uint64_t>(kChunkBytes, total - std::uint64_t(request.chunk) * kChunkBytes));
    return chunk;
  }

  // Answers chunk requests until there are none; returns everything else that was done.
  Actions Feed(Actions actions) {
    Actions others;
    for (std::size_t i = 0; i < actions.size(); ++i) {
      Actions more;
      if (const auto* request = std::get_if<SendChunkRequest>(&actions[i])) {
        more = Tell(Answer(request->request));
      } else if (const auto* store = std::get_if<StoreChunk>(&actions[i])) {
        more = Tell(ChunkStored{store->padded, store->chunk.box, store->chunk.chunk, {}});
      } else {
        others.push_back(actions[i]);
      }
      actions.insert(actions.end(), more.begin(), more.end());
    }
    return others;
  }

  Actions Rendered(const StartRender& render, Status status = {}) {
    return Tell(RenderDone{render.key, render.rank, render.image, std::move(status), {}, 0});
  }
  Actions Combined(const StartCombine& combine, Status status = {}) {
    return Tell(CombineDone{combine.key, combine.image, std::move(status), {}});
  }

  std::optional<WorkerMachine> machine;
  Time now{seconds(100)};
};

}  // namespace slabstream
