// ClientLanes: a thread for each client that has tasks: the tasks of a client run in order, and those of another one do not wait for them.
// When a lane has nothing more to do, any client may take it. So there are as many as clients ever had tasks at a time, and frames under
// way limit these.
//
// One thread uses an object of this class: the one that posts.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <utility>
#include <vector>

#include "common/parallel/task_arena.h"
#include "common/threads/task_thread.h"
#include "common/wire/ids.h"
#include "worker/renderers/renderer.h"

namespace slabstream {

// What belongs to the thread is for its tasks alone.
struct ClientLane {
  ClientLane(int threads, std::function<void()> on_exception) : arena(threads), thread(std::move(on_exception)) {}

  ClientId client = 0;
  TaskArena arena;                                                     // the thread's: in a shared one, its tasks would wait for others
  std::map<const RendererKind*, std::unique_ptr<Renderer>> renderers;  // the thread's
  TaskThread thread;                                                   // last member: ends before what its tasks use
};

class ClientLanes {
 public:
  // `threads` of each lane's arena. When a task throws, `on_exception` is called on its thread.
  ClientLanes(int threads, std::function<void()> on_exception) : threads_(threads), on_exception_(std::move(on_exception)) {}

  // The client's lane. It stays the client's as long as it has tasks.
  ClientLane& Of(ClientId client) {
    ClientLane* lane = nullptr;
    for (const std::unique_ptr<ClientLane>& each : lanes_) {
      if (each->client == client) return *each;
      if (lane == nullptr && each->thread.Idle()) lane = each.get();
    }
    if (lane == nullptr) lane = lanes_.emplace_back(std::make_unique<ClientLane>(threads_, on_exception_)).get();
    lane->client = client;
    return *lane;
  }

 private:
  const int threads_;
  const std::function<void()> on_exception_;
  std::vector<std::unique_ptr<ClientLane>> lanes_;
};

}  // namespace slabstream
