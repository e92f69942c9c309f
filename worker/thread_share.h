// ThreadShare: the threads that one worker computes with, for as long as it lives.
//
// oneTBB has one pool of threads a process, by default one less than there are cores, and all task arenas draw from it. Several workers may
// live in a process, and users may ask for more threads than cores: the shares of a process together see to it that the pool is as large as
// its workers were told. A pool that is larger by default stays as it is; arenas bound what a worker takes of it.
#pragma once

namespace slabstream {

class ThreadShare {
 public:
  explicit ThreadShare(int threads);  // at least 1: the calling thread of an arena is one of them
  ~ThreadShare();
  ThreadShare(const ThreadShare&) = delete;
  ThreadShare& operator=(const ThreadShare&) = delete;

  int threads() const { return threads_; }
  // Those of all workers of this process together, as of now, as far as one arena can have them.
  static int OfProcess();

 private:
  const int threads_;
};

}  // namespace slabstream
