#include "client/cli/report_files.h"

#include "client/cli/stats_json.h"
#include "client/cli/trace_json.h"
#include "common/base/files.h"

namespace slabstream {

Status CheckReportPaths(const FrameOptions& options) {
  if (!options.stats_path.empty()) {
    if (Status status = CheckCanWrite("--stats", options.stats_path); !status.ok()) return status;
  }
  return options.trace_path.empty() ? Status::Ok() : CheckCanWrite("--trace", options.trace_path);
}

Status WriteReports(const FrameOptions& options, const std::vector<FrameRecord>& frames) {
  if (!options.stats_path.empty()) {
    if (Status status = WriteTextFile(options.stats_path, StatsJson(options, frames)); !status.ok()) return status;
  }
  return options.trace_path.empty() ? Status::Ok() : WriteTextFile(options.trace_path, TraceJson(options, frames));
}

}  // namespace slabstream
