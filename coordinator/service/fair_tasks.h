// FairTasks: tasks of several owners, on threads of their own (BackgroundTasks). Tasks may take long. The tasks of one owner begin in the
// order in which they were posted, and at most `most_of_an_owner` of them run at a time. The next task belongs to the owner that has used
// least time (FairTurns). So neither many tasks of one owner nor a long one delay the tasks of another owner, as long as long tasks of
// others leave a thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <exception>
#include <functional>
#include <list>
#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <utility>

#include "common/base/log.h"
#include "common/threads/background_tasks.h"
#include "common/threads/fair_turns.h"

namespace slabstream {

class FairTasks {
 public:
  using Owner = std::uint64_t;

  explicit FairTasks(std::size_t most_threads, std::size_t most_of_an_owner = 1)
      : shared_(std::make_shared<Shared>(most_of_an_owner)), threads_(most_threads) {}
  // Drops the tasks that have not begun. Running ones go on, so they must own what they use.
  ~FairTasks() {
    const std::lock_guard lock(shared_->mutex);
    shared_->waiting.clear();
  }
  FairTasks(const FairTasks&) = delete;
  FairTasks& operator=(const FairTasks&) = delete;

  // Posts the tasks of one owner, for code that knows nothing of owners.
  struct OfOwner {
    FairTasks& tasks;
    Owner owner;
    void Post(std::function<void()> task) { tasks.Post(owner, std::move(task)); }
  };
  OfOwner Of(Owner owner) { return {*this, owner}; }

  // Tasks report their own failures: an exception that leaves one is only logged. Post itself throws if it gets no memory; the task then
  // runs when a later one is posted, or never.
  void Post(Owner owner, std::function<void()> task) {
    std::list<std::function<void()>> one;
    one.push_back(std::move(task));
    {
      const std::lock_guard lock(shared_->mutex);
      if (!shared_->waiting.contains(owner) && !shared_->running.contains(owner)) shared_->turns.Join(owner);
      std::list<std::function<void()>>& waiting = shared_->waiting[owner];
      waiting.splice(waiting.end(), one);  // does not throw, so no owner's list stays empty
    }
    threads_.Post([shared = shared_] { RunTasks(*shared); });
  }

 private:
  struct Shared {
    explicit Shared(std::size_t most) : most_of_an_owner(most) {}
    const std::size_t most_of_an_owner;
    std::mutex mutex;                                           // guards what follows
    std::map<Owner, std::list<std::function<void()>>> waiting;  // none of them empty
    std::multiset<Owner> running;                               // once for each task
    FairTurns<Owner> turns;
  };

  // Runs tasks until all that wait belong to owners that have enough running. The threads of those owners will come to them.
  static void RunTasks(Shared& shared) {
    std::unique_lock lock(shared.mutex);
    while (true) {
      auto next = shared.waiting.end();
      for (auto it = shared.waiting.begin(); it != shared.waiting.end(); ++it) {
        if (shared.running.count(it->first) >= shared.most_of_an_owner) continue;
        if (next == shared.waiting.end() || shared.turns.TurnOf(it->first) < shared.turns.TurnOf(next->first)) next = it;
      }
      if (next == shared.waiting.end()) return;
      const Owner owner = next->first;
      shared.running.insert(owner);  // first: if it throws, the task still waits
      std::function<void()> task = std::move(next->second.front());
      next->second.pop_front();
      if (next->second.empty()) shared.waiting.erase(next);
      shared.turns.Take(owner);
      lock.unlock();
      const Time begin = MonotonicNow();
      try {
        task();
      } catch (const std::exception& error) {
        LogError(std::string("background task: ") + error.what());
      }
      task = nullptr;
      const Time end = MonotonicNow();
      lock.lock();
      shared.turns.Charge(owner, end - begin);
      shared.running.erase(shared.running.find(owner));
      shared.turns.ForgetIdle([&](Owner each) { return shared.waiting.contains(each) || shared.running.contains(each); });
    }
  }

  const std::shared_ptr<Shared> shared_;
  BackgroundTasks threads_;
};

}  // namespace slabstream
