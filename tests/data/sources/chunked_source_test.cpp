#include "data/sources/chunked_source.h"

#include <gmock/gmock.h>

#include <atomic>
#include <cstring>
#include <future>
#include <limits>
#include <thread>

#include "common/volume/memory_budget.h"
#include "tests/data/sources/memory_array.h"
#include "tests/data/sources/opened_source.h"
#include "tests/support/random.h"

namespace slabstream {
namespace {

using ::testing::HasSubstr;

SourceContext Context(const ReadContext::Limits& limits = {.decode_threads = 2}) { return std::make_shared<ReadContext>(limits); }

std::vector<std::byte> RandomElements(SampleType type, std::uint64_t count, Random& random) {
  std::vector<std::byte> bytes(count * BytesPerSample(type));
  VisitSampleType(type, [&](const auto* null) {
    using T = std::remove_cvref_t<decltype(*null)>;
    for (std::uint64_t i = 0; i < count; ++i) {
      const T value = T(random.Integer<std::int64_t>(std::is_signed_v<T> ? -128 : 0, sizeof(T) == 1 ? 127 : 1 << 15));
      std::memcpy(bytes.data() + i * sizeof(T), &value, sizeof(T));
    }
  });
  return bytes;
}

double ValueOf(SampleType type, const std::byte* element) {
  return VisitSampleType(type, [&](const auto* null) {
    std::remove_cvref_t<decltype(*null)> value;
    std::memcpy(&value, element, sizeof(value));
    return double(value);
  });
}

double ValueOf(const VolumeDescription& description, const std::vector<std::byte>& out, std::size_t number) {
  return VisitScalarType(description.type, [&](const auto* null) {
    std::remove_cvref_t<decltype(*null)> sample;
    std::memcpy(&sample, out.data() + number * sizeof(sample), sizeof(sample));
    return description.mapping.FromStored(sample);
  });
}

Box RandomBox(const Index3& size, Random& random) {
  Box box;
  for (int axis = 0; axis < 3; ++axis) {
    box.begin[axis] = random.Integer(0, size[axis] - 1);
    box.end[axis] = random.Integer(box.begin[axis] + 1, size[axis]);
  }
  return box;
}

struct RandomPyramid {
  explicit RandomPyramid(Random& random, SourceContext arrive_on = nullptr) {
    constexpr SampleType kTypes[] = {SampleType::kInt8,    SampleType::kUint8,   SampleType::kInt16,  SampleType::kUint16,
                                     SampleType::kInt32,   SampleType::kUint32,  SampleType::kInt64,  SampleType::kUint64,
                                     SampleType::kFloat32, SampleType::kFloat64, SampleType::kFloat16};
    ArrayShape shape;
    shape.type = kTypes[random.Integer(0, 9)];
    shape.cut_at_end = random.Chance(0.5);
    shape.fill = RandomElements(shape.type, 1, random);
    const int axes = random.Integer(1, 5);
    std::uint64_t count = 1;
    for (int a = 0; a < axes; ++a) {
      shape.size.push_back(random.Integer<std::uint64_t>(1, a < 3 ? 40 : 3));
      shape.chunk.push_back(random.Integer<std::uint64_t>(1, random.Chance(0.2) ? 60 : 16));
      count *= shape.size.back();
      at.push_back(random.Integer<std::uint64_t>(0, shape.size.back() - 1));
    }
    std::vector<int> order(std::size_t(axes), 0);
    for (int a = 0; a < axes; ++a) order[std::size_t(a)] = a;
    while (order.size() < 3) order.push_back(-1);
    for (std::size_t i = order.size(); i > 1; --i) std::swap(order[i - 1], order[random.Integer<std::size_t>(0, i - 1)]);
    level.axes = {order[0], order[1], order[2]};
    for (bool& mirrored : level.mirrored) mirrored = random.Chance(0.3);
    level.at = at;
    array = std::make_shared<MemoryArray>(shape, RandomElements(shape.type, count, random), arrive_on);
    for (std::uint64_t chunk = 0; chunk < array->chunk_count(); ++chunk) {
      if (random.Chance(0.1)) array->missing.insert(chunk);
    }
    level.array = array;
  }

  const std::byte* Element(const Index3& v) const {
    std::vector<std::uint64_t> element = at;
    for (int axis = 0; axis < 3; ++axis) {
      if (level.axes[std::size_t(axis)] < 0) continue;
      const auto a = std::size_t(level.axes[std::size_t(axis)]);
      const auto along = std::uint64_t(v[axis]);
      element[a] = level.mirrored[std::size_t(axis)] ? array->shape().size[a] - 1 - along : along;
    }
    return array->element(element);
  }
  double Expected(const Index3& v) const { return 2 * ValueOf(array->shape().type, Element(v)) + 3; }

  Pyramid pyramid() const { return {.levels = {level}, .rescale = {2, 3}}; }

  std::vector<std::uint64_t> at;
  std::shared_ptr<MemoryArray> array;
  PyramidLevel level;
};

// Reads the box and compares each voxel with the definition.
void ExpectBox(VolumeSource& source, const RandomPyramid& random, const Box& box) {
  const VolumeDescription& description = source.info().levels[0].description;
  std::vector<std::byte> out(std::size_t(box.voxel_count()) * BytesPerSample(description.type), std::byte{0xEE});
  const Status status = source.ReadNow(0, box, out);
  ASSERT_TRUE(status.ok()) << status.message();
  const std::size_t stored = BytesPerSample(source.info().exact.type);
  std::vector<std::byte> exact(std::size_t(box.voxel_count()) * stored, std::byte{0xEE});
  ASSERT_TRUE(source.ReadNow(0, box, BoxRoom::Dense(box, exact.data(), true)).ok());
  std::size_t number = 0;
  for (Index3 v = box.begin; v.z < box.end.z; ++v.z) {
    for (v.y = box.begin.y; v.y < box.end.y; ++v.y) {
      for (v.x = box.begin.x; v.x < box.end.x; ++v.x, ++number) {
        ASSERT_EQ(ValueOf(description, out, number), random.Expected(v)) << v.x << " " << v.y << " " << v.z;
        ASSERT_EQ(std::memcmp(exact.data() + number * stored, random.Element(v), stored), 0) << v.x << " " << v.y << " " << v.z;
      }
    }
  }
  const AlignedVector<std::byte> apart = ReadBoxApart(source, 0, box, 2);
  EXPECT_TRUE(std::ranges::equal(apart, out));
}

TEST(ChunkedSourceTest, EveryBoxHoldsTheElementsOfTheArray) {
  for (std::uint64_t seed = 0; seed < 150; ++seed) {
    Random random(seed);
    SCOPED_TRACE(random.trace());
    const SourceContext context =
        Context({.decode_threads = 2, .under_way_bytes = 1 << 12, .cache_bytes = random.Chance(0.5) ? 1U << 14 : 0U});
    const RandomPyramid arrays(random, random.Chance(0.5) ? context : nullptr);
    const auto source = MakeChunkedSource("array", arrays.pyramid(), context);
    ASSERT_TRUE(source.ok()) << source.status().message();
    const Index3& size = (*source)->info().levels[0].description.geometry.size;
    ExpectBox(**source, arrays, {{0, 0, 0}, size});
    for (int i = 0; i < 5; ++i) ExpectBox(**source, arrays, RandomBox(size, random));
    if (::testing::Test::HasFatalFailure()) return;
  }
}

// A cube of bytes, 8 x 8 x 8 in chunks of 4 x 4 x 4.
std::shared_ptr<MemoryArray> SmallCube(const SourceContext& context = nullptr) {
  Random random(1);
  const ArrayShape shape = {.size = {8, 8, 8}, .chunk = {4, 4, 4}, .type = SampleType::kUint8, .fill = {std::byte{9}}};
  return std::make_shared<MemoryArray>(shape, RandomElements(SampleType::kUint8, 512, random), context);
}

std::shared_ptr<VolumeSource> SourceOf(const std::shared_ptr<ChunkedArray>& array, const SourceContext& context,
                                       const std::string& name = "cube") {
  return *MakeChunkedSource(name, {.levels = {{.array = array, .at = {0, 0, 0}}}}, context);
}

constexpr Box kCube = {{0, 0, 0}, {8, 8, 8}};

TEST(ChunkedSourceTest, ZerosAreNotWrittenWhereAllIsZero) {
  for (const std::byte fill : {std::byte{0}, std::byte{9}}) {
    const ArrayShape shape = {.size = {8, 8, 8}, .chunk = {4, 4, 4}, .type = SampleType::kUint8, .fill = {fill}};
    const auto array = std::make_shared<MemoryArray>(shape, std::vector<std::byte>(512, std::byte{5}));
    array->missing = {0, 3};
    const auto source = SourceOf(array, Context());
    for (const bool zeroed : {false, true}) {
      std::vector<std::byte> out(512, std::byte{7});  // what is said to be zero is not looked at
      BoxRoom room = BoxRoom::Dense(kCube, out.data());
      room.zeroed = zeroed;
      std::promise<Status> end;
      source->Read(0, kCube, room, {}, [&end](Status status) { end.set_value(std::move(status)); });
      EXPECT_TRUE(end.get_future().get().ok());
      EXPECT_EQ(out[0], zeroed && fill == std::byte{0} ? std::byte{7} : fill);
      EXPECT_EQ(out[511], std::byte{5});
    }
  }
}

// The least int8 is kept as 0, but is not 0 itself.
TEST(ChunkedSourceTest, WhatIsKeptAsZeroIsWrittenIfItIsExactlyAnotherNumber) {
  const ArrayShape shape = {.size = {8, 8, 8}, .chunk = {4, 4, 4}, .type = SampleType::kInt8, .fill = {std::byte{0x80}}};
  const auto array = std::make_shared<MemoryArray>(shape, std::vector<std::byte>(512, std::byte{5}));
  array->missing = {0};
  std::vector<std::byte> out(512);
  BoxRoom room = BoxRoom::Dense(kCube, out.data(), true);
  room.zeroed = true;
  ASSERT_TRUE(SourceOf(array, Context())->ReadNow(0, kCube, room).ok());
  EXPECT_EQ(out[0], std::byte{0x80});
  EXPECT_EQ(out[511], std::byte{5});
}

struct RunningRead {
  RunningRead(VolumeSource& source, const Box& box, std::stop_token stop = {}) : out(std::size_t(box.voxel_count())) {
    source.Read(0, box, out, std::move(stop), [this](Status end) {
      ++ends;
      promise.set_value(std::move(end));
    });
  }
  bool ended() const { return ends > 0; }
  Status status() { return promise.get_future().get(); }

  std::vector<std::byte> out;
  std::atomic<int> ends = 0;
  std::promise<Status> promise;
};

TEST(ChunkedSourceTest, ChunksArriveInAnyOrder) {
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    Random random(seed);
    SCOPED_TRACE(random.trace());
    const SourceContext context = Context();
    const std::shared_ptr<MemoryArray> array = SmallCube();
    array->held = true;
    const auto source = SourceOf(array, context);
    RunningRead read(*source, kCube);
    while (array->held_chunks() > 0) {
      EXPECT_FALSE(read.ended());
      array->LetGo(random.Integer<std::size_t>(0, array->held_chunks() - 1));
    }
    EXPECT_EQ(read.ends, 1);
    EXPECT_TRUE(read.status().ok());
    for (std::size_t i = 0; i < read.out.size(); ++i) {
      EXPECT_EQ(read.out[i], *array->element(std::vector<std::uint64_t>{i / 64, i / 8 % 8, i % 8}));
    }
    EXPECT_EQ(source->counts().chunks, 8U);
    EXPECT_EQ(source->counts().stored_bytes, 56U);
  }
}

TEST(ChunkedSourceTest, StoredBytesAreTakenOnce) {
  const auto source = SourceOf(SmallCube(), Context({.decode_threads = 1, .cache_bytes = 0}));
  std::vector<std::byte> out(512);
  EXPECT_EQ(source->TakeStoredBytes(), 0U);
  ASSERT_TRUE(source->ReadNow(0, kCube, out).ok());
  EXPECT_EQ(source->TakeStoredBytes(), 56U);
  EXPECT_EQ(source->TakeStoredBytes(), 0U);
  ASSERT_TRUE(source->ReadNow(0, kCube, out).ok());
  EXPECT_EQ(source->TakeStoredBytes(), 56U);
  EXPECT_EQ(source->counts().stored_bytes, 112U);
}

TEST(ChunkedSourceTest, ChunksAreAskedForInTheOrderOfTheStore) {
  const std::shared_ptr<MemoryArray> array = SmallCube();
  const auto source = *MakeChunkedSource("cube", {.levels = {{.array = array, .axes = {0, 2, 1}, .at = {0, 0, 0}}}}, Context());
  std::vector<std::byte> out(512);
  EXPECT_TRUE(source->ReadNow(0, kCube, out).ok());
  EXPECT_EQ(array->asked(), (std::vector<std::uint64_t>{0, 1, 2, 3, 4, 5, 6, 7}));
}

TEST(ChunkedSourceTest, ReadsThatNeedTheSameChunkReadItOnce) {
  const std::shared_ptr<MemoryArray> array = SmallCube();
  array->held = true;
  const auto source = SourceOf(array, Context({.decode_threads = 2, .cache_bytes = 0}));
  RunningRead one(*source, kCube), other(*source, {{3, 3, 3}, {5, 5, 5}});
  EXPECT_EQ(array->asked().size(), 8U);
  while (array->LetGo(0)) {
  }
  EXPECT_TRUE(one.status().ok());
  EXPECT_TRUE(other.status().ok());
  EXPECT_EQ(source->counts().chunks, 8U);
  for (std::size_t i = 0; i < 8; ++i) {
    EXPECT_EQ(other.out[i], one.out[(3 + i / 4) * 64 + (3 + i / 2 % 2) * 8 + 3 + i % 2]);
  }
}

TEST(ChunkedSourceTest, KeepsChunksOfWhichNoReadTookAll) {
  const std::shared_ptr<MemoryArray> array = SmallCube();
  const SourceContext context = Context();
  auto source = SourceOf(array, context);
  std::vector<std::byte> whole(64), part(16);
  EXPECT_TRUE(source->ReadNow(0, {{0, 0, 0}, {4, 4, 4}}, whole).ok());
  EXPECT_EQ(context->cache().bytes(), 0U);
  EXPECT_TRUE(source->ReadNow(0, {{4, 0, 0}, {8, 4, 1}}, part).ok());
  EXPECT_EQ(context->cache().bytes(), 64U);
  EXPECT_TRUE(source->ReadNow(0, {{4, 0, 1}, {8, 4, 2}}, part).ok());
  EXPECT_EQ(array->asked().size(), 2U);
  EXPECT_EQ(part[5], *array->element(std::vector<std::uint64_t>{1, 1, 5}));
  source.reset();
  // The last read's task may still own the source for a moment.
  while (context->cache().bytes() > 0) std::this_thread::yield();
}

TEST(ChunkedSourceTest, KeepsAllChunksOfASmallLevelBehindAnAddress) {
  for (const std::string name : {"cube", "http://host/cube"}) {
    for (const std::uint64_t small : {std::uint64_t{511}, std::uint64_t{512}}) {
      const std::shared_ptr<MemoryArray> array = SmallCube();
      const auto source = SourceOf(array, Context({.decode_threads = 1, .small_bytes = small}), name);
      std::vector<std::byte> out(512);
      for (int i = 0; i < 2; ++i) EXPECT_TRUE(source->ReadNow(0, kCube, out).ok());
      EXPECT_EQ(array->asked().size(), name == "cube" || small < 512 ? 16U : 8U);
    }
  }
}

TEST(ChunkedSourceTest, ChunksUnderWayStayWithinTheLimit) {
  for (const std::uint64_t most : {1U, 2U, 3U, 8U}) {
    const SourceContext context = Context({.decode_threads = 4, .under_way_bytes = most * 128, .cache_bytes = 0});
    const std::shared_ptr<MemoryArray> array = SmallCube();
    array->held = true;
    const auto source = SourceOf(array, context);
    RunningRead one(*source, kCube), other(*source, kCube);
    EXPECT_EQ(array->held_chunks(), most);
    while (array->LetGo(array->held_chunks() - 1)) {
    }
    EXPECT_EQ(array->most_under_way(), most);
    EXPECT_TRUE(one.status().ok());
    EXPECT_TRUE(other.status().ok());
  }
}

// Each chunk ends while the next one begins, on one thread; its stack would not hold so many calls inside each other.
TEST(ChunkedSourceTest, ManyChunksWithRoomForOneDoNotNest) {
  const ArrayShape shape = {.size = {400, 400}, .chunk = {1, 1}, .type = SampleType::kUint8, .fill = {std::byte{0}}};
  const auto array = std::make_shared<MemoryArray>(shape, std::vector<std::byte>(400 * 400));
  const SourceContext context = Context({.decode_threads = 1, .under_way_bytes = 1});
  const auto source = *MakeChunkedSource("square", {.levels = {{.array = array, .axes = {1, 0, -1}, .at = {0, 0}}}}, context);
  context->Admit(1, [] {});  // the chunks wait
  std::vector<std::byte> out(400 * 400);
  std::promise<Status> end;
  source->Read(0, {{0, 0, 0}, {400, 400, 1}}, out, {}, [&](Status status) { end.set_value(std::move(status)); });
  EXPECT_TRUE(array->asked().empty());
  context->Release(1);
  EXPECT_TRUE(end.get_future().get().ok());
  EXPECT_EQ(array->most_under_way(), 1U);
}

// Metadata of a few bytes may say that a chunk has a gigabyte.
TEST(ChunkedSourceTest, ALargeChunkIsAskedForIfThereIsMemoryForIt) {
  constexpr std::uint64_t kLarge = std::uint64_t{1} << 28;
  const ArrayShape shape = {.size = {64, 2048, 2048}, .chunk = {64, 2048, 2048}, .type = SampleType::kUint8, .fill = {std::byte{7}}};
  const auto array = std::make_shared<MemoryArray>(shape, std::vector<std::byte>());
  array->missing = {0};
  const auto source = *MakeChunkedSource("block", {.levels = {{.array = array, .at = {0, 0, 0}}}}, Context());
  std::vector<std::byte> out(8);
  const Box box = {{0, 0, 0}, {8, 1, 1}};
  LimitMemory(kLarge);
  const Status refused = source->ReadNow(0, box, out);
  LimitMemory(std::numeric_limits<std::int64_t>::max());
  EXPECT_EQ(refused.code(), StatusCode::kResourceExhausted);
  EXPECT_THAT(refused.message(), testing::HasSubstr("block: a chunk needs 512 MiB of memory"));
  EXPECT_TRUE(array->asked().empty());
  EXPECT_TRUE(source->ReadNow(0, box, out).ok());
  EXPECT_EQ(out[0], std::byte{7});
}

TEST(ChunkedSourceTest, TheFirstFailureIsTheEnd) {
  const std::shared_ptr<MemoryArray> array = SmallCube();
  array->held = true;
  array->damaged = {2, 5};
  const auto source = SourceOf(array, Context());
  RunningRead read(*source, kCube);
  for (const std::size_t which : {0, 4, 0, 0, 0, 0, 0, 0}) EXPECT_TRUE(array->LetGo(which));
  EXPECT_EQ(read.ends, 1);
  EXPECT_EQ(read.status(), Status::DataLoss("chunk 5 is damaged"));
  array->held = false;
  std::vector<std::byte> out(64);
  EXPECT_TRUE(source->ReadNow(0, {{0, 0, 0}, {4, 4, 4}}, out).ok());
}

TEST(ChunkedSourceTest, RefusesChunksOfAnotherLength) {
  const std::shared_ptr<MemoryArray> array = SmallCube();
  array->short_ones = {0};
  std::vector<std::byte> out(512);
  EXPECT_EQ(SourceOf(array, Context())->ReadNow(0, kCube, out), Status::DataLoss("cube: a chunk has 63 bytes, expected 64"));
}

TEST(ChunkedSourceTest, StoppedReadsLeaveOutWhatHasNotBegun) {
  const SourceContext context = Context({.decode_threads = 2, .under_way_bytes = 2 * 128});
  const std::shared_ptr<MemoryArray> array = SmallCube();
  array->held = true;
  const auto source = SourceOf(array, context);
  std::stop_source stop;
  RunningRead stopped(*source, kCube, stop.get_token());
  RunningRead other(*source, {{0, 0, 0}, {4, 4, 8}});  // shares chunks 0 and 4
  stop.request_stop();
  while (array->LetGo(0)) {
  }
  EXPECT_EQ(stopped.status().code(), StatusCode::kCancelled);
  EXPECT_TRUE(other.status().ok());
  EXPECT_EQ(array->asked(), (std::vector<std::uint64_t>{0, 1, 4}));
  EXPECT_EQ(other.out[101], *array->element(std::vector<std::uint64_t>{6, 1, 1}));
  RunningRead late(*source, kCube, stop.get_token());
  EXPECT_EQ(late.status().code(), StatusCode::kCancelled);
  EXPECT_EQ(array->asked().size(), 3U);
}

TEST(ChunkedSourceTest, AReadOutlivesItsSource) {
  const std::shared_ptr<MemoryArray> array = SmallCube();
  array->held = true;
  auto source = SourceOf(array, Context({.decode_threads = 1, .under_way_bytes = 1}));
  RunningRead read(*source, kCube);
  source.reset();
  while (array->LetGo(0)) {
  }
  EXPECT_TRUE(read.status().ok());
}

TEST(ChunkedSourceTest, ManyThreadsReadAtATime) {
  for (std::uint64_t seed = 0; seed < 5; ++seed) {
    Random random(seed);
    SCOPED_TRACE(random.trace());
    const SourceContext context = Context({.decode_threads = 3, .under_way_bytes = 1 << 11, .cache_bytes = 1 << 12});
    const RandomPyramid arrays(random, context);
    const auto source = MakeChunkedSource("array", arrays.pyramid(), context);
    const Index3& size = (*source)->info().levels[0].description.geometry.size;
    std::vector<std::thread> threads;
    for (std::uint64_t t = 0; t < 4; ++t) {
      threads.emplace_back([&, t] {
        Random boxes(seed * 10 + t);
        for (int i = 0; i < 20; ++i) ExpectBox(**source, arrays, RandomBox(size, boxes));
      });
    }
    for (std::thread& thread : threads) thread.join();
  }
}

TEST(ChunkedSourceTest, DescribesItsLevels) {
  Random random(3);
  const ArrayShape fine = {
      .size = {2, 30, 40, 50}, .chunk = {1, 8, 64, 16}, .type = SampleType::kInt16, .fill = {std::byte{0}, std::byte{0}}};
  ArrayShape coarse = fine;
  coarse.size = {2, 30, 20, 25};
  Pyramid pyramid = {.levels = {{.array = std::make_shared<MemoryArray>(fine, std::vector<std::byte>()),
                                 .axes = {3, 2, 1},
                                 .at = {1, 0, 0, 0},
                                 .spacing = {0.5, 0.5, 1},
                                 .origin = {1, 2, 3}},
                                {.array = std::make_shared<MemoryArray>(coarse, std::vector<std::byte>()),
                                 .axes = {3, 2, 1},
                                 .at = {1, 0, 0, 0},
                                 .spacing = {1, 1, 1},
                                 .origin = {1.25, 2.25, 3}}},
                     .orientation = {.world = World::kPatient},
                     .rescale = {2, 5}};
  const auto source = MakeChunkedSource("scan", pyramid, Context());
  ASSERT_TRUE(source.ok()) << source.status().message();
  const SourceInfo& info = (*source)->info();
  ASSERT_EQ(info.levels.size(), 2U);
  EXPECT_EQ(info.file_type, "int16");
  EXPECT_EQ(info.levels[0].description.type, ScalarType::kUint16);
  EXPECT_EQ(info.levels[0].description.mapping, (ValueMapping{2, 5 - 65536}));
  EXPECT_EQ(info.levels[0].description.geometry.size, (Index3{50, 40, 30}));
  EXPECT_EQ(info.levels[0].block, (Index3{16, 40, 8}));
  EXPECT_EQ(info.levels[1].description.geometry.size, (Index3{25, 20, 30}));
  EXPECT_EQ(info.levels[1].description.geometry.orientation.origin, (Vec3{1.25, 2.25, 3}));
  EXPECT_EQ(info.levels[1].description.geometry.orientation.world, World::kPatient);
}

TEST(ChunkedSourceTest, RefusesPyramidsThatAreNoVolume) {
  const SourceContext context = Context();
  const auto refusal = [&](Pyramid pyramid) { return MakeChunkedSource("it", std::move(pyramid), context).status(); };
  const auto array = [](ArrayShape shape) {
    shape.fill.resize(BytesPerSample(shape.type));
    return std::make_shared<MemoryArray>(std::move(shape), std::vector<std::byte>());
  };
  const auto good = array({.size = {4, 4, 4}, .chunk = {4, 4, 4}});
  EXPECT_EQ(refusal({}), Status::InvalidArgument("it: has no level"));
  EXPECT_EQ(refusal({.levels = {{.array = array({.size = {4, 65536, 4}, .chunk = {4, 4, 4}}), .at = {0, 0, 0}}}}),
            Status::InvalidArgument("it: 65536 voxels along y, expected from 1 to 65535"));
  EXPECT_EQ(refusal({.levels = {{.array = good, .at = {0, 0, 0}, .spacing = {1, 0, 1}}}}),
            Status::InvalidArgument("it: a spacing of 0, expected a finite number above 0"));
  EXPECT_EQ(refusal({.levels = {{.array = good, .at = {0, 0, 0}},
                                {.array = array({.size = {4, 4, 4}, .chunk = {4, 4, 4}, .type = SampleType::kInt8}), .at = {0, 0, 0}}}}),
            Status::InvalidArgument("it: level 1: samples of type int8, but uint8 at level 0"));
  EXPECT_EQ(refusal({.levels = {{.array = array({.size = {512, 512, 512}, .chunk = {1, 1, 1}}), .at = {0, 0, 0}}}}),
            Status::InvalidArgument("it: 134217728 chunks of 1 byte: of chunks of less than 64 bytes at most 1048576 are read"));
  EXPECT_TRUE(refusal({.levels = {{.array = array({.size = {100, 100, 100}, .chunk = {1, 1, 1}}), .at = {0, 0, 0}}}}).ok());
  const std::uint64_t huge = std::uint64_t{1} << 40;
  EXPECT_THAT(refusal({.levels = {{.array = array({.size = {4, 4, 4}, .chunk = {huge, huge, huge}}), .at = {0, 0, 0}}}}).message(),
              HasSubstr("more than 1024 MiB"));
}

}  // namespace
}  // namespace slabstream
