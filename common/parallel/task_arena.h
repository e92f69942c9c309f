// TaskArena: work in it shares its parallel loops (parallel.h) among at most so many threads. The process has one pool of threads, by
// default one less than there are cores, which help in all arenas; the thread that calls Run takes part and comes on top.
#pragma once

#include <memory>
#include <optional>
#include <type_traits>
#include <utility>

#include "common/base/function_ref.h"

namespace slabstream {

// Runs work of several threads at a time; Resize comes before or after all of it.
class TaskArena {
 public:
  explicit TaskArena(int threads);  // >= 1, with the calling one
  ~TaskArena();
  TaskArena(const TaskArena&) = delete;
  TaskArena& operator=(const TaskArena&) = delete;

  int threads() const;
  void Resize(int threads);  // >= 1

  // Calls work() on this thread, or on another one if as many threads as the arena has work in it. Returns what it returns, throws what it
  // throws.
  template <class Work>
  std::invoke_result_t<Work&> Run(Work&& work) {
    using Result = std::invoke_result_t<Work&>;
    if constexpr (std::is_void_v<Result>) {
      RunHere(work);
    } else {
      std::optional<Result> result;
      RunHere([&] { result.emplace(work()); });
      return *std::move(result);
    }
  }

 private:
  void RunHere(FunctionRef<void()> work);

  struct Arena;
  const std::unique_ptr<Arena> arena_;
};

// The threads of an arena without a limit of its own, as the machine has cores for this process.
int DefaultThreads();

// Lets the process use so many threads, more or fewer than by default, as long as this lives. Of several limits the least one counts.
class ThreadLimit {
 public:
  explicit ThreadLimit(int threads);  // >= 1
  ~ThreadLimit();
  ThreadLimit(const ThreadLimit&) = delete;
  ThreadLimit& operator=(const ThreadLimit&) = delete;

 private:
  struct Limit;
  const std::unique_ptr<Limit> limit_;
};

}  // namespace slabstream
