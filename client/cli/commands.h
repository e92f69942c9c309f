// The subcommands of `slabstream`, one source file each. A command prints its results on stdout; what it returns is told on stderr in one
// line by the caller, which also makes the exit status of it (see command_line.h).
#pragma once

#include "client/cli/options.h"
#include "common/base/status.h"

namespace slabstream {

Status RunRender(const RenderOptions& options);
Status RunTurntable(const TurntableOptions& options);
Status RunBench(const BenchOptions& options);
Status RunInfo(const InfoOptions& options);
Status RunSphere(const SphereOptions& options);
Status RunUp(const UpOptions& options);
Status RunDown(const DownOptions& options);
Status RunStatus(const StatusOptions& options);

}  // namespace slabstream
