// A disk that is full, as far as this process and the programs that it starts can tell: no file grows beyond a limit.
#pragma once

#include <sys/resource.h>

#include <csignal>

#include "common/base/check.h"

namespace slabstream {

// Until the destructor, writing beyond `bytes` of any file fails with EFBIG ("File too large"). That holds for the test's own output too if
// it goes to a file: so expect nothing meanwhile.
class FullDisk {
 public:
  explicit FullDisk(rlim_t bytes) {
    CHECK_EQ(::getrlimit(RLIMIT_FSIZE, &before_), 0);
    handler_ = std::signal(SIGXFSZ, SIG_IGN);
    const rlimit limit{bytes, before_.rlim_max};
    CHECK_EQ(::setrlimit(RLIMIT_FSIZE, &limit), 0);
  }
  ~FullDisk() {
    ::setrlimit(RLIMIT_FSIZE, &before_);
    std::signal(SIGXFSZ, handler_);
  }
  FullDisk(const FullDisk&) = delete;
  FullDisk& operator=(const FullDisk&) = delete;

 private:
  rlimit before_{};
  void (*handler_)(int) = SIG_DFL;
};

// What `function` returns on a full disk.
template <class Function>
auto OnFullDisk(rlim_t bytes, Function function) {
  const FullDisk full(bytes);
  return function();
}

}  // namespace slabstream
