// PerThread<T>: a value for each thread that asks for one, such as a sum that each thread begins for itself, or room for intermediate
// values. While a call of a parallel loop (parallel.h) waits for a loop of its own, its thread may take another call, which finds the same
// value.
#pragma once

#include <list>
#include <memory>
#include <mutex>
#include <utility>

namespace slabstream {

// One pointer for each thread, at first null.
class ThreadSlots {
 public:
  ThreadSlots();
  ~ThreadSlots();
  ThreadSlots(const ThreadSlots&) = delete;
  ThreadSlots& operator=(const ThreadSlots&) = delete;

  void*& Mine();  // any thread

 private:
  struct Slots;
  const std::unique_ptr<Slots> slots_;
};

template <class T>
class PerThread {
 public:
  // The calling thread's value, which make() makes at the thread's first call. Any thread.
  template <class Make>
  T& Mine(Make&& make) {
    void*& mine = slots_.Mine();
    if (mine == nullptr) {
      const std::lock_guard lock(mutex_);
      mine = &values_.emplace_back(make()).value;
    }
    return *static_cast<T*>(mine);
  }
  T& Mine() {
    return Mine([] { return T{}; });
  }

  // function(value) for each, in any order. Only while no thread calls Mine or uses its value.
  template <class Function>
  void ForEach(Function&& function) const {
    for (const Value& each : values_) function(each.value);
  }

 private:
  // Of its own cache lines, so that no thread slows down another one's.
  struct alignas(128) Value {
    explicit Value(T made) : value(std::move(made)) {}
    T value;
  };

  ThreadSlots slots_;
  std::mutex mutex_;
  std::list<Value> values_;  // guarded by mutex_
};

}  // namespace slabstream
