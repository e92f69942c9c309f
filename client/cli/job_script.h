// The job script that `slabstream slurm` prints: a Slurm job array whose element 0 runs the coordinator and whose every element runs
// workers on a node of its own. Pure.
#pragma once

#include <string>
#include <string_view>

#include "client/cli/options.h"
#include "common/base/status.h"

namespace slabstream {

// `text` is a long option of sbatch, such as "partition=long" or "--partition=long". The result is the option with its dashes, as an
// #SBATCH line has it. InvalidArgument: the script itself decides the option (array, nodes, ntasks), or the text has a control character,
// which may end the line. sbatch reports all other errors.
Result<std::string> ParseDirective(std::string_view text);

// `options`: their paths are absolute, and may hold any bytes but zero; directives begin with dashes (ParseDirective), and of two that
// differ Slurm takes the later. `dataset`: a name of the data, for the example that the job prints. `programs`: their folder, absolute.
std::string JobScript(const SlurmOptions& options, const std::string& dataset, const std::string& programs);

}  // namespace slabstream
