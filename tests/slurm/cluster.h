// SlurmCluster: a real Slurm on this machine. The login host, with slurmctld, and each node, with a slurmd, have a network namespace of
// their own (Hosts) and a process namespace of their own: whatever a daemon or a job started ends with it, however the test ends.
//
// All hosts share the folders of this machine. Partition "low" is the default one; jobs of partition "high" preempt those of "low", which
// are requeued after a grace time of kGraceSeconds.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "common/base/status.h"
#include "tests/end_to_end/program.h"
#include "tests/network/hosts.h"

namespace slabstream {

class SlurmCluster {
 public:
  static constexpr int kGraceSeconds = 5;

  // Returns when all `nodes` are idle. Unavailable: packages or namespaces cannot be had here. DeadlineExceeded: Slurm does not start.
  // `directory`: for its state and logs.
  static Result<std::unique_ptr<SlurmCluster>> Start(const std::string& directory, int nodes);

  static std::string NameOf(int node) { return std::string("n").append(std::to_string(node)); }  // from 0

  // A program on the login host, such as squeue or slabstream, which runs in `directory`.
  ProgramResult Run(const std::vector<std::string>& command) const;
  // The same for a program that must exit with 0: its stdout without the last newline.
  std::string Output(const std::vector<std::string>& command) const;

  // A host that falls over: everything on it ends at once. It does not come back.
  void LoseNode(int node) { daemons_[std::size_t(1 + node)].reset(); }

  // Running processes on the nodes whose name (the kernel keeps 15 characters) begins like this.
  int CountPrograms(const std::string& name) const;

 private:
  SlurmCluster(std::string directory, Hosts hosts) : directory_(std::move(directory)), hosts_(std::move(hosts)) {}
  void WriteConfiguration(int nodes) const;
  void StartDaemon(int host, std::vector<std::string> command);
  std::vector<std::string> WithEnvironment(std::vector<std::string> command) const;

  std::string directory_;
  Hosts hosts_;
  std::vector<std::unique_ptr<RunningProgram>> daemons_;  // by host; null: lost. They end before the hosts
};

// Calls `condition` until it holds; false after kProgramTimeout.
bool Eventually(const std::function<bool()>& condition);

}  // namespace slabstream
