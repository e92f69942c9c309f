// TaskThread: one thread that runs tasks in the order in which they were posted.
#pragma once

#include <condition_variable>
#include <deque>
#include <exception>
#include <functional>
#include <mutex>
#include <stop_token>
#include <string>
#include <thread>
#include <utility>

#include "common/base/log.h"

namespace slabstream {

class TaskThread {
 public:
  // When a task throws, `on_exception` is called on the thread; it must not throw.
  explicit TaskThread(std::function<void()> on_exception = std::terminate)
      : on_exception_(std::move(on_exception)), thread_([this](const std::stop_token& stop) { Run(stop); }) {}
  // Waits for the running task; tasks that have not begun are dropped.
  ~TaskThread() = default;
  TaskThread(const TaskThread&) = delete;
  TaskThread& operator=(const TaskThread&) = delete;

  // From any thread. Tasks report their own failures; `on_exception` is called if one throws.
  void Post(std::function<void()> task) {
    {
      const std::lock_guard lock(mutex_);
      tasks_.push_back(std::move(task));
    }
    ready_.notify_one();
  }

  // True if no task runs or waits. A caller that alone posts may rely on it until its next Post.
  bool Idle() {
    const std::lock_guard lock(mutex_);
    return tasks_.empty() && !running_;
  }

 private:
  void Run(const std::stop_token& stop) {
    while (true) {
      std::function<void()> task;
      {
        std::unique_lock lock(mutex_);
        ready_.wait(lock, stop, [this] { return !tasks_.empty(); });
        if (stop.stop_requested()) return;
        task = std::move(tasks_.front());
        tasks_.pop_front();
        running_ = true;
      }
      try {
        task();
      } catch (const std::exception& error) {
        LogError(std::string("task: ") + error.what());
        on_exception_();
      }
      task = nullptr;  // frees what it held before Idle can return true
      const std::lock_guard lock(mutex_);
      running_ = false;
    }
  }

  const std::function<void()> on_exception_;
  std::mutex mutex_;
  std::condition_variable_any ready_;
  std::deque<std::function<void()>> tasks_;  // guarded by mutex_
  bool running_ = false;                     // guarded by mutex_
  std::jthread thread_;                      // last member: ends before the others are destroyed
};

}  // namespace slabstream
