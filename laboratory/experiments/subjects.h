// Subjects: the volumes that `partitions` and `balance` divide, each under every renderer, and the options that choose them.
#pragma once

#include <string>
#include <vector>

#include "laboratory/experiments/experiment.h"

namespace slabstream {

// VOLUME, --workers and --renderer. `workers`: the default, for --help.
void DeclareSubjects(const Command& app, OwnOptions& options, const std::string& workers);

// What the user named, or else sparse volumes that are made here, `size` voxels a side, and in a run that is not quick the real ones.
std::vector<BenchCase> SubjectsOf(const ExperimentOptions& options, int size);

// The datasets that the user named, as at a service. Throws Failure: none was named; those of ParseBenchCase.
std::vector<BenchCase> SubjectsAtService(const ExperimentOptions& options);

// Before a run: each can be drawn with such a view. Throws Failure.
void CheckSubjects(const std::vector<BenchCase>& subjects, const ViewParameters& view);

}  // namespace slabstream
