// The parts common to all experiments: folder, resumption, Ctrl-C, provenance and result files.
#pragma once

#include "laboratory/experiments/experiment.h"

namespace slabstream {

// Names and purposes, a line each.
std::string ExperimentList();

// Runs options.name, writes its report into options.folder and prints on stdout where it is. InvalidArgument, NotFound: an option, a file,
// or a folder that holds another run. Cancelled: by Ctrl-C; measurements stay in the folder and the same command continues.
Status RunExperiment(const ExperimentOptions& options);

}  // namespace slabstream
