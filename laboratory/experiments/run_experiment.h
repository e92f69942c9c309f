// The frame round every experiment: its folder, resumption, Ctrl-C, provenance and the files that it leaves behind.
#pragma once

#include "laboratory/experiments/experiment.h"

namespace slabstream {

// Names and purposes, a line each.
std::string ExperimentList();

// Runs options.name and writes its report into options.folder; says on stdout where it is. InvalidArgument, NotFound: an option, a file, or
// a folder that holds another run. Cancelled: by Ctrl-C; what is measured stays in the folder and the same command continues.
Status RunExperiment(const ExperimentOptions& options);

}  // namespace slabstream
