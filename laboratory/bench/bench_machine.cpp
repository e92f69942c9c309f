#include "laboratory/bench/bench_machine.h"

#include <malloc.h>
#include <sched.h>

#include <algorithm>
#include <fstream>
#include <string_view>
#include <thread>

#include "common/kernels/simd_target.h"

namespace slabstream {
namespace {

// The text after the colon in the first line of a /proc file that begins with `field`; empty if there is none.
std::string ProcField(const char* path, std::string_view field) {
  std::ifstream file(path);
  for (std::string line; std::getline(file, line);) {
    if (line.compare(0, field.size(), field) != 0) continue;
    const std::size_t begin = line.find_first_not_of(" \t", std::min(line.size(), line.find(':') + 1));
    return begin == std::string::npos ? "" : line.substr(begin);
  }
  return "";
}

int UsableCores() {
  cpu_set_t cores;
  if (::sched_getaffinity(0, sizeof cores, &cores) == 0) return CPU_COUNT(&cores);
  return std::max(1, int(std::thread::hardware_concurrency()));
}

}  // namespace

MachineInfo DescribeMachine() { return {ProcField("/proc/cpuinfo", "model name"), SimdTargets().front(), UsableCores()}; }

void ResetPeakMemory() {
  ::malloc_trim(0);
  std::ofstream("/proc/self/clear_refs") << "5";  // proc(5): sets the peak to the memory resident now
}

std::int64_t PeakMemoryBytes() {
  const std::string kilobytes = ProcField("/proc/self/status", "VmHWM");
  return kilobytes.empty() ? 0 : std::stoll(kilobytes) * 1024;
}

}  // namespace slabstream
