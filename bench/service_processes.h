// A coordinator and workers as processes, as `slabstream up` starts them, with a hollow sphere as the dataset "sphere", and perhaps another
// one as "other".
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "client/client.h"
#include "client/service/process.h"
#include "common/cli/command.h"

namespace slabstream {

// What the command lines of these programs say about the service.
struct ServiceSize {
  int volume = 64;               // voxels a side of the sphere
  int workers = 2, threads = 1;  // threads: of each worker
};
// --volume, --workers and --threads.
void AddServiceSize(const Command& app, ServiceSize& size);

struct ServiceProcessesOptions {
  std::string directory;                     // for the volume, the log and ipc files
  std::string listen = "tcp://127.0.0.1:*";  // where the coordinator listens
  ServiceSize size;
  int other_volume = 0;                        // voxels a side of a second sphere; 0: there is none
  bool keys = false;                           // connections are encrypted; keys are made in the directory
  std::vector<std::string> arguments_of_each;  // further ones, of the coordinator and of each worker
};

// Ends the processes when it ends. What goes wrong is fatal.
class ServiceProcesses {
 public:
  // Call before this process has threads.
  explicit ServiceProcesses(const ServiceProcessesOptions& options);
  ~ServiceProcesses();
  ServiceProcesses(const ServiceProcesses&) = delete;
  ServiceProcesses& operator=(const ServiceProcesses&) = delete;

  // Connects once all workers have registered.
  Client Connect(Context& context, bool direct_pictures = true) const;
  const std::string& endpoint() const { return endpoint_; }  // where clients connect
  std::vector<std::pair<std::string, pid_t>> pids() const;   // by name: "coordinator", "worker 1"

 private:
  Child coordinator_;
  std::string endpoint_;
  std::string keys_;  // folder; empty: there are none
  std::vector<Child> workers_;
};

}  // namespace slabstream
