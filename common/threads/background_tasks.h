// BackgroundTasks: tasks that may take long, on threads of their own. At most `most_threads` run at a time, in the order in which they were
// posted. Unlike TaskThread it does not wait for a running task when it is destroyed, so that a service can end at once. The first thread
// begins with the object, so a later lack of memory does not keep tasks from running. Without memory for more threads, fewer run at a time.
#pragma once

#include <atomic>
#include <condition_variable>
#include <cstddef>
#include <deque>
#include <exception>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <utility>

#include "common/base/log.h"

namespace slabstream {

class BackgroundTasks {
 public:
  // Throws std::system_error if no thread can be started.
  explicit BackgroundTasks(std::size_t most_threads) : shared_(std::make_shared<Shared>()), most_threads_(most_threads) { StartThread(); }
  // Drops the tasks that have not begun. Running ones go on, so they must own what they use.
  ~BackgroundTasks() {
    const std::lock_guard lock(shared_->mutex);
    shared_->closed = true;
    shared_->tasks.clear();
    shared_->changed.notify_all();
  }
  BackgroundTasks(const BackgroundTasks&) = delete;
  BackgroundTasks& operator=(const BackgroundTasks&) = delete;

  // Tasks report their own failures: an exception that leaves one is only logged. Post itself throws if it gets no memory; the task then
  // never runs.
  void Post(std::function<void()> task) {
    const std::lock_guard lock(shared_->mutex);
    shared_->tasks.push_back(std::move(task));
    if (shared_->idle < shared_->tasks.size() && threads_ < most_threads_) {
      try {
        StartThread();
      } catch (const std::exception& error) {
        LogWarning(std::string("no further thread for background tasks: ") + error.what());
      }
    }
    shared_->changed.notify_one();
  }

  // Whether a task of any BackgroundTasks runs in this process. If so, the process must end without destroying static objects (std::_Exit),
  // since the task may use them.
  static bool AnyRunning() { return running_ > 0; }

 private:
  struct Shared {
    std::mutex mutex;  // guards everything
    std::condition_variable changed;
    std::deque<std::function<void()>> tasks;
    std::size_t idle = 0;
    bool closed = false;
  };

  void StartThread() {
    std::thread([shared = shared_] { Run(*shared); }).detach();
    ++threads_;
  }

  static void Run(Shared& shared) {
    std::unique_lock lock(shared.mutex);
    while (true) {
      ++shared.idle;
      shared.changed.wait(lock, [&] { return shared.closed || !shared.tasks.empty(); });
      --shared.idle;
      if (shared.closed) return;
      std::function<void()> task = std::move(shared.tasks.front());
      shared.tasks.pop_front();
      ++running_;
      lock.unlock();
      try {
        task();
      } catch (const std::exception& error) {
        LogError(std::string("background task: ") + error.what());
      }
      task = nullptr;
      --running_;
      lock.lock();
    }
  }

  inline static std::atomic<int> running_ = 0;
  const std::shared_ptr<Shared> shared_;
  const std::size_t most_threads_;
  std::size_t threads_ = 0;  // Post's
};

}  // namespace slabstream
