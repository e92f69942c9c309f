// A coordinator that lacks memory says so itself: what it cannot send is no fault of the worker that asks, nor of the frame.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <atomic>
#include <cstdlib>
#include <memory>
#include <new>
#include <optional>

#include "coordinator/service/voxel_server.h"
#include "tests/support/random_volume.h"

namespace {
std::atomic<bool> no_large_blocks = false;
constexpr std::size_t kLarge = std::size_t{1} << 19;

void* Take(std::size_t bytes) {
  void* const block = no_large_blocks && bytes >= kLarge ? nullptr : std::malloc(bytes);
  if (block == nullptr) throw std::bad_alloc();
  return block;
}
}  // namespace

void* operator new(std::size_t bytes) { return Take(bytes); }
void* operator new[](std::size_t bytes) { return Take(bytes); }
void operator delete(void* block) noexcept { std::free(block); }
void operator delete[](void* block) noexcept { std::free(block); }
void operator delete(void* block, std::size_t) noexcept { std::free(block); }
void operator delete[](void* block, std::size_t) noexcept { std::free(block); }

namespace slabstream {
namespace {

TEST(ShortOfMemory, AChunkThatCannotBeCutIsTheCoordinatorsOwnTrouble) {
  Random random(1);
  const auto volume = std::make_shared<const Volume>(RandomVolume(random, {300, 70, 60}, ScalarType::kUint8));
  Context context;
  const std::unique_ptr<VoxelServer> server = VoxelServer::Start(context, {"inproc://short-of-memory"}, 77).value();
  server->Publish(5, {.volume = volume});
  Socket worker = Socket::Dealer(context).value();
  ASSERT_TRUE(worker.Connect(server->endpoint()).ok());
  const auto ask = [&] {  // for rows that lie apart, so that they must be copied
    const ChunkRequest request{.epoch = 77, .worker = 1, .dataset = 5, .box = {{0, 0, 0}, {299, 70, 60}}, .chunk = 0};
    CHECK(worker.Send({}, Encode(request)).ok());
    const std::array<Socket*, 1> sockets = {&worker};
    std::optional<Incoming> incoming;
    while (!(incoming = worker.TryReceive())) Wait(sockets, nullptr, std::chrono::seconds(10));
    return Decode(incoming->header()).value();
  };
  no_large_blocks = true;
  const AnyMessage answer = ask();
  no_large_blocks = false;
  const auto* refused = std::get_if<ChunkRefused>(&answer);
  ASSERT_NE(refused, nullptr) << NameOf(answer);
  // Not ResourceExhausted: the frame would go on without this worker, and then without the next one, and so on.
  EXPECT_EQ(refused->status, Status::Unavailable("the coordinator cannot send voxels: chunk request: not enough memory"));
  EXPECT_TRUE(std::holds_alternative<Chunk>(ask()));
}

}  // namespace
}  // namespace slabstream
