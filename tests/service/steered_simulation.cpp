// A simulation for tests of other programs: steered_simulation ENDPOINT DATASET. It holds a dataset of the service whose clients connect to
// ENDPOINT: a ball whose values are the parameter `level`, at one time after the other, until it is killed.
#include <algorithm>
#include <iostream>
#include <thread>

#include "client/owner/volume_owner.h"
#include "common/transport/endpoint.h"

namespace slabstream {
namespace {

constexpr int kSide = 24;

void Write(std::span<std::byte> bytes, double level) {
  std::size_t at = 0;
  for (int z = 0; z < kSide; ++z) {
    for (int y = 0; y < kSide; ++y) {
      for (int x = 0; x < kSide; ++x) {
        const Vec3 v = ToVec3({x, y, z}) - Vec3{kSide / 2.0, kSide / 2.0, kSide / 2.0};
        bytes[at++] = std::byte(Dot(v, v) < 81 ? int(level) : 0);
      }
    }
  }
}

Status Run(const std::string& endpoint, const std::string& dataset) {
  const Result<Endpoint> clients = ParseEndpoint(endpoint, false);
  if (!clients.ok()) return clients.status();
  VolumeOwnerOptions options{.endpoint = WorkerEndpointFor(*clients).ToString(), .dataset = dataset};
  options.description.geometry.size = Uniform(kSide);
  options.layout.boxes = {{.box = {{}, Uniform(kSide)}, .held = {{}, Uniform(kSide)}}};
  options.layout.PlaceDense();
  options.parameters = {{"level", 0, 250, 100}, {"unused", -1, 1, 0}};
  Context context;
  Result<std::unique_ptr<VolumeOwner>> owner = VolumeOwner::Start(context, std::move(options));
  if (!owner.ok()) return owner.status();
  for (std::uint64_t time = 1;; ++time) {
    const Result<VolumeOwner::Slot> slot = (*owner)->Begin(std::chrono::minutes(1));
    if (!slot.ok()) return slot.status();
    Write(slot->bytes, (*owner)->parameters()[0]);
    if (Status done = (*owner)->Commit(time, double(time) / 100); !done.ok()) return done;
    std::this_thread::sleep_for(std::chrono::milliseconds(20));  // a step
  }
}

}  // namespace
}  // namespace slabstream

int main(int argc, char** argv) {
  const slabstream::Status status =
      argc == 3 ? slabstream::Run(argv[1], argv[2]) : slabstream::Status::InvalidArgument("steered_simulation ENDPOINT DATASET");
  std::cerr << status.message() << "\n";
  return 1;
}
