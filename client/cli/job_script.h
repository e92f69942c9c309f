// The job script that `slabstream slurm` prints: a Slurm job array whose element 0 runs the coordinator and whose every element runs
// workers on a node of its own. Pure.
#pragma once

#include <string>
#include <vector>

namespace slabstream {

struct JobScript {
  int nodes = 1;             // [1, kMaxJobNodes]
  int workers_per_node = 1;  // [1, kMaxWorkersPerNode]
  int threads = 0;           // threads of each worker; 0: the job has its nodes for itself, and their cores are divided by the workers
  std::string time;          // time limit, as ParseTimeLimit takes it; empty: the partition's
  int notice_seconds = 60;   // [1, kMaxNoticeSeconds]: so long before the time limit workers get SIGTERM
  std::vector<std::string> directives;  // #SBATCH lines (ParseDirective); if two differ, Slurm takes the later
  std::vector<std::string> data;        // NAME=PATH or DIR, with absolute paths
  std::string dataset;                  // a name of the data, for the example that the job prints
  std::string programs;                 // folder of the programs, absolute
  std::string folder;                   // folder that all nodes share, absolute; empty: the one from which the job is submitted
};

// Paths may hold any bytes but zero.
std::string TextOf(const JobScript& script);

}  // namespace slabstream
