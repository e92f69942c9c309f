// ball_owner ENDPOINT OWNER HOW [STUCK]: a process that owns a slab of BallsAt until it is killed. HOW: in-place or asked: it commits one
// time after the other. on-demand: it commits time 1, and makes the halves of its slab when they are asked for, one of which it keeps; the
// making number STUCK, from 1, prints a line and does not end.
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <iostream>
#include <memory>
#include <string_view>
#include <thread>

#include "client/owner/volume_owner.h"
#include "tests/service/owned_balls.h"

namespace slabstream {
namespace {

void CopyBalls(std::uint64_t time, const Box& part, std::byte* to) {  // whole slices
  const Volume volume = BallsAt(time);
  std::copy_n(volume.block.bytes.begin() + volume.block.Offset(part.begin), CountIn(part.size()), to);
}

Status Run(VolumeOwnerOptions options, bool on_demand, int stuck) {
  Box slab = SlabOf(options.owner);
  if (on_demand) {
    Box far = slab;
    slab.end.z = far.begin.z = (slab.begin.z + slab.end.z) / 2;
    options.layout.boxes = {{.box = slab, .held = slab}, {.box = far, .held = far}};
    options.made_bytes = 1;
    options.make = [boxes = options.layout.boxes, stuck, makings = 0](std::size_t box, std::uint64_t time) mutable {
      for (++makings; makings == stuck; ::pause()) std::cout << "making" << std::endl;
      const std::shared_ptr<std::byte[]> samples(new std::byte[CountIn(boxes[box].box.size())]);
      CopyBalls(time, boxes[box].box, samples.get());
      return Result<MadeBox>(MadeBox(samples, samples.get()));
    };
  } else {
    options.layout.boxes = {{.box = slab, .held = slab}};
  }
  options.layout.PlaceDense();
  Context context;
  const auto owner = VolumeOwner::Start(context, std::move(options));
  if (!owner.ok()) return owner.status();
  for (std::uint64_t time = 1;; ++time) {
    const auto slot = (*owner)->Begin(std::chrono::seconds(60));
    if (!slot.ok()) return slot.status();
    if (!on_demand) CopyBalls(time, slab, slot->bytes.data());
    if (Status done = (*owner)->Commit(time, double(time)); !done.ok()) return done;
    while (on_demand) ::pause();
    std::this_thread::sleep_for(std::chrono::milliseconds(20));  // what a step takes
  }
}

}  // namespace
}  // namespace slabstream

int main(int count, char** arguments) {
  using namespace slabstream;
  if (count != 4 && count != 5) return 2;
  const std::string_view how = arguments[3];
  VolumeOwnerOptions options{
      .endpoint = arguments[1], .dataset = "ball", .owner = std::uint32_t(std::atoi(arguments[2])), .owners = kBalls};
  options.description.geometry.size = kBallsSize;
  options.share_memory = how != "asked";
  options.layout.samples = SampleType::kUint8;
  std::cerr << Run(std::move(options), how == "on-demand", count == 5 ? std::atoi(arguments[4]) : 0).message() << '\n';
  return 1;
}
