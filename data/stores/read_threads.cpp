#include "data/stores/read_threads.h"

#include <memory>
#include <utility>

#include "common/threads/background_tasks.h"
#include "common/threads/guarded.h"

namespace slabstream {
namespace {

// A disk wants several requests at a time, and more threads than that only wait for it. They are never destroyed, since stores may read
// until the process ends.
BackgroundTasks& Threads() {
  constexpr std::size_t kThreads = 8;
  static BackgroundTasks& threads = *new BackgroundTasks(kThreads);
  return threads;
}

}  // namespace

void PostRead(std::function<void()> task) { Threads().Post(std::move(task)); }

void ReadOnThread(std::string what, std::function<Result<Bytes>()> read, Store::Done done) {
  struct Task {
    std::string what;
    std::function<Result<Bytes>()> read;
    Store::Done done;
    void Run() { done(Guarded(what.c_str(), read)); }
  };
  std::shared_ptr<Task> task;
  try {
    task = std::make_shared<Task>(std::move(what), std::move(read), std::move(done));
    PostRead([task] { task->Run(); });
  } catch (...) {
    if (task == nullptr) throw;  // nobody was promised anything yet
    task->done(CurrentFailure(task->what));
  }
}

}  // namespace slabstream
