// How many files, sockets included, this process may have open.
#pragma once

#include <sys/resource.h>

#include <cstdint>

namespace slabstream {

// As many as the system lets it; returns how many.
inline std::uint64_t AllowOpenFiles() {
  rlimit limit{};
  if (::getrlimit(RLIMIT_NOFILE, &limit) != 0) return 0;
  if (limit.rlim_cur < limit.rlim_max) {
    const rlimit more = {limit.rlim_max, limit.rlim_max};
    if (::setrlimit(RLIMIT_NOFILE, &more) == 0) limit = more;
  }
  return limit.rlim_cur;
}

}  // namespace slabstream
