// ClusterTest: a service on several hosts: the coordinator, two clients and eight workers, each in a network namespace of its own. The
// clients are the test's: so a test knows how far a frame is when it disturbs the network.
#pragma once

#include <gtest/gtest.h>

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "client/client.h"
#include "common/service/service_file.h"
#include "tests/end_to_end/program.h"
#include "tests/network/hosts.h"

namespace slabstream {

class ClusterTest : public EndToEndTest {
 protected:
  static constexpr int kCoordinator = 0, kClient = 1, kOtherClient = 2, kFirstWorker = 3, kWorkers = 8;

  // Skips the test, visibly, if there cannot be hosts. Other functions need it to have made some.
  void MakeHosts(Hosts::Family family = Hosts::Family::kIpv4);
  void StartCoordinator();
  // With the service file `file` of the folder of keys.
  void StartWorker(int host, const std::string& file = "worker.json");
  void StartWorkers();
  // Connects both clients, waits for all workers, and renders the picture that all others must be equal to.
  void BeginFrames();

  std::string KeyFile(const std::string& name) const { return Path("keys/" + name); }
  // A client on a host, as of its service file.
  std::unique_ptr<Client> Connect(int host);

  // The same picture, made in three ways that each take other voxels to the workers, in several groups.
  static std::vector<FrameRequest> Frames();
  // Both clients ask for Frames(). Once the first group of the first client's is done, `disturb` is called; then the first client asks for
  // Frames() again, so that some begin on the disturbed network. Every frame must end as the undisturbed picture, bit for bit. Returns the
  // most attempts that a frame took.
  std::uint32_t RenderThrough(const std::function<void()>& disturb);
  // There are `workers` workers, which are heard, and frames are as ever.
  void ExpectHealthy(int workers);
  void WaitForWorkers(int workers);
  // Until the coordinator has not heard some worker for a while. The coordinator's own host is asked, whatever happens to networks.
  void WaitUntilAWorkerIsSilent();

  std::optional<Hosts> hosts_;
  std::unique_ptr<RunningProgram> coordinator_;
  std::vector<std::unique_ptr<RunningProgram>> workers_;

 private:
  std::vector<Result<Picture>> Render(Client& client, const std::vector<FrameRequest>& requests,
                                      const std::function<void()>& in_the_middle);
  void ExpectUndisturbed(const std::vector<Result<Picture>>& pictures) const;

  std::vector<std::unique_ptr<Context>> contexts_;
  std::unique_ptr<Client> client_, other_client_;
  std::vector<float> undisturbed_;
};

// Red, green, blue, alpha and depth of the whole picture.
std::vector<float> SamplesOf(const Picture& picture);

}  // namespace slabstream
