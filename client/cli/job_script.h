// The job script that `slabstream slurm` prints: a Slurm job array whose element 0 runs the coordinator and whose every element runs
// workers on a node of its own. Pure.
#pragma once

#include <string>

#include "client/cli/options.h"

namespace slabstream {

// `options`: their paths are absolute, and may hold any bytes but zero; directives begin with dashes (ParseDirective), and of two that
// differ Slurm takes the later. `dataset`: a name of the data, for the example that the job prints. `programs`: their folder, absolute.
std::string JobScript(const SlurmOptions& options, const std::string& dataset, const std::string& programs);

}  // namespace slabstream
