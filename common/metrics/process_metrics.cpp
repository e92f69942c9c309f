#include "common/metrics/process_metrics.h"

#include <sys/resource.h>

#include <filesystem>
#include <optional>
#include <system_error>

#include "common/base/version.h"
#include "common/memory/large_buffers.h"

namespace slabstream {
namespace {

double Seconds(const timeval& time) { return double(time.tv_sec) + double(time.tv_usec) / 1e6; }

std::optional<std::uint64_t> OpenFiles() {
  std::error_code error;
  std::filesystem::directory_iterator entry("/proc/self/fd", error);
  std::uint64_t count = 0;
  for (; !error && entry != std::filesystem::directory_iterator(); entry.increment(error)) ++count;
  return error ? std::nullopt : std::optional(count);
}

}  // namespace

void AddProcess(Exposition& out, std::uint64_t memory_limit) {
  out.Family("build_info", MetricType::kGauge, "1, with the version of the program.");
  out.Value(std::uint64_t{1}, {{"version", Version()}});
  if (const std::uint64_t bytes = ResidentBytes(); bytes != 0) {
    out.Single("process_resident_memory_bytes", MetricType::kGauge, "Memory of the process that is in RAM, shared memory included.", bytes);
  }
  if (memory_limit != 0) {
    out.Single("process_memory_limit_bytes", MetricType::kGauge, "Memory that the process may take (--memory).", memory_limit);
  }
  rusage usage{};
  if (::getrusage(RUSAGE_SELF, &usage) == 0) {
    out.Single("process_cpu_seconds_total", MetricType::kCounter, "Processor time of the process.",
               Seconds(usage.ru_utime) + Seconds(usage.ru_stime));
  }
  if (const auto files = OpenFiles()) {
    out.Single("process_open_fds", MetricType::kGauge, "File descriptors that are open.", *files);
  }
}

}  // namespace slabstream
