// Outputs: what an Executor puts into its outbox, one after the other. Waits for the next one.
#pragma once

#include <utility>
#include <variant>
#include <vector>

#include "common/transport/socket.h"
#include "worker/service/executor.h"

namespace slabstream {

struct Outputs {
  Mailbox<ExecutorOutput> outbox;

  ExecutorOutput Next() {
    while (waiting.empty()) {
      Wait({}, &outbox.wakeup(), std::chrono::seconds(10));
      waiting = outbox.TakeAll();
    }
    ExecutorOutput first = std::move(waiting.front());
    waiting.erase(waiting.begin());
    return first;
  }
  template <class Event>
  Event NextEvent() {
    return std::get<Event>(std::get<WorkerEvent>(Next()));
  }

  std::vector<ExecutorOutput> waiting;
};

}  // namespace slabstream
