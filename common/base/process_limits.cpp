#include "common/base/process_limits.h"

#include <fmt/format.h>
#include <sys/resource.h>

#include <fstream>
#include <string>

namespace slabstream {
namespace {

// Of the control group, such as a container's; empty: there is none.
std::string GroupsThreads() {
  std::ifstream groups("/proc/self/cgroup");
  for (std::string line; std::getline(groups, line);) {
    if (!line.starts_with("0::")) continue;
    std::string most;
    std::ifstream("/sys/fs/cgroup" + line.substr(3) + "/pids.max") >> most;
    return most == "max" ? "" : most;
  }
  return "";
}

}  // namespace

std::string LimitsOf(Scarce what) {
  std::string text;
  const auto add = [&](const std::string& limit) { text += (text.empty() ? "; " : ", ") + limit; };
  const auto limit = [](__rlimit_resource_t resource) {
    rlimit found{};
    return ::getrlimit(resource, &found) == 0 ? found.rlim_cur : RLIM_INFINITY;
  };
  if (const rlim_t bytes = limit(RLIMIT_DATA); bytes != RLIM_INFINITY) {
    add(fmt::format("this process may have {} KiB of data (ulimit -d)", bytes >> 10));
  }
  if (const rlim_t bytes = limit(RLIMIT_AS); bytes != RLIM_INFINITY) {
    add(fmt::format("this process may have {} KiB of address space (ulimit -v)", bytes >> 10));
  }
  if (what == Scarce::kMemory) return text;
  if (const rlim_t threads = limit(RLIMIT_NPROC); threads != RLIM_INFINITY) {
    add(fmt::format("this user may have {} processes and threads (ulimit -u)", threads));
  }
  if (const std::string threads = GroupsThreads(); !threads.empty())
    add(fmt::format("its control group may have {} threads (pids.max)", threads));
  return text;
}

}  // namespace slabstream
