// The in situ interface in C: arrays of any strides, with ghosts or without, are drawn as one array with their voxels; whatever is wrong
// is a code and one line.
#include "client/insitu/slabstream_insitu.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <atomic>
#include <cstring>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "client/client.h"
#include "coordinator/service/service.h"
#include "tests/service/pictures.h"
#include "tests/support/random_volume.h"
#include "tests/support/renderers.h"
#include "worker/service/service.h"

namespace slabstream {
namespace {

using testing::HasSubstr;
using Strides = std::array<std::int64_t, 3>;

constexpr Index3 kSize = {20, 24, 28};
constexpr double kPatience = 60;  // seconds

slabstream_insitu_field Field(const std::string& service) {
  return {.dataset = "ball", .samples = "uint8", .size = {kSize.x, kSize.y, kSize.z}, .service = service.c_str()};
}

// In memory of its own, which it fills with `volume` inside of it and with 255 elsewhere.
struct Array {
  Array(const Box& array, const Strides& strides, const Volume& volume) : box(array), steps(strides) {
    std::int64_t least = 0, most = 0;
    const Index3 last = box.size() - Uniform(1);
    for (const Axis axis : kAxes) {
      const std::int64_t reach = last[axis] * steps.at(std::size_t(Number(axis)));
      (reach < 0 ? least : most) += reach;
    }
    bytes.assign(std::size_t(most - least + 1), 255);
    first = std::size_t(-least);
    Write(volume, &bytes[first], steps);
  }
  void Write(const Volume& volume, std::uint8_t* to, const Strides& by) const {
    const Box inside = Intersection(box, volume.block.box);
    for (std::int32_t z = inside.begin.z; z < inside.end.z; ++z) {
      for (std::int32_t y = inside.begin.y; y < inside.end.y; ++y) {
        for (std::int32_t x = inside.begin.x; x < inside.end.x; ++x) {
          const Index3 at = Index3{x, y, z} - box.begin;
          to[at.x * by[0] + at.y * by[1] + at.z * by[2]] = volume.block.samples<std::uint8_t>()[volume.block.Offset({x, y, z})];
        }
      }
    }
  }
  const Box box;
  const Strides steps;
  std::vector<std::uint8_t> bytes;
  std::size_t first = 0;
};

// A coordinator and a worker.
struct Service {
  Service() {
    CoordinatorOptions options;
    options.client_endpoint = options.worker_endpoint = options.voxels_endpoint = "tcp://127.0.0.1:*";
    coordinator = CoordinatorService::Start(context, std::move(options)).value();
    WorkerOptions worker_options;
    worker_options.coordinator_endpoint = coordinator->worker_endpoint();
    worker_options.machine.threads = 1;
    worker = WorkerService::Start(context, worker_options).value();
    worker->WaitUntilRegistered();
  }
  Client Connect() { return Client::Connect(context, coordinator->client_endpoint(), std::chrono::seconds(60)).value(); }

  Context context;
  std::unique_ptr<CoordinatorService> coordinator;
  std::unique_ptr<WorkerService> worker;
};

TEST(Insitu, ArraysOfAnyStridesAreDrawn) {
  Service running;
  Client client = running.Connect();
  FrameRequest request = TestRequest(FindRenderer("raycast"), 30, 0);
  request.termination = 0;

  const Box left = {{0, 0, 0}, {9, 24, 28}}, right = {{9, 0, 0}, {20, 24, 28}};
  const Box with_ghosts = {{8, -1, 0}, {21, 25, 28}};
  struct Case {
    const char* name;
    Box array;                // of `right`
    std::int64_t strides[3];  // in the library's memory; 0: by default
    Strides published;        // in the simulation's
  };
  const std::array<Case, 4> cases = {{
      {"x fastest", right, {0, 0, 0}, {1, 11, 264}},
      {"z fastest, with gaps, and ghosts", with_ghosts, {900, 30, 1}, {1, 13, 400}},
      {"nowhere dense, backwards", with_ghosts, {2, 26, 700}, {-1, 13, -400}},
      {"a component of three", right, {1, 11, 264}, {3, 33, 800}},
  }};
  const std::string service = running.coordinator->worker_endpoint();
  std::uint64_t time = 0;
  for (const Case& each : cases) {
    SCOPED_TRACE(each.name);
    slabstream_insitu_field field = Field(service);
    field.slots = 2;
    slabstream_insitu* owner = nullptr;
    ASSERT_EQ(slabstream_insitu_open(&owner, &field), 0) << slabstream_insitu_error();
    const bool by_default = each.strides[0] == 0;
    ASSERT_EQ(slabstream_insitu_add_box(owner, &left.begin.x, &left.end.x, nullptr, nullptr, nullptr), 0) << slabstream_insitu_error();
    ASSERT_EQ(slabstream_insitu_add_box(owner, &right.begin.x, &right.end.x, &each.array.begin.x, &each.array.end.x,
                                        by_default ? nullptr : each.strides),
              0)
        << slabstream_insitu_error();
    ASSERT_EQ(slabstream_insitu_start(owner), 0) << slabstream_insitu_error();
    const Strides in_library = by_default ? Strides{1, 11, 264} : Strides{each.strides[0], each.strides[1], each.strides[2]};
    for (const std::string_view by : {"begin", "publish", "adopt"}) {
      SCOPED_TRACE(by);
      ++time;
      const auto volume = std::make_shared<const Volume>(MakeTestVolume(kSize, ScalarType::kUint8, [&](const Index3& v) {
        return std::max(0.0, 250 - 16 * Length(ToVec3(v) - Vec3{6.0 + double(time), 10, 14}));
      }));
      const Array first(left, {1, 9, 216}, *volume), second(each.array, by == "adopt" ? in_library : each.published, *volume);
      const std::array<const void*, 2> arrays = {&first.bytes[first.first], &second.bytes[second.first]};
      if (by == "adopt") {
        std::uint64_t freed = 0;
        ASSERT_EQ(slabstream_insitu_adopt(owner, time, 0, arrays.data(), kPatience, &freed), 0) << slabstream_insitu_error();
        EXPECT_EQ(freed, time - 2) << "of two slots";
      } else if (by == "publish") {
        const std::int64_t strides[2][3] = {{1, 9, 216}, {each.published[0], each.published[1], each.published[2]}};
        ASSERT_EQ(slabstream_insitu_publish(owner, time, 0, arrays.data(), strides, kPatience), 0) << slabstream_insitu_error();
      } else {
        std::array<void*, 2> pointers = {};
        double waited = -1;
        ASSERT_EQ(slabstream_insitu_begin(owner, kPatience, pointers.data(), &waited), 0) << slabstream_insitu_error();
        EXPECT_GE(waited, 0);
        EXPECT_EQ(reinterpret_cast<std::uintptr_t>(pointers[1]) % 64, 0U);
        first.Write(*volume, static_cast<std::uint8_t*>(pointers[0]), {1, 9, 216});
        second.Write(*volume, static_cast<std::uint8_t*>(pointers[1]), in_library);
        ASSERT_EQ(slabstream_insitu_commit(owner, time, 0), 0) << slabstream_insitu_error();
      }
      // The coordinator hears of the time later: until then it draws the one before, or has no dataset.
      float difference = 1;
      std::string why;
      for (const Time end = MonotonicNow() + std::chrono::seconds(60); difference > 1e-6F && MonotonicNow() < end;) {
        const Result<Picture> picture = client.Render(request, std::chrono::seconds(60));
        if (picture.ok()) difference = LargestDifference(picture->image, RenderDirectly(request, *volume), request.size);
        why = picture.status().message();
      }
      EXPECT_LE(difference, 1e-6F) << why;
    }
    slabstream_insitu_close(owner);
  }
}

// A simulation computes the next time from the last one, which lies there.
TEST(Insitu, TheMemoryOfTheLastTimeIsNotGivenAway) {
  Service running;
  const std::string service = running.coordinator->worker_endpoint();
  slabstream_insitu_field field = Field(service);
  field.slots = 2;
  slabstream_insitu* owner = nullptr;
  ASSERT_EQ(slabstream_insitu_open(&owner, &field), 0) << slabstream_insitu_error();
  const std::int32_t begin[3] = {0, 0, 0};
  ASSERT_EQ(slabstream_insitu_add_box(owner, begin, field.size, nullptr, nullptr, nullptr), 0) << slabstream_insitu_error();
  ASSERT_EQ(slabstream_insitu_start(owner), 0) << slabstream_insitu_error();
  std::atomic<int> pictures = 0;
  const std::jthread viewer([&](const std::stop_token& stop) {
    Client client = running.Connect();
    while (!stop.stop_requested()) pictures += client.Render(TestRequest(FindRenderer("raycast"), 30, 0), std::chrono::seconds(60)).ok();
  });
  const void* last = nullptr;
  const Time end = MonotonicNow() + std::chrono::seconds(60);
  for (std::uint64_t time = 1; pictures < 20 && MonotonicNow() < end; ++time) {
    void* pointer = nullptr;
    ASSERT_EQ(slabstream_insitu_begin(owner, kPatience, &pointer, nullptr), 0) << slabstream_insitu_error();
    ASSERT_NE(pointer, last) << "time " << time;
    std::memset(pointer, int(time % 250), CountIn(kSize));
    ASSERT_EQ(slabstream_insitu_commit(owner, time, 0), 0) << slabstream_insitu_error();
    last = pointer;
  }
  EXPECT_GE(pictures, 20);
  slabstream_insitu_close(owner);
}

// Two boxes, one of which is kept. What was dropped becomes something else at once.
TEST(Insitu, BoxesAreMadeOnDemandAndDropped) {
  struct Maker {
    const Volume volume = MakeTestVolume(kSize, ScalarType::kUint8, [](const Index3& v) {
      return std::max(0.0, 250 - 16 * Length(ToVec3(v) - Vec3{9, 10, 14}));
    });
    // The second one has ghosts, also outside of the volume.
    const std::array<Box, 2> boxes = {{{{0, 0, 0}, {9, 24, 28}}, {{9, 0, 0}, {20, 24, 28}}}};
    const std::array<Box, 2> arrays = {{boxes[0], {{8, -1, 0}, {21, 25, 28}}}};
    std::mutex mutex;
    std::map<const void*, std::unique_ptr<Array>> made;
    int makings = 0;
  } maker;
  slabstream_insitu_maker functions = {};
  functions.context = &maker;
  functions.most_bytes = 1;
  functions.make = [](void* context, std::uint32_t box, std::uint64_t time, const void** samples, char* error, std::uint32_t error_bytes) {
    Maker& self = *static_cast<Maker*>(context);
    const std::lock_guard lock(self.mutex);
    ++self.makings;
    if (time == 4) {
      std::string_view("the disk is full").copy(error, error_bytes);
      return int(SLABSTREAM_INSITU_UNAVAILABLE);
    }
    const Index3 size = self.arrays.at(box).size();
    auto array = std::make_unique<Array>(self.arrays.at(box), Strides{1, size.x, std::int64_t{size.x} * size.y}, self.volume);
    *samples = array->bytes.data();
    self.made[*samples] = std::move(array);
    return 0;
  };
  functions.drop = [](void* context, std::uint32_t, std::uint64_t time, const void* samples) {
    Maker& self = *static_cast<Maker*>(context);
    const std::lock_guard lock(self.mutex);
    EXPECT_EQ(time, 3U);
    ASSERT_TRUE(self.made.contains(samples));
    std::ranges::fill(self.made[samples]->bytes, 77);
    self.made.erase(samples);
  };

  Service running;
  Client client = running.Connect();
  const std::string service = running.coordinator->worker_endpoint();
  const slabstream_insitu_field field = Field(service);
  slabstream_insitu* owner = nullptr;
  ASSERT_EQ(slabstream_insitu_open(&owner, &field), 0) << slabstream_insitu_error();
  EXPECT_EQ(slabstream_insitu_on_demand(owner, nullptr), SLABSTREAM_INSITU_INVALID_ARGUMENT);
  EXPECT_THAT(slabstream_insitu_error(), HasSubstr("maker, make or drop is NULL"));
  for (const std::size_t i : {0, 1}) {
    const Box &box = maker.boxes.at(i), &array = maker.arrays.at(i);
    ASSERT_EQ(slabstream_insitu_add_box(owner, &box.begin.x, &box.end.x, &array.begin.x, &array.end.x, nullptr), 0);
  }
  ASSERT_EQ(slabstream_insitu_on_demand(owner, &functions), 0) << slabstream_insitu_error();
  ASSERT_EQ(slabstream_insitu_start(owner), 0) << slabstream_insitu_error();
  EXPECT_EQ(slabstream_insitu_on_demand(owner, &functions), SLABSTREAM_INSITU_INVALID_ARGUMENT) << "it is after start";
  const std::array<const void*, 2> nowhere = {};
  std::uint64_t freed = 0;
  ASSERT_EQ(slabstream_insitu_adopt(owner, 3, 0, nowhere.data(), kPatience, &freed), 0) << slabstream_insitu_error();
  EXPECT_EQ(maker.makings, 0) << "nobody looks";

  FrameRequest request = TestRequest(FindRenderer("raycast"), 30, 0);
  request.termination = 0;
  const auto render_until = [&](auto&& is_it) {
    Result<Picture> picture = Status::Internal("");
    for (const Time end = MonotonicNow() + std::chrono::seconds(60); MonotonicNow() < end;) {
      picture = client.Render(request, std::chrono::seconds(60));
      if (is_it(picture)) break;
    }
    return picture;
  };
  const Result<Picture> picture = render_until([](const Result<Picture>& each) { return each.ok(); });
  ASSERT_TRUE(picture.ok()) << picture.status().message();
  EXPECT_LE(LargestDifference(picture->image, RenderDirectly(request, maker.volume), request.size), 1e-6F);
  {
    const std::lock_guard lock(maker.mutex);
    EXPECT_EQ(maker.made.size(), 1U) << "one box is kept";
  }
  ASSERT_EQ(slabstream_insitu_adopt(owner, 4, 0, nowhere.data(), kPatience, &freed), 0) << slabstream_insitu_error();
  const Result<Picture> failed = render_until([](const Result<Picture>& each) { return !each.ok(); });
  EXPECT_THAT(failed.status().message(), HasSubstr("the disk is full"));
  slabstream_insitu_close(owner);
  EXPECT_TRUE(maker.made.empty()) << "all was dropped";
}

TEST(Insitu, WhateverIsWrongIsACodeAndALine) {
  slabstream_insitu* owner = nullptr;
  const auto error = [](int code, int expected) {
    EXPECT_EQ(code, expected);
    const std::string line = slabstream_insitu_error();
    EXPECT_EQ(line.find('\n'), std::string::npos);
    return line;
  };
  const std::string nobody = "tcp://127.0.0.1:1";
  slabstream_insitu_field field = Field(nobody);
  field.samples = "float";
  EXPECT_THAT(error(slabstream_insitu_open(&owner, &field), 1), HasSubstr("samples is 'float', must be one of: int8"));
  field.samples = "float64";
  field.size[1] = 0;
  EXPECT_THAT(error(slabstream_insitu_open(&owner, &field), 1), HasSubstr("size 20 x 0 x 28"));
  EXPECT_EQ(owner, nullptr);
  EXPECT_THAT(error(slabstream_insitu_start(owner), 1), HasSubstr("start: the handle is NULL"));
  EXPECT_THAT(error(slabstream_insitu_open(nullptr, nullptr), 1), HasSubstr("open: an argument is NULL"));
  field.size[1] = kSize.y;

  ASSERT_EQ(slabstream_insitu_open(&owner, &field), 0) << slabstream_insitu_error();
  EXPECT_THAT(error(slabstream_insitu_commit(owner, 1, 0), 1), HasSubstr("commit stands before start"));
  const auto box = [&](Index3 begin, Index3 end, Index3 array_begin, Index3 array_end, Strides strides) {
    return slabstream_insitu_add_box(owner, &begin.x, &end.x, &array_begin.x, &array_end.x, strides.data());
  };
  constexpr std::int32_t kMost = std::numeric_limits<std::int32_t>::max(), kLeast = std::numeric_limits<std::int32_t>::min();
  constexpr std::int64_t kFar = std::int64_t{1} << 40;
  EXPECT_THAT(error(box({0, 0, 0}, {20, 24, 29}, {0, 0, 0}, {20, 24, 29}, {1, 20, 480}), 1),
              HasSubstr("box 0: it is empty, or not inside"));
  EXPECT_THAT(error(box({0, 0, 0}, {20, 24, 0}, {0, 0, 0}, {20, 24, 28}, {1, 20, 480}), 1), HasSubstr("box 0: it is empty, or not inside"));
  EXPECT_THAT(error(box({0, 0, 0}, kSize, {1, 0, 0}, kSize, {1, 20, 480}), 1), HasSubstr("box 0: its array does not hold it"));
  EXPECT_THAT(error(box({0, 0, 0}, kSize, Uniform(kLeast), Uniform(kMost), {1, 20, 480}), 1), HasSubstr("or reaches too far"));
  EXPECT_THAT(error(box({0, 0, 0}, kSize, {0, 0, 0}, kSize, {0, 20, 480}), 1), HasSubstr("a stride of 0, must be in [1, 1099511627776]"));
  EXPECT_THAT(error(box({0, 0, 0}, kSize, {0, 0, 0}, kSize, {kFar, kFar, kFar}), 4), HasSubstr("limit 1099511627776"));
  EXPECT_EQ(slabstream_insitu_add_box(owner, &kSize.x, &kSize.x, nullptr, &kSize.x, nullptr), 1);
  ASSERT_EQ(box({0, 0, 0}, kSize, {0, 0, 0}, kSize, {1, 20, 480}), 0) << slabstream_insitu_error();
  EXPECT_EQ(slabstream_insitu_parameter(owner, "feed", 0, 1, 0.5), 0);
  ASSERT_EQ(slabstream_insitu_start(owner), 0) << slabstream_insitu_error();

  // Nobody is there, and it goes on.
  int looked_at = -1;
  double value = 0;
  EXPECT_EQ(slabstream_insitu_poll(owner, &looked_at, &value), 0);
  EXPECT_EQ(looked_at, 0);
  EXPECT_EQ(value, 0.5);
  void* pointer = nullptr;
  EXPECT_EQ(slabstream_insitu_begin(owner, 0, &pointer, nullptr), 0);
  EXPECT_EQ(slabstream_insitu_commit(owner, 5, 0.1), 0);
  EXPECT_THAT(error(slabstream_insitu_commit(owner, 6, 0.2), 1), HasSubstr("Commit without Begin"));
  EXPECT_THAT(error(slabstream_insitu_publish(owner, 6, 0, nullptr, nullptr, 0), 1), HasSubstr("publish: pointer 0 is NULL"));
  EXPECT_THAT(error(slabstream_insitu_adopt(owner, 6, 0, nullptr, 0, nullptr), 1), HasSubstr("adopt: pointer 0 is NULL"));
  EXPECT_THAT(error(slabstream_insitu_begin(owner, -1, &pointer, nullptr), 1), HasSubstr("timeout of -1 s, must be at least 0"));
  EXPECT_EQ(slabstream_insitu_begin(owner, 1e300, &pointer, nullptr), 0);
  EXPECT_THAT(error(slabstream_insitu_commit(owner, 5, 0), 1), HasSubstr("time 5 is not above 5"));
  EXPECT_THAT(error(slabstream_insitu_start(owner), 1), HasSubstr("start stands behind start"));
  slabstream_insitu_close(owner);
  slabstream_insitu_close(nullptr);

  for (const auto& [change, line] : std::initializer_list<std::pair<void (*)(slabstream_insitu_field&), const char*>>{
           {[](auto& f) { f.owner = 1; }, "owner 1 of 1"},
           {[](auto& f) { f.slots = 1; }, "1 slots of an owner, must be in [2, 8]"},
           {[](auto& f) { f.spacing[0] = -1; }, "spacing"},
           {[](auto& f) { f.service = "tcp://nowhere"; }, "tcp://nowhere"},
       }) {
    slabstream_insitu_field wrong = field;
    change(wrong);
    ASSERT_EQ(slabstream_insitu_open(&owner, &wrong), 0) << slabstream_insitu_error();
    EXPECT_THAT(error(slabstream_insitu_start(owner), 1), HasSubstr(line));
    slabstream_insitu_close(owner);
  }
}

}  // namespace
}  // namespace slabstream
