// ThreadShare: the threads that one worker computes with, for as long as it lives.
//
// oneTBB has one pool of threads per process, by default one less than there are cores, and all task arenas draw from it. Several workers
// may live in a process, and users may ask for more threads than cores: together, the shares of a process make the pool as large as its
// workers need. A pool that is larger by default stays as it is; arenas limit what a worker takes from it.
#pragma once

namespace slabstream {

class ThreadShare {
 public:
  explicit ThreadShare(int threads);  // at least 1: the calling thread of an arena is one of them
  ~ThreadShare();
  ThreadShare(const ThreadShare&) = delete;
  ThreadShare& operator=(const ThreadShare&) = delete;

  // The threads of all workers of this process together, now, limited to what one arena can have.
  static int OfProcess();

 private:
  const int threads_;
};

}  // namespace slabstream
