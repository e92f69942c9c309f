#include "common/parallel/task_arena.h"

#include <tbb/global_control.h>
#include <tbb/info.h>
#include <tbb/task_arena.h>

#include <cstddef>

namespace slabstream {

struct TaskArena::Arena {
  tbb::task_arena arena;
};

TaskArena::TaskArena(int threads) : arena_(new Arena{tbb::task_arena(threads)}) {}
TaskArena::~TaskArena() = default;

int TaskArena::threads() const { return arena_->arena.max_concurrency(); }

void TaskArena::Resize(int threads) {
  arena_->arena.terminate();
  arena_->arena.initialize(threads);
}

void TaskArena::RunHere(FunctionRef<void()> work) { arena_->arena.execute(work); }

int DefaultThreads() { return tbb::info::default_concurrency(); }

struct ThreadLimit::Limit {
  tbb::global_control control;
};

ThreadLimit::ThreadLimit(int threads)
    : limit_(new Limit{tbb::global_control(tbb::global_control::max_allowed_parallelism, std::size_t(threads))}) {}
ThreadLimit::~ThreadLimit() = default;

}  // namespace slabstream
