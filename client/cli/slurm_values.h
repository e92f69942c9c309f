// Parses what Slurm takes: times and options of sbatch. Pure. Errors as in common/cli/parse.h.
#pragma once

#include <string>
#include <string_view>

#include "common/base/status.h"

namespace slabstream {

inline constexpr int kMaxJobNodes = 1000;  // Slurm's MaxArraySize is 1001 unless a site changes it
inline constexpr int kMaxWorkersPerNode = 256;
inline constexpr int kMaxNoticeSeconds = 65535;  // Slurm's limit

struct TimeLimit {
  std::string text;  // as Slurm takes it; empty: none
  int seconds = 0;
};

// MINUTES, MINUTES:SECONDS, HOURS:MINUTES:SECONDS, DAYS-HOURS, DAYS-HOURS:MINUTES or DAYS-HOURS:MINUTES:SECONDS, from one minute to 365
// days. Only the first number may be larger than the unit before it allows (90:00, but not 1:90:00).
Result<TimeLimit> ParseTimeLimit(std::string_view option, std::string_view text);

// A long option of sbatch, with or without its dashes, such as "partition=long" or "exclusive"; returned with them, as it stands on an
// #SBATCH line. Refuses what a job script decides itself (array, nodes, ntasks) and characters that end a line.
Result<std::string> ParseDirective(std::string_view option, std::string_view text);

}  // namespace slabstream
