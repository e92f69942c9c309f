// A process that can start no thread, as when there is no memory for another one.
#pragma once

#include <pthread.h>

#include <cstddef>

#include "common/base/check.h"

namespace slabstream {

// Until the destructor, std::thread throws: the stack that it asks for is larger than the address space.
class NoMoreThreads {
 public:
  NoMoreThreads() {
    CHECK_EQ(::pthread_getattr_default_np(&before_), 0);
    pthread_attr_t huge;
    CHECK_EQ(::pthread_attr_init(&huge), 0);
    CHECK_EQ(::pthread_attr_setstacksize(&huge, std::size_t{1} << 48), 0);
    CHECK_EQ(::pthread_setattr_default_np(&huge), 0);
    ::pthread_attr_destroy(&huge);
  }
  ~NoMoreThreads() {
    ::pthread_setattr_default_np(&before_);
    ::pthread_attr_destroy(&before_);
  }
  NoMoreThreads(const NoMoreThreads&) = delete;
  NoMoreThreads& operator=(const NoMoreThreads&) = delete;

 private:
  pthread_attr_t before_;
};

}  // namespace slabstream
