#include "tests/slurm/cluster.h"

#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <set>
#include <thread>
#include <utility>

namespace slabstream {
namespace {

constexpr char kRoot[] = SLABSTREAM_SLURM_ROOT;  // where the packages are unpacked
constexpr char kPlugins[] = SLABSTREAM_SLURM_ROOT "/usr/lib/x86_64-linux-gnu/slurm-wlm";
constexpr int kLogin = 0;  // host; node i is host i + 1

// Its last line on stderr if it fails.
Status UnpackPackages() {
  const ProgramResult unpacked = RunningProgram({SLABSTREAM_SLURM_UNPACK, kRoot}, "/").Wait();
  if (unpacked.exit_status == 0) return Status::Ok();
  const std::vector<std::string> lines = unpacked.err_lines();
  return Status::Unavailable("Slurm's packages cannot be had: " + (lines.empty() ? std::string("no reason given") : lines.back()));
}

// The network namespace of a process by its folder in /proc; empty if it has ended.
std::string NetworkOf(const std::filesystem::path& process) {
  std::error_code error;
  return std::filesystem::read_symlink(process / "ns/net", error).string();
}

}  // namespace

bool Eventually(const std::function<bool()>& condition) {
  const auto deadline = std::chrono::steady_clock::now() + kProgramTimeout;
  while (!condition()) {
    if (std::chrono::steady_clock::now() > deadline) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(200));
  }
  return true;
}

Result<std::unique_ptr<SlurmCluster>> SlurmCluster::Start(const std::string& directory, int nodes) {
  Result<Hosts> hosts = Hosts::Make(1 + nodes);
  if (!hosts.ok()) return hosts.status();
  static const Status unpacked = UnpackPackages();  // once: without a network it takes seconds to fail
  if (!unpacked.ok()) return unpacked;
  std::unique_ptr<SlurmCluster> cluster(new SlurmCluster(directory, *std::move(hosts)));
  cluster->WriteConfiguration(nodes);
  const std::string programs = std::string(kRoot) + "/usr/sbin/", configuration = directory + "/slurm.conf";
  cluster->StartDaemon(kLogin, {programs + "slurmctld-wlm", "-D", "-c", "-f", configuration});
  for (int node = 0; node < nodes; ++node)
    cluster->StartDaemon(1 + node,
                         {programs + "slurmd-wlm", "-D", "-N", NameOf(node), "-f", configuration, "-d", programs + "slurmstepd-wlm"});
  const std::string all_idle = std::to_string(nodes) + " idle\n";
  ProgramResult last;
  if (Eventually([&] { return (last = cluster->Run({"sinfo", "-h", "-p", "low", "-o", "%D %t"})).out == all_idle; })) return cluster;
  return Status::DeadlineExceeded("Slurm does not start: sinfo says '" + last.out + last.err + "'");
}

void SlurmCluster::WriteConfiguration(int nodes) const {
  for (const char* const folder : {"state", "spool", "log"}) std::filesystem::create_directory(directory_ + "/" + folder);
  std::ofstream file(directory_ + "/slurm.conf");
  file << "ClusterName=test\nSlurmctldHost=localhost(" << hosts_.AddressOf(kLogin) << ")\n"
       << "SlurmUser=root\nSlurmdUser=root\nAuthType=auth/none\nCredType=cred/none\n"
       << "AuthInfo=cred_expire=5\n"  // and so a requeued job waits 6 s; 121 s without this line
       << "PluginDir=" << kPlugins << "\n"
       << "StateSaveLocation=" << directory_ << "/state\nSlurmdSpoolDir=" << directory_ << "/spool/%n\n"
       << "SlurmctldPidFile=" << directory_ << "/slurmctld.pid\nSlurmdPidFile=" << directory_ << "/slurmd.%n.pid\n"
       << "SlurmctldLogFile=" << directory_ << "/log/slurmctld.log\nSlurmdLogFile=" << directory_ << "/log/slurmd.%n.log\n"
       << "ProctrackType=proctrack/linuxproc\nTaskPlugin=task/none\nJobAcctGatherType=jobacct_gather/none\n"
       << "AccountingStorageType=accounting_storage/none\nMpiDefault=none\nSwitchType=switch/none\n"
       << "SelectType=select/cons_tres\nSelectTypeParameters=CR_Core\nReturnToService=2\n"
       << "SchedulerParameters=batch_sched_delay=0,sched_interval=2,sched_min_interval=1\n"
       << "PreemptType=preempt/partition_prio\nPreemptMode=REQUEUE\nKillWait=10\n";
  for (int node = 0; node < nodes; ++node)
    file << "NodeName=" << NameOf(node) << " NodeAddr=" << hosts_.AddressOf(1 + node) << " CPUs=2 RealMemory=1000 State=UNKNOWN\n";
  file << "PartitionName=low Nodes=ALL Default=YES PriorityTier=1 GraceTime=" << kGraceSeconds << "\n"
       << "PartitionName=high Nodes=ALL PriorityTier=2 PreemptMode=OFF\n";
}

std::vector<std::string> SlurmCluster::WithEnvironment(std::vector<std::string> command) const {
  const std::string libraries = std::string(kRoot) + "/usr/lib/x86_64-linux-gnu";
  const std::vector<std::string> environment = {"/usr/bin/env", "SLURM_CONF=" + directory_ + "/slurm.conf",
                                                "LD_LIBRARY_PATH=" + libraries + ":" + kPlugins,
                                                "PATH=" + std::string(kRoot) + "/usr/bin:" + std::string(std::getenv("PATH"))};
  command.insert(command.begin(), environment.begin(), environment.end());
  return command;
}

// A daemon is process 1 of a namespace, so that the kernel ends all others there with it. The daemon itself ends with `unshare`, and that
// one with this process.
void SlurmCluster::StartDaemon(int host, std::vector<std::string> command) {
  const std::vector<std::string> alone = {"/usr/bin/setpriv",
                                          "--pdeathsig",
                                          "KILL",
                                          "/usr/bin/unshare",
                                          "--pid",
                                          "--fork",
                                          "--kill-child=KILL",
                                          "--mount-proc",
                                          "/bin/sh",
                                          "-c",
                                          "exec \"$0\" \"$@\" > /dev/null 2>&1"};  // they have log files
  command.insert(command.begin(), alone.begin(), alone.end());
  daemons_.push_back(std::make_unique<RunningProgram>(WithEnvironment(hosts_.On(host, std::move(command))), directory_));
}

ProgramResult SlurmCluster::Run(const std::vector<std::string>& command) const {
  return RunningProgram(WithEnvironment(hosts_.On(kLogin, command)), directory_).Wait();
}

int SlurmCluster::CountPrograms(const std::string& name) const {
  std::set<std::string> nodes;  // network namespaces: those of the daemons
  for (const auto& daemon : daemons_)
    if (daemon != nullptr) nodes.insert(NetworkOf("/proc/" + std::to_string(daemon->pid())));
  int count = 0;
  for (const auto& process : std::filesystem::directory_iterator("/proc")) {
    std::ifstream file(process.path() / "comm");
    std::string own;
    std::getline(file, own);
    if (own.starts_with(name) && nodes.contains(NetworkOf(process.path()))) ++count;
  }
  return count;
}

std::string SlurmCluster::Output(const std::vector<std::string>& command) const {
  ProgramResult result = Run(command);
  EXPECT_EQ(result.exit_status, 0) << command.front() << ": " << result.err;
  if (result.out.ends_with('\n')) result.out.pop_back();
  return result.out;
}

}  // namespace slabstream
