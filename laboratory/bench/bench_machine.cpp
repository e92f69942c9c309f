#include "laboratory/bench/bench_machine.h"

#include <malloc.h>
#include <sched.h>
#include <sys/utsname.h>

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

#ifdef __clang__
constexpr const char* kCompiler = __VERSION__;  // "Clang 14.0.6"
#else
constexpr const char* kCompiler = "GCC " __VERSION__;
#endif

std::string KernelName() {
  utsname name{};
  if (::uname(&name) != 0) return "";
  return std::string(name.sysname) + ' ' + name.release;
}

int UsableCores() {
  cpu_set_t cores;
  if (::sched_getaffinity(0, sizeof cores, &cores) == 0) return CPU_COUNT(&cores);
  return std::max(1, int(std::thread::hardware_concurrency()));
}

}  // namespace

MachineInfo DescribeMachine() {
  MachineInfo machine{.cpu = ProcField("/proc/cpuinfo", "model name"),
                      .simd = SimdTargets().front(),
                      .cores = UsableCores(),
                      .flags = ProcField("/proc/cpuinfo", "flags"),
                      .kernel = KernelName(),
                      .compiler = kCompiler};
  std::ifstream("/sys/devices/system/cpu/cpu0/cpufreq/scaling_governor") >> machine.governor;
  std::ifstream("/proc/loadavg") >> machine.load;
  return machine;
}

void ResetPeakMemory() {
  ::malloc_trim(0);
  std::ofstream("/proc/self/clear_refs") << "5";  // proc(5): sets the peak to the memory resident now
}

std::int64_t PeakMemoryBytes() {
  const std::string kilobytes = ProcField("/proc/self/status", "VmHWM");
  return kilobytes.empty() ? 0 : std::stoll(kilobytes) * 1024;
}

}  // namespace slabstream
