// Owners that are processes: whoever holds which voxels, and whether others can map them, the picture is that of the same array as one
// dataset, and of one time. An owner that has gone is named; pictures come again with the next one.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <memory>
#include <string>
#include <thread>
#include <tuple>
#include <vector>

#include "client/client.h"
#include "client/owner/volume_owner.h"
#include "common/planning/levels.h"
#include "common/service/service_file.h"
#include "common/wire/any_message.h"
#include "coordinator/service/service.h"
#include "data/owned/voxel_lattice.h"
#include "laboratory/experiments/owner_arrangements.h"
#include "tests/service/pictures.h"
#include "tests/support/random_volume.h"
#include "tests/support/renderers.h"
#include "tests/support/temporary_directory.h"
#include "worker/service/service.h"

namespace slabstream {
namespace {

using std::chrono::seconds;
using testing::AnyOf;
using testing::HasSubstr;

constexpr Index3 kSize = {44, 36, 52};
constexpr double kNear = 35;  // the whole volume must be in front of the eye
constexpr Duration kPatience = seconds(60);

// Another array at each time.
std::shared_ptr<const Volume> AtTime(std::uint64_t time, const Index3& size = kSize) {
  const auto value = [&](const Index3& v) {
    const auto distance = [&](const Vec3& center) { return Length(double(kSize.x) / size.x * ToVec3(v) - center); };
    return std::max({0.0, 250 - 12 * distance({12 + double(time % 20), 10, 14}), 250 - 10 * distance({30, 22, 36})});
  };
  return std::make_shared<const Volume>(MakeTestVolume(size, ScalarType::kUint8, value));
}

FrameRequest Request(double azimuth = 30) {
  FrameRequest request = TestRequest(FindRenderer("raycast"), azimuth, 0);
  request.termination = 0;
  return request;
}

class OwnerProcessesTest : public testing::Test {
 protected:
  void Start(const std::string& keys_folder = {}, int workers = 3) {
    CoordinatorOptions options;
    const bool keys = !keys_folder.empty();
    options.client_endpoint = keys ? "tcp://127.0.0.1:*" : "inproc://clients";
    options.worker_endpoint = keys ? "tcp://127.0.0.1:*" : "inproc://workers";
    options.voxels_endpoint = keys ? "tcp://127.0.0.1:*" : "inproc://voxels";
    options.keys_folder = keys_folder;
    coordinator_ = CoordinatorService::Start(context_, std::move(options)).value();
    if (keys) return;
    for (int i = 0; i < workers; ++i) {
      WorkerOptions worker;
      worker.coordinator_endpoint = coordinator_->worker_endpoint();
      worker.machine.threads = 1;
      workers_.push_back(WorkerService::Start(context_, worker).value());
    }
    for (const auto& worker : workers_) worker->WaitUntilRegistered();
    client_.emplace(Client::Connect(context_, coordinator_->client_endpoint(), kPatience).value());
  }
  ~OwnerProcessesTest() override {
    owners_.clear();
    workers_.clear();
  }

  VolumeOwnerOptions OptionsOf(const OwnedBoxes& boxes, std::uint32_t owner, std::uint32_t owners, bool share_memory) const {
    VolumeOwnerOptions options{.endpoint = coordinator_->worker_endpoint(), .dataset = "ball", .owner = owner, .owners = owners};
    options.description.geometry.size = size_;
    options.share_memory = share_memory;
    options.layout.samples = SampleType::kUint8;
    for (const OwnedBox& each : boxes) {
      if (each.owner == owner) options.layout.boxes.push_back({.box = each.box, .held = each.box});
    }
    options.layout.PlaceDense();
    return options;
  }
  void StartOwners(const OwnerArrangement& arrangement, std::uint32_t owners, bool share_memory) {
    owners_.clear();
    boxes_ = Arrange(arrangement, size_, owners);
    for (std::uint32_t owner = 0; owner < owners; ++owner) {
      owners_.push_back(VolumeOwner::Start(context_, OptionsOf(boxes_, owner, owners, share_memory)).value());
    }
  }
  // `arrays`: where samples lie, if not in slots. It is not used any more once the next time is begun.
  void Write(VolumeOwner& owner, const OwnedBoxes& boxes, std::uint32_t number, std::uint64_t time,
             std::vector<std::byte>* arrays = nullptr, std::uint64_t later = 0) const {
    const std::shared_ptr<const Volume> volume = AtTime(time + later, size_);
    const Result<VolumeOwner::Slot> slot = owner.Begin(kPatience);
    ASSERT_TRUE(slot.ok()) << slot.status().message();
    std::size_t to = 0;
    std::vector<const std::byte*> begins;
    if (arrays != nullptr) arrays->resize(slot->bytes.size());
    std::byte* const samples = arrays != nullptr ? arrays->data() : slot->bytes.data();
    for (const OwnedBox& each : boxes) {
      if (each.owner != number) continue;
      if (arrays != nullptr) begins.push_back(samples + to);
      for (std::int32_t z = each.box.begin.z; z < each.box.end.z; ++z) {
        for (std::int32_t y = each.box.begin.y; y < each.box.end.y; ++y) {
          const auto row = std::size_t(each.box.size().x);
          std::copy_n(volume->block.bytes.begin() + volume->block.Offset({each.box.begin.x, y, z}), row, samples + to);
          to += row;
        }
      }
    }
    EXPECT_TRUE(owner.Commit(time, double(time), begins).ok());
  }
  void WriteAll(std::uint64_t time, bool in_arrays = false) {
    arrays_.resize(owners_.size());
    for (std::uint32_t owner = 0; owner < owners_.size(); ++owner) {
      Write(*owners_[owner], boxes_, owner, time, in_arrays ? &arrays_[owner] : nullptr);
    }
  }
  // What a frame ends with, once it does not end with `status` any more: owners come when they come.
  Result<Picture> RenderUnless(const std::string& status, const FrameRequest& request = Request()) {
    for (const Time end = MonotonicNow() + kPatience;;) {
      Result<Picture> picture = client_->Render(request, kPatience);
      if (picture.ok() || picture.status().message().find(status) == std::string::npos || MonotonicNow() > end) return picture;
    }
  }
  static float Difference(const Picture& picture, std::uint64_t time, const FrameRequest& request = Request()) {
    return LargestDifference(picture.image, RenderDirectly(request, *AtTime(time)), request.size);
  }

  Context context_;
  std::unique_ptr<CoordinatorService> coordinator_;
  std::vector<std::unique_ptr<WorkerService>> workers_;
  std::vector<std::vector<std::byte>> arrays_;  // of owners
  std::vector<std::unique_ptr<VolumeOwner>> owners_;
  OwnedBoxes boxes_;
  Index3 size_ = kSize;
  std::optional<Client> client_;
};

TEST_F(OwnerProcessesTest, PicturesAreThoseOfOneArray) {
  constexpr std::array<std::pair<std::uint32_t, int>, 10> kNumbers = {
      {{4, 3}, {2, 5}, {7, 4}, {3, 1}, {5, 5}, {6, 2}, {2, 2}, {7, 3}, {3, 4}, {6, 5}}};  // owners and workers
  std::size_t number = 0;
  for (const OwnerArrangement& arrangement : OwnerArrangements()) {
    for (const auto& [share_memory, arrays] : {std::pair(true, false), {true, true}, {false, false}, {false, true}}) {
      const auto& [owners, workers] = kNumbers.at(number++ % kNumbers.size());
      SCOPED_TRACE(testing::Message() << arrangement.name << ", " << owners << " owners, " << workers << " workers"
                                      << (share_memory ? ", in place" : ", asked") << (arrays ? ", in arrays" : ""));
      owners_.clear();
      workers_.clear();
      client_.reset();
      coordinator_.reset();
      ASSERT_NO_FATAL_FAILURE(Start({}, workers));
      StartOwners(arrangement, owners, share_memory);
      WriteAll(7, arrays);
      ASSERT_TRUE(RenderUnless("\"ball\"").ok());
      std::uint64_t asked = 0;
      for (const FrameRequest& request : RequestsOfRenderers(kNear)) {
        SCOPED_TRACE(testing::Message() << request.renderer << ", projection " << int(request.view.projection) << ", distance "
                                        << request.view.distance);
        const Result<Picture> picture = client_->Render(request, kPatience);
        ASSERT_TRUE(picture.ok()) << picture.status().message();
        EXPECT_LE(Difference(*picture, 7, request), AllowedRounding(request));
        EXPECT_EQ(picture->statistics.assignment, "owner");
        for (const RankReport& report : picture->statistics.reports) asked += report.stored_bytes;
      }
      EXPECT_EQ(asked > 0, !share_memory) << asked << " bytes";
    }
  }
}

TEST_F(OwnerProcessesTest, SmallPicturesOfALargeVolumeReadEverySecondVoxel) {
  size_ = 6 * kSize;  // 17 MiB; rays are longer, so sums round more
  ASSERT_NO_FATAL_FAILURE(Start());
  const std::shared_ptr<const Volume> volume = AtTime(1, size_);
  const VoxelLattice lattice = VoxelLattice::Of(size_, 1);
  Volume second;
  second.description = volume->description;
  second.description.geometry = lattice.In(volume->description.geometry);
  second.block = MakeVoxelBlock(second.description.geometry.bounds(), ScalarType::kUint8);
  for (std::size_t i = 0; i < second.block.bytes.size(); ++i) {
    const Index3 voxel = lattice.first + PlaceIn(lattice.size, i) * Uniform(2);
    second.block.bytes[i] = volume->block.bytes[std::size_t(volume->block.Offset(voxel))];
  }
  for (const bool share_memory : {true, false}) {
    StartOwners(OwnerArrangements()[2], 3, share_memory);
    WriteAll(1);
    ASSERT_TRUE(RenderUnless("\"ball\"").ok());
    for (const FrameRequest& request : RequestsOfRenderers(6 * kNear)) {
      SCOPED_TRACE(testing::Message() << request.renderer << ", projection " << int(request.view.projection));
      const Result<Picture> picture = client_->Render(request, kPatience);
      ASSERT_TRUE(picture.ok()) << picture.status().message();
      ASSERT_EQ(picture->statistics.levels.size(), 1U);
      if (picture->statistics.levels[0].level == 0) {
        EXPECT_EQ(request.view.projection, Projection::kPerspective) << "from near";
        EXPECT_LE(LargestDifference(picture->image, RenderDirectly(request, *volume), request.size), 2 * AllowedRounding(request));
        continue;
      }
      const FrameRequest same = AtLevel(request, volume->description.geometry, second.description.geometry);
      EXPECT_LE(LargestDifference(picture->image, RenderDirectly(same, second), request.size), 2 * AllowedRounding(request));
    }
  }
}

TEST_F(OwnerProcessesTest, FieldsHaveOwnersOfTheirOwnAndOneTime) {
  const std::vector<FrameRequest> requests = [] {
    std::vector<FrameRequest> shown;
    for (const std::vector<std::string>& channels : {std::vector<std::string>{}, {"near"}, {"far"}, {"far", "near"}}) {
      for (FrameRequest request : RequestsOfRenderers(kNear)) {
        if (channels.size() != 1 && request.renderer != "raycast" && request.renderer != "mip") continue;
        request.channels = channels;
        if (channels.size() != 1) request.transfer = {};  // one function means one field
        shown.push_back(std::move(request));
      }
    }
    return shown;
  }();
  constexpr std::uint64_t kLater = 5;  // the second field has the values of later times
  std::vector<Result<Picture>> of_one;
  for (const auto& [owners, workers, share_memory] : {std::tuple(1U, 1, true), {3U, 2, true}, {2U, 3, false}}) {
    SCOPED_TRACE(testing::Message() << owners << " owners, " << workers << " workers");
    owners_.clear();
    workers_.clear();
    client_.reset();
    coordinator_.reset();
    ASSERT_NO_FATAL_FAILURE(Start({}, workers));
    const std::array<OwnedBoxes, 2> boxes = {Arrange(OwnerArrangements()[2], kSize, owners),
                                             Arrange(OwnerArrangements()[1], kSize, owners)};
    const auto start = [&](std::uint32_t field, std::uint32_t owner) {
      VolumeOwnerOptions options = OptionsOf(boxes.at(field), owner, owners, share_memory);
      options.fields = {"near", "far"};
      options.field = field;
      return VolumeOwner::Start(context_, options).value();
    };
    for (const std::uint32_t field : {0U, 1U}) {
      for (std::uint32_t owner = 0; owner < owners; ++owner) {
        EXPECT_TRUE(client_->QueryStatus().value().datasets.empty()) << "they have no time in common";
        owners_.push_back(start(field, owner));
        for (const std::uint64_t time : {3U, 12U}) Write(*owners_.back(), boxes.at(field), owner, time, nullptr, kLater * field);
      }
    }
    const Result<Picture> first = RenderUnless("no dataset", requests[0]);
    ASSERT_TRUE(first.ok()) << first.status().message();
    SampleQuery query{.dataset = "ball", .points = {{14, 12, 16}, {22, 12, 16}, {30, 24, 34}}, .channels = {"near", "far"}};
    const auto samples = client_->SampleAt(query).value();
    for (const VolumeSample& sample : samples) {
      ASSERT_EQ(sample.fields.size(), 2U);
      for (const std::size_t field : {0U, 1U}) {
        const auto volume = AtTime(12 + kLater * field);
        EXPECT_EQ(sample.fields[field].value, double(volume->block.samples<std::uint8_t>()[volume->block.Offset(sample.voxel)]));
      }
    }
    for (std::size_t i = 0; i < requests.size(); ++i) {
      SCOPED_TRACE(testing::Message() << requests[i].renderer << ", request " << i);
      const Result<Picture> picture = client_->Render(requests[i], kPatience);
      ASSERT_TRUE(picture.ok()) << picture.status().message();
      if (owners == 1) {
        of_one.push_back(picture);
      } else {
        EXPECT_LE(LargestDifference(picture->image, of_one[i]->image, requests[i].size), 2 * AllowedRounding(requests[i]));
      }
    }
    owners_.back().reset();
    Result<Picture> picture = Status::Internal("");
    for (const Time end = MonotonicNow() + kPatience; MonotonicNow() < end;) {
      picture = client_->Render(requests[0], kPatience);
      if (!picture.ok()) break;
    }
    EXPECT_THAT(picture.status().message(), AnyOf(HasSubstr("of field \"far\" has left"), HasSubstr("owner 0 has left")));
  }
}

TEST_F(OwnerProcessesTest, AnOwnerThatHasGoneIsNamedUntilItIsBack) {
  ASSERT_NO_FATAL_FAILURE(Start());
  StartOwners(OwnerArrangements().front(), 3, false);
  WriteAll(1);
  ASSERT_TRUE(RenderUnless("\"ball\"").ok());
  owners_[1].reset();
  Result<Picture> picture = Status::Internal("");
  for (const Time end = MonotonicNow() + kPatience; MonotonicNow() < end;) {
    picture = client_->Render(Request(), kPatience);
    if (!picture.ok()) break;
    EXPECT_LE(Difference(*picture, 1), 3e-7F);
  }
  EXPECT_THAT(picture.status().message(), AnyOf(HasSubstr("owner 1 of 3 has left"), HasSubstr("owner 1 has left")));
  EXPECT_EQ(picture.status().message().find('\n'), std::string::npos);
  owners_[1] = VolumeOwner::Start(context_, OptionsOf(boxes_, 1, 3, false)).value();
  Write(*owners_[1], boxes_, 1, 1);
  picture = RenderUnless("ball");
  ASSERT_TRUE(picture.ok()) << picture.status().message();
  EXPECT_LE(Difference(*picture, 1), 3e-7F);
  owners_.clear();
  for (const Time end = MonotonicNow() + kPatience; picture.ok() && MonotonicNow() < end;) picture = client_->Render(Request(), kPatience);
  EXPECT_FALSE(picture.ok());
}

TEST_F(OwnerProcessesTest, EachPictureIsOfOneWholeTime) {
  ASSERT_NO_FATAL_FAILURE(Start());
  const FrameRequest request = Request();
  std::vector<LocalImage> right;  // times repeat after 20
  for (std::uint64_t time = 0; time < 20; ++time) right.push_back(RenderDirectly(request, *AtTime(time)));
  for (const bool share_memory : {true, false}) {
    SCOPED_TRACE(share_memory);
    StartOwners(OwnerArrangements()[2], 3, share_memory);
    std::atomic<std::uint64_t> committed = 0, last = ~std::uint64_t{0};
    std::vector<std::jthread> simulation;
    for (std::uint32_t owner = 0; owner < 3; ++owner) {
      simulation.emplace_back([&, owner] {
        for (std::uint64_t time = 1; time <= last && !HasFailure(); ++time) {
          Write(*owners_[owner], boxes_, owner, time);
          if (owner == 0) committed = time;
        }
      });
    }
    for (int pictures = 0; pictures < 10; ++pictures) {
      const Result<Picture> picture = pictures == 0 ? RenderUnless("no dataset", request) : client_->Render(request, kPatience);
      ASSERT_TRUE(picture.ok()) << picture.status().message();
      float least = 1;
      for (const LocalImage& image : right) least = std::min(least, LargestDifference(picture->image, image, request.size));
      EXPECT_LE(least, 3e-7F);
    }
    EXPECT_TRUE(owners_[0]->looked_at());
    last = committed + 10;  // the same for all: while somebody looks, they wait for each other
    simulation.clear();
  }
}

TEST_F(OwnerProcessesTest, OwnersHearOfParametersThatClientsChange) {
  ASSERT_NO_FATAL_FAILURE(Start());
  boxes_ = Arrange(OwnerArrangements().front(), kSize, 2);
  for (std::uint32_t owner = 0; owner < 2; ++owner) {
    VolumeOwnerOptions options = OptionsOf(boxes_, owner, 2, true);
    if (owner == 0) options.parameters = {{"feed", 0, 0.1, 0.03}, {"kill", 0, 1, 0.5}};
    owners_.push_back(VolumeOwner::Start(context_, options).value());
  }
  EXPECT_EQ(owners_[0]->parameters(), (std::vector<double>{0.03, 0.5}));
  WriteAll(3);
  ASSERT_TRUE(RenderUnless("\"ball\"").ok());
  const Result<SimulationStatus> steered = client_->Steer({.dataset = "ball", .values = {{"kill", 0.75}}});
  ASSERT_TRUE(steered.ok()) << steered.status().message();
  EXPECT_EQ(*steered, (SimulationStatus{3, 3, {{"feed", 0, 0.1, 0.03}, {"kill", 0, 1, 0.75}}}));
  for (const Time end = MonotonicNow() + kPatience; owners_[0]->parameters()[1] != 0.75 && MonotonicNow() < end;) std::this_thread::yield();
  EXPECT_EQ(owners_[0]->parameters(), (std::vector<double>{0.03, 0.75}));
  EXPECT_TRUE(owners_[1]->parameters().empty());
  EXPECT_EQ(client_->QueryStatus().value().datasets.at(0).simulation, *steered);
  EXPECT_EQ(client_->Steer({.dataset = "ball", .values = {{"feed", 1}}}).status().message(), "\"ball\": feed is 1, must be in [0, 0.1]");
}

TEST_F(OwnerProcessesTest, OwnersNeedNotGoOnTogether) {
  ASSERT_NO_FATAL_FAILURE(Start());
  StartOwners(OwnerArrangements().front(), 3, false);
  for (std::uint64_t time = 1; time <= 9; ++time) Write(*owners_[0], boxes_, 0, time);
  for (const std::uint32_t owner : {1U, 2U}) Write(*owners_[owner], boxes_, owner, 1);
  std::jthread slower([&] {
    while (!owners_[0]->looked_at()) std::this_thread::yield();
    for (std::uint64_t time = 2; time <= 9; ++time) {
      for (const std::uint32_t owner : {1U, 2U}) Write(*owners_[owner], boxes_, owner, time);
    }
  });
  const Result<Picture> picture = RenderUnless("no dataset");
  ASSERT_TRUE(picture.ok()) << picture.status().message();
  EXPECT_LE(std::min(Difference(*picture, 8), Difference(*picture, 9)), 1e-6F);
}

TEST_F(OwnerProcessesTest, WrongRegistrationsAreRefusedInOneLine) {
  ASSERT_NO_FATAL_FAILURE(Start());
  const auto error = [&](auto change) {
    VolumeOwnerOptions options = OptionsOf({{Box{{0, 0, 0}, kSize}, 0}}, 0, 1, true);
    change(options);
    const auto owner = VolumeOwner::Start(context_, options);
    if (!owner.ok()) return owner.status().message();
    for (std::uint64_t time = 1;; ++time) {
      const auto slot = (*owner)->Begin(kPatience);
      if (!slot.ok()) return slot.status().message();
      EXPECT_TRUE((*owner)->Commit(time, 0).ok());
      std::this_thread::yield();
    }
  };
  EXPECT_THAT(error([](auto& o) { o.dataset = "a b"; }), HasSubstr("dataset name \"a b\""));
  EXPECT_THAT(error([](auto& o) { o.owner = 3; }), HasSubstr("owner 3 of 1"));
  EXPECT_THAT(error([](auto& o) { o.layout.slots = 1; }), HasSubstr("1 slots of an owner, must be in [2, 8]"));
  EXPECT_THAT(error([](auto& o) { o.layout.boxes[0].held.end.x = 99; }), HasSubstr("memory of an owner: box 0"));
  EXPECT_THAT(error([](auto& o) { o.parameters = {{"feed", 0, 1, 2}}; }), HasSubstr("RegisterOwner.steered[0].value: 2 is not in [0, 1]"));
}

TEST_F(OwnerProcessesTest, AnOwnersKeyIsForOwnersAlone) {
  const TemporaryDirectory directory("/tmp");
  ASSERT_NO_FATAL_FAILURE(Start(directory / "keys"));
  const auto file_of = [&](const char* role) { return directory / "keys/" + std::string(role) + ".json"; };
  VolumeOwnerOptions options = OptionsOf({{Box{{0, 0, 0}, kSize}, 0}}, 0, 1, true);
  options.service_file = file_of("worker");
  EXPECT_THAT(VolumeOwner::Start(context_, options).status().message(), HasSubstr("is of role worker, but owner is needed here"));
  options.service_file = file_of("owner");
  const auto owner = VolumeOwner::Start(context_, options).value();
  Write(*owner, {{Box{{0, 0, 0}, kSize}, 0}}, 0, 1);

  // Of two messages, the coordinator answers the one that the key may send.
  RegisterOwner as{.incarnation = 1, .dataset = "other", .samples = "uint8"};
  as.description.geometry.size = kSize;
  as.boxes = {{{0, 0, 0}, kSize}};
  const auto answered = [&](const char* role) {
    const ServiceFile file = ReadServiceFile(file_of(role)).value();
    SocketOptions keys;
    keys.client_keys = file.keys();
    Socket socket = Socket::Dealer(context_, keys).value();
    EXPECT_TRUE(socket.Connect(file.endpoint).ok());
    EXPECT_TRUE(socket.Send({}, Encode(role == std::string("owner") ? MessageView(Heartbeat()) : MessageView(as))).ok());
    EXPECT_TRUE(socket.Send({}, Encode(role == std::string("owner") ? MessageView(as) : MessageView(Heartbeat()))).ok());
    const std::array<Socket*, 1> sockets = {&socket};
    for (const Time end = MonotonicNow() + kPatience; MonotonicNow() < end; Wait(sockets, nullptr, end - MonotonicNow())) {
      if (const auto incoming = socket.TryReceive()) return std::string(NameOf(Decode<AnyMessage>(incoming->header()).value()));
    }
    return std::string("nothing");
  };
  EXPECT_EQ(answered("owner"), "OwnerWelcome");
  EXPECT_EQ(answered("worker"), "Retire");
}

}  // namespace
}  // namespace slabstream
