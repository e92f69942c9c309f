// ball_owner ENDPOINT OWNER in-place|asked: a process that owns a slab of BallsAt, and commits one time after the other until it is killed.
#include <algorithm>
#include <cstdlib>
#include <iostream>
#include <string>
#include <string_view>
#include <thread>

#include "client/owner/volume_owner.h"
#include "tests/service/owned_balls.h"

int main(int count, char** arguments) {
  using namespace slabstream;
  if (count != 4) return 2;
  Context context;
  VolumeOwnerOptions options{
      .endpoint = arguments[1], .dataset = "ball", .owner = std::uint32_t(std::atoi(arguments[2])), .owners = kBalls};
  options.description.geometry.size = kBallsSize;
  options.share_memory = arguments[3] == std::string_view("in-place");
  options.layout.samples = SampleType::kUint8;
  options.layout.boxes = {{.box = SlabOf(options.owner), .held = SlabOf(options.owner)}};
  options.layout.PlaceDense();
  const auto owner = VolumeOwner::Start(context, options);
  if (!owner.ok()) return std::cerr << owner.status().message() << '\n', 1;
  for (std::uint64_t time = 1;; ++time) {
    const auto slot = (*owner)->Begin(std::chrono::seconds(60));
    if (!slot.ok()) return std::cerr << slot.status().message() << '\n', 1;
    const Volume volume = BallsAt(time);
    const Box& slab = options.layout.boxes.front().box;
    std::copy_n(volume.block.bytes.begin() + volume.block.Offset(slab.begin), slot->bytes.size(), slot->bytes.begin());
    if (!(*owner)->Commit(time, double(time)).ok()) return 1;
    std::this_thread::sleep_for(std::chrono::milliseconds(20));  // what a step takes
  }
}
