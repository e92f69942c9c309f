// Volumes of owners: whoever reads them gets the voxels of one array, bit for bit, from memory of this host or by asking. A layout that
// does not fit is refused. Memory of an owner that has gone gives an error and nothing else. (tests/fuzz/decode_owners.cpp: headers that
// are anything.)
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <linux/audit.h>
#include <linux/filter.h>
#include <linux/seccomp.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <csignal>
#include <cstddef>
#include <cstdlib>
#include <cstring>
#include <map>
#include <memory>
#include <mutex>
#include <numeric>
#include <optional>
#include <thread>
#include <utility>

#include "common/volume/box_assembly.h"
#include "common/volume/indices.h"
#include "common/volume/stored_at.h"
#include "data/owned/owned_source.h"
#include "data/owned/process_memory.h"
#include "data/owned/voxel_lattice.h"
#include "data/sources/copy_samples.h"
#include "tests/support/random_box.h"

namespace slabstream {
namespace {

using testing::HasSubstr;

SourceContext Here() { return std::make_shared<ReadContext>(ReadContext::Limits{}); }

void Shuffle(Random& random, auto& values) {
  for (std::size_t i = values.size(); i > 1; --i) std::swap(values[i - 1], values[random.Integer<std::size_t>(0, i - 1)]);
}

// Boxes that tile `box`, by random cuts.
void Cut(Random& random, const Box& box, int count, std::vector<Box>& boxes) {
  const Axis axis = Axis(random.Integer(0, 2));
  if (count < 2 || box.size()[axis] < 2) return boxes.push_back(box);
  Box lower = box, upper = box;
  lower.end[axis] = upper.begin[axis] = random.Integer(box.begin[axis] + 1, box.end[axis] - 1);
  Cut(random, lower, count / 2, boxes);
  Cut(random, upper, count - count / 2, boxes);
}

// A float32 volume of random owners, each with boxes, ghosts, gaps and an order of axes of its own. `arrays`: every second box is no part
// of a slot.
class OwnedVolumeOf {
 public:
  OwnedVolumeOf(Random& random, int owners, bool arrays = false, std::int32_t least_side = 4)
      : arrays_(arrays),
        size_{least_side + random.Integer(0, 36), least_side + random.Integer(0, 36), least_side + random.Integer(0, 36)},
        array_(CountIn(size_)) {
    std::iota(array_.begin(), array_.end(), 1.0F);
    std::vector<Box> boxes;
    Cut(random, Bounds(), 2 * owners, boxes);
    Shuffle(random, boxes);
    for (int owner = 0; owner < owners; ++owner) {
      OwnerLayout layout{.samples = SampleType::kFloat32, .size = size_};
      for (std::size_t i = std::size_t(owner); i < boxes.size(); i += std::size_t(owners)) {
        HeldBox& each = layout.boxes.emplace_back(HeldBox{.box = boxes[i], .held = Grown(boxes[i], random.Integer(0, 2), Bounds())});
        std::array<int, 3> order = {0, 1, 2};
        Shuffle(random, order);
        std::int64_t step = random.Integer(1, 2);
        for (const int axis : order) {
          each.strides.at(std::size_t(axis)) = step;
          step *= each.held.size()[axis] + random.Integer(0, 2);
        }
        each.offset = layout.slot_bytes;
        layout.slot_bytes += std::uint64_t(step) * sizeof(float);
      }
      volume.boxes.emplace_back();
      for (const HeldBox& each : layout.boxes) volume.boxes.back().push_back(each.box);
      const std::uint64_t incarnation = random.Integer<std::uint64_t>(1, 1ULL << 60);
      memory.push_back(OwnerMemory::Create(incarnation, layout).value());
      layouts_.push_back(layout);
      volume.field.owners.push_back({SharedMemoryScope(), std::uint32_t(::getpid()), memory.back()->file_descriptor(), incarnation});
    }
    volume.field.dataset = "rho";
    volume.description = {{.size = size_}, ScalarType::kFloat32, {}};
    volume.exact = {SampleType::kFloat32, {}};
    volume.ask = [this](std::uint32_t, const AskedVoxels& voxels, const std::function<void(Result<Bytes>)>& done) {
      ++asked;
      const std::vector<float> samples = Of(voxels.box, volume.field.time, 1 << voxels.level);
      const auto bytes = std::as_bytes(std::span(samples));
      done(Bytes(std::vector<std::byte>(bytes.begin(), bytes.end())));
    };
  }

  // Of the array at a time, whose samples are those of time 0 plus a million each.
  std::vector<float> Of(const Box& box, std::uint64_t time, int step = 1) const {
    std::vector<float> samples;
    for (std::int32_t z = box.begin.z; z < box.end.z; z += step) {
      for (std::int32_t y = box.begin.y; y < box.end.y; y += step) {
        for (std::int32_t x = box.begin.x; x < box.end.x; x += step) samples.push_back(At({x, y, z}, time));
      }
    }
    return samples;
  }
  float At(const Index3& voxel, std::uint64_t time) const { return array_[NumberIn(size_, voxel)] + 1e6F * float(time); }

  void Write(std::size_t owner, std::uint32_t slot, std::uint64_t time) {
    const std::span<std::byte> bytes = memory[owner]->Begin(slot);
    std::vector<std::vector<float>>& elsewhere = elsewhere_[{owner, slot}];
    elsewhere.clear();
    std::vector<const std::byte*> arrays;
    for (const HeldBox& each : layouts_[owner].boxes) {
      auto* samples = reinterpret_cast<float*>(bytes.data() + each.offset);
      if (arrays_) {
        const bool in_slot = arrays.size() % 2 != 0;
        if (!in_slot) samples = elsewhere.emplace_back((bytes.size() - each.offset) / sizeof(float)).data();
        arrays.push_back(in_slot ? nullptr : reinterpret_cast<const std::byte*>(samples));
      }
      const Box& held = each.held;
      for (std::int32_t z = held.begin.z; z < held.end.z; ++z) {
        for (std::int32_t y = held.begin.y; y < held.end.y; ++y) {
          for (std::int32_t x = held.begin.x; x < held.end.x; ++x) {
            const Index3 at = Index3{x, y, z} - held.begin;
            samples[at.x * each.strides[0] + at.y * each.strides[1] + at.z * each.strides[2]] = At({x, y, z}, time);
          }
        }
      }
    }
    memory[owner]->Commit(slot, time, 0.5 * double(time), arrays);
  }
  void WriteAll(std::uint64_t time) {
    for (std::size_t owner = 0; owner < memory.size(); ++owner) Write(owner, std::uint32_t(time % 2), time);
    volume.field.time = time;
  }
  Box Bounds() const { return {{0, 0, 0}, size_}; }
  // Before a slot, counted from the header.
  std::size_t BytesToSlot(std::size_t owner, std::size_t slot) const {
    return 4096 + slot * ((layouts_[owner].slot_bytes + 4095) / 4096 * 4096);
  }

  OwnedVolume volume;
  std::vector<std::shared_ptr<OwnerMemory>> memory;
  std::atomic<int> asked = 0;

 private:
  const bool arrays_;
  Index3 size_;
  std::vector<float> array_;
  std::vector<OwnerLayout> layouts_;
  std::map<std::pair<std::size_t, std::uint32_t>, std::vector<std::vector<float>>> elsewhere_;  // of an owner's slot
};

std::vector<float> ReadBox(VolumeSource& source, const Box& box, int level = 0) {
  std::vector<float> samples(std::size_t(box.voxel_count()));
  const Status read = source.ReadNow(level, box, std::as_writable_bytes(std::span(samples)));
  EXPECT_TRUE(read.ok()) << read.message();
  return samples;
}

TEST(OwnedSource, BoxesAreThoseOfOneArrayHereAndAsked) {
  Random random(11);
  SCOPED_TRACE(random.trace());
  for (const int owners : {1, 3, 8, -1, -3, -8}) {
    OwnedVolumeOf of(random, std::abs(owners), owners < 0);
    of.WriteAll(1);
    of.WriteAll(2);
    const auto here = MakeOwnedSource(of.volume, Here());
    OwnedVolume far = of.volume;
    for (std::size_t i = 0; i < far.field.owners.size(); i += 2) far.field.owners[i].scope = 1;
    const auto mixed = MakeOwnedSource(far, Here());
    const auto opened = OpenOwned(far.field.Text(), Here());
    for (int i = 0; i < 30; ++i) {
      const Box box = RandomBox(random, of.Bounds());
      const std::vector<float> expected = of.Of(box, 2);
      EXPECT_EQ(ReadBox(*here, box), expected);
      EXPECT_EQ(of.asked, 0);
      EXPECT_EQ(mixed->Reaches(0, box), VoxelReach::kNow);
      EXPECT_EQ(ReadBox(*mixed, box), expected);
      if (opened.ok() && (*opened)->Reaches(0, box) == VoxelReach::kNow) {
        EXPECT_EQ(ReadBox(**opened, box), expected);
      }
      of.asked = 0;
    }
    EXPECT_EQ(opened.ok(), std::abs(owners) > 1) << "every second owner is on this host";
    if (opened.ok()) {
      EXPECT_EQ((*opened)->Reaches(0, of.Bounds()), VoxelReach::kNever);
    }
    EXPECT_EQ(OpenOwned(of.volume.field.Text(), Here()).value()->info().version, here->info().version);
  }
}

TEST(VoxelLattice, PointsOfBoxesThatTileAVolumeTileThePoints) {
  Random random(17);
  SCOPED_TRACE(random.trace());
  for (int i = 0; i < 300; ++i) {
    const Index3 size = {random.Integer(1, 70), random.Integer(1, 70), random.Integer(1, 70)};
    std::vector<Box> boxes;
    Cut(random, {{0, 0, 0}, size}, random.Integer(1, 20), boxes);
    for (int level = 0; level < 8; ++level) {
      const VoxelLattice lattice = VoxelLattice::Of(size, level);
      const Box all = {{0, 0, 0}, lattice.size};
      const Box voxels = lattice.VoxelsOf(all);
      EXPECT_TRUE(Box({0, 0, 0}, size).Contains(voxels));
      for (const Axis axis : kAxes) {
        EXPECT_LE(std::abs(voxels.begin[axis] - (size[axis] - voxels.end[axis])), 1) << "they are in the middle";
        EXPECT_LT(size[axis] - voxels.size()[axis], 1 << level) << "there is no room for another one";
      }
      std::int64_t points = 0;
      for (const Box& box : boxes) {
        const Box in = lattice.PointsIn(box);
        points += in.voxel_count();
        EXPECT_TRUE(all.Contains(in));
        EXPECT_TRUE(in.empty() || box.Contains(lattice.VoxelsOf(in)));
        if (!in.empty()) {
          EXPECT_EQ(PointsAlong(lattice.VoxelsOf(in).size(), level), in.size());
        }
      }
      EXPECT_EQ(points, all.voxel_count());
    }
  }
}

TEST(OwnedSource, CoarserLevelsAreEverySecondVoxelHereAndAsked) {
  Random random(19);
  SCOPED_TRACE(random.trace());
  for (const bool arrays : {false, true}) {
    OwnedVolumeOf of(random, 3, arrays, 180);  // 23 MiB and more
    of.WriteAll(1);
    const auto here = MakeOwnedSource(of.volume, Here());
    OwnedVolume far = of.volume;
    far.field.owners[1].scope = 1;
    far.of_nobody.push_back(far.boxes[2].back());
    far.boxes[2].pop_back();
    const auto mixed = MakeOwnedSource(far, Here());
    const auto& levels = here->info().levels;
    ASSERT_EQ(levels.size(), 2U);
    EXPECT_EQ(OpenOwned(of.volume.field.Text(), Here()).value()->info().levels[1].description.geometry.size,
              levels[1].description.geometry.size);
    const VoxelLattice lattice = VoxelLattice::Of(of.Bounds().end, 1);
    const VolumeGeometry& geometry = levels[1].description.geometry;
    const Index3 point = {3, 20, 8};
    EXPECT_EQ(geometry.ToWorld(ToVec3(point)), levels[0].description.geometry.ToWorld(ToVec3(lattice.first + point * Uniform(2))));
    std::int64_t owned = 0;
    for (const OwnedBox& each : *mixed->info().levels[1].owned) owned += each.box.voxel_count();
    EXPECT_EQ(owned, geometry.bounds().voxel_count());
    for (int i = 0; i < 20; ++i) {
      const Box box = RandomBox(random, geometry.bounds());
      const std::vector<float> expected = of.Of(lattice.VoxelsOf(box), 1, 2);
      EXPECT_EQ(ReadBox(*here, box, 1), expected);
      EXPECT_EQ(of.asked, 0);
      ASSERT_EQ(mixed->Reaches(1, box), VoxelReach::kNow);
      const std::vector<float> read = ReadBox(*mixed, box, 1);
      const Box lost = lattice.PointsIn(far.of_nobody.back());
      for (std::size_t at = 0; at < read.size(); ++at) {
        const Index3 place = box.begin + PlaceIn(box.size(), at);
        const bool is_lost = lost.Contains({place, place + Uniform(1)});
        ASSERT_TRUE(read[at] == expected[at] || (is_lost && read[at] == 0)) << read[at] << " instead of " << expected[at];
      }
      of.asked = 0;
    }
  }
}

TEST(OwnedSource, ATimeThatWasOverwrittenIsUnavailable) {
  Random random(1);
  SCOPED_TRACE(random.trace());
  OwnedVolumeOf of(random, 3);
  of.WriteAll(1);
  const auto first = MakeOwnedSource(of.volume, Here());
  of.WriteAll(2);
  EXPECT_EQ(ReadBox(*first, of.Bounds()), of.Of(of.Bounds(), 1));
  (void)of.memory[1]->Begin(1);  // it begins to write time 3
  std::vector<float> samples(std::size_t(of.Bounds().voxel_count()));
  const Status gone = first->ReadNow(0, of.Bounds(), std::as_writable_bytes(std::span(samples)));
  EXPECT_EQ(gone.code(), StatusCode::kUnavailable);
  EXPECT_THAT(gone.message(), HasSubstr("\"rho\": time 1 is not held any more"));
  const auto second = MakeOwnedSource(of.volume, Here());
  EXPECT_EQ(ReadBox(*second, of.Bounds()), of.Of(of.Bounds(), 2));
  EXPECT_NE(first->info().version, second->info().version);
}

TEST(OwnedSource, OwnersWhoseArraysCannotBeReadAreAsked) {
  Random random(3);
  SCOPED_TRACE(random.trace());
  OwnedVolumeOf of(random, 2, true);
  of.WriteAll(2);
  const auto zero = [](std::byte* header) { std::memset(header + 56, 0, 8); };  // its address: nothing lies there
  zero(of.memory[0]->Begin(1).data() - of.BytesToSlot(0, 1));
  const auto source = MakeOwnedSource(of.volume, Here());
  EXPECT_EQ(ReadBox(*source, of.Bounds()), of.Of(of.Bounds(), 2));
  EXPECT_GT(of.asked, 0);
}

TEST(OwnedField, ATextIsReadAsItWasWritten) {
  OwnedField field{"rho", ~std::uint64_t{0}, {}, Uniform(kMaxVolumeSide)};
  for (std::uint32_t i = 0; i < 4096; ++i)
    field.owners.push_back({i < 64 ? 0 : ~std::uint64_t{i / 64}, 0xFFFFFFFF - i, i, ~std::uint64_t{i}});
  const std::string text = field.Text();
  EXPECT_LE(text.size(), kMaxSourceBytes) << "of 4096 owners";
  EXPECT_EQ(OwnedField::Parse(text).value(), field);
  for (std::size_t length = 0; length < 60; ++length) (void)OwnedField::Parse(text.substr(0, length));
  for (const char* wrong : {"", "owned:", "owned:a/b:1:1.1.1:", "owned:rho:1", "owned:rho:x:1.1.1:", "owned:rho:1:", "owned:rho:1:0.1.1:",
                            "owned:rho:1:1.1.10000:", "owned:rho:1:1.1.1:1.2.3", "owned:rho:1:1.1.1:@1,", "owned:rho:1:1.1.1:-1.2.3,"}) {
    EXPECT_FALSE(OwnedField::Parse(wrong).ok()) << wrong;
  }
}

// An owner of one box of 16^3 float32 samples that lie in `array`, and the way to it.
struct OwnerOfArray {
  static constexpr Box kBox = {{0, 0, 0}, {16, 16, 16}};
  static constexpr std::uint64_t kIncarnation = 77;
  static constexpr std::size_t kBytes = 16 * 16 * 16 * sizeof(float);
  static OwnerLayout Layout() {
    OwnerLayout layout{.samples = SampleType::kFloat32, .size = kBox.end, .boxes = {{.box = kBox, .held = kBox}}};
    layout.PlaceDense();
    return layout;
  }

  explicit OwnerOfArray(const std::byte* array) {
    (void)memory->Begin(0);
    memory->Commit(0, 1, 0, std::array{array});
  }
  OwnerPlace place() const { return {SharedMemoryScope(), std::uint32_t(::getpid()), memory->file_descriptor(), kIncarnation}; }
  std::shared_ptr<OwnerMemory> memory = OwnerMemory::Create(kIncarnation, Layout()).value();
};

Status ReadWhole(const MappedOwner& owner, std::vector<float>& samples) {
  samples.assign(OwnerOfArray::kBytes / sizeof(float), 0);
  return owner.Read(0, OwnerOfArray::kBox, 0, 1, BoxRoom::Dense(OwnerOfArray::kBox, reinterpret_cast<std::byte*>(samples.data())));
}

// As CopySamples in this process, whatever lies between samples: parts near each other are copied with what is between them, and a large
// box half by half.
TEST(ProcessMemory, CopiesAreThoseOfCopySamples) {
  Random random(5);
  SCOPED_TRACE(random.trace());
  for (int i = 0; i < 100; ++i) {
    const Index3 count = {random.Integer(1, 30), random.Integer(1, 30), random.Integer(1, 30)};
    const auto type = SampleType(random.Integer(0, 10));
    std::array<int, 3> order = {0, 1, 2};
    Shuffle(random, order);
    std::array<std::int64_t, 3> steps = {};
    std::int64_t step = random.Integer(1, 3);
    for (const int axis : order) {
      steps.at(std::size_t(axis)) = step;
      step = step * count[axis] + (random.Integer(0, 1) == 0 ? random.Integer(0, 2) : random.Integer(0, 3000));
    }
    std::vector<std::byte> array(std::size_t(step) * BytesPerSample(type));
    for (std::size_t at = 0; at < array.size(); ++at) array[at] = std::byte(at * 37 >> 3);
    const bool exact = random.Integer(0, 1) == 0;
    const std::size_t room = std::size_t(count.x + 3) * std::size_t(count.y) * std::size_t(count.z);
    std::vector<std::byte> expected(room * 8), copied(room * 8);
    const auto to = [&](std::vector<std::byte>& bytes) {
      return BoxRoom{bytes.data(), count.x + 3, (count.x + 3) * count.y, false, exact};
    };
    CopySamples(type, array.data(), steps, count, to(expected));
    const auto first = reinterpret_cast<std::uint64_t>(array.data());
    ASSERT_TRUE(CopyProcessSamples(std::uint32_t(::getpid()), type, first, steps, count, to(copied)).ok());
    ASSERT_EQ(copied, expected) << i;
  }
}

TEST(OwnerMemory, ArraysThatAreGoneGiveAnError) {
  void* const array = ::mmap(nullptr, OwnerOfArray::kBytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  ASSERT_NE(array, MAP_FAILED);
  OwnerOfArray owner(static_cast<const std::byte*>(array));
  const auto mapped = MappedOwner::Open(owner.place()).value();
  std::vector<float> samples;
  EXPECT_TRUE(ReadWhole(*mapped, samples).ok());
  ::munmap(array, OwnerOfArray::kBytes);
  EXPECT_THAT(ReadWhole(*mapped, samples).message(), HasSubstr("cannot be read: Bad address"));
  (void)owner.memory->Begin(0);
  EXPECT_THAT(ReadWhole(*mapped, samples).message(), HasSubstr("time 1 is not held any more"));
}

TEST(OwnerMemory, ArraysOfAnOwnerThatHasLeftAreNotRead) {
  const std::vector<std::byte> array(OwnerOfArray::kBytes);
  std::optional<OwnerOfArray> owner(array.data());
  const auto mapped = MappedOwner::Open(owner->place()).value();
  std::vector<float> samples;
  EXPECT_TRUE(ReadWhole(*mapped, samples).ok());
  owner.reset();
  EXPECT_THAT(ReadWhole(*mapped, samples).message(), HasSubstr("time 1 is not held any more"));
}

TEST(OwnerMemory, ASlotTakesNoMemoryForSamplesThatLieElsewhere) {
  const std::vector<std::byte> array(OwnerOfArray::kBytes);
  const OwnerOfArray owner(array.data());
  struct stat found {};
  ASSERT_EQ(::fstat(int(owner.memory->file_descriptor()), &found), 0);
  EXPECT_GE(found.st_size, off_t(2 * OwnerOfArray::kBytes));
  EXPECT_LE(found.st_blocks * 512, 4096) << "the header";
}

// An owner on demand of boxes whose samples are their numbers in the volume. What it drops becomes something else at once.
class MakingOwner {
 public:
  static constexpr Index3 kSize = {12, 10, 8}, kBoxSize = {4, 5, 4};

  MakingOwner() : boxes_(CutAtBlocks({{}, kSize}, kBoxSize)), made_(boxes_.size()) {
    OwnerLayout layout{.samples = SampleType::kFloat32, .size = kSize};
    for (const Box& box : boxes_) layout.boxes.push_back({.box = box, .held = box});
    layout.PlaceDense();
    for (HeldBox& each : layout.boxes) each.offset = 0;
    layout.slot_bytes = 0;
    layout.on_demand = true;
    // One of its own: a thread that has read the last owner's boxes may hold that one's memory for a moment longer.
    static std::atomic<std::uint64_t> last = 99;
    const std::uint64_t incarnation = ++last;
    memory_ = OwnerMemory::Create(incarnation, layout).value();
    (void)memory_->Begin(0);
    memory_->Commit(0, 1, 0);
    volume.field = {"rho", 1, {{SharedMemoryScope(), std::uint32_t(::getpid()), memory_->file_descriptor(), incarnation}}, kBoxSize};
    volume.description = {{.size = kSize}, ScalarType::kFloat32, {}};
    volume.exact = {SampleType::kFloat32, {}};
    volume.boxes = {boxes_};
    volume.on_demand = true;
    volume.ask = [this](std::uint32_t, const AskedVoxels& voxels, const std::function<void(Result<Bytes>)>& done) {
      if (voxels.in_place) {
        Make(std::size_t(std::ranges::find(boxes_, voxels.box) - boxes_.begin()));
        return done(Bytes());
      }
      const std::vector<float> samples = Of(voxels.box);
      const auto bytes = std::as_bytes(std::span(samples));
      done(Bytes(std::vector<std::byte>(bytes.begin(), bytes.end())));
    };
  }

  static std::vector<float> Of(const Box& box) {
    std::vector<float> samples;
    for (const Index3& voxel : IndicesIn(box)) samples.push_back(float(NumberIn(kSize, voxel)));
    return samples;
  }
  std::size_t count() const { return boxes_.size(); }
  void Make(std::size_t box) {
    const std::lock_guard lock(mutex_);
    if (made_[box] != nullptr) return;
    ++times_made;
    made_[box] = std::make_unique<std::vector<float>>(Of(boxes_[box]));
    memory_->Make(0, box, reinterpret_cast<const std::byte*>(made_[box]->data()));
  }
  void Drop(std::size_t box) {
    const std::lock_guard lock(mutex_);
    if (made_[box] == nullptr) return;
    memory_->Make(0, box, nullptr);
    std::ranges::fill(*made_[box], -1.0F);
    made_[box].reset();
  }

  OwnedVolume volume;
  std::atomic<int> times_made = 0;

 private:
  const std::vector<Box> boxes_;
  std::shared_ptr<OwnerMemory> memory_;
  std::mutex mutex_;
  std::vector<std::unique_ptr<std::vector<float>>> made_;
};

TEST(OwnedSource, BoxesOnDemandAreMadeOnceAndReadInPlace) {
  MakingOwner owner;
  const auto source = MakeOwnedSource(owner.volume, Here());
  const auto worker = OpenOwned(owner.volume.field.Text(), Here()).value();
  EXPECT_TRUE(source->info().on_demand);
  EXPECT_TRUE(worker->info().on_demand);
  EXPECT_EQ(worker->info().levels[0].block, MakingOwner::kBoxSize);
  const Box two = {{2, 1, 1}, {6, 4, 3}};
  EXPECT_EQ(worker->Reaches(0, two), VoxelReach::kOnceMade);
  std::vector<float> samples(std::size_t(two.voxel_count()));
  EXPECT_THAT(worker->ReadNow(0, two, std::as_writable_bytes(std::span(samples))).message(), HasSubstr("is not made, or was dropped"));
  EXPECT_EQ(ReadBox(*source, two), MakingOwner::Of(two)) << "samples are asked for";
  Status made = Status::Internal("it did not end");
  source->Make(two, [&](const Status& status) { made = status; });
  EXPECT_TRUE(made.ok()) << made.message();
  EXPECT_EQ(owner.times_made, 2);
  EXPECT_EQ(worker->Reaches(0, two), VoxelReach::kNow);
  EXPECT_EQ(ReadBox(*worker, two), MakingOwner::Of(two));
  source->Make(two, [](const Status&) {});
  EXPECT_EQ(owner.times_made, 2);
}

TEST(OwnedSource, WhatIsDroppedUnderAReaderIsNeverWrong) {
  Random random(7);
  SCOPED_TRACE(random.trace());
  MakingOwner owner;
  const auto worker = OpenOwned(owner.volume.field.Text(), Here()).value();
  std::atomic<int> tries = 0;
  std::atomic<bool> ends = false;
  std::vector<std::jthread> makers;
  for (int i = 0; i < 2; ++i) {
    makers.emplace_back([&, of_thread = Random(random.Integer(0, 1 << 30))]() mutable {
      for (int seen = tries; !ends; seen = tries) {
        const auto box = of_thread.Integer<std::size_t>(0, owner.count() - 1);
        of_thread.Integer(0, 1) == 0 ? owner.Make(box) : owner.Drop(box);
        tries.wait(seen);  // however many processors there are, some reads find their boxes as they were
      }
    });
  }
  int right = 0;
  while (right < 5000 && tries < 1'000'000 && !HasFailure()) {
    const Box box = RandomBox(random, {{}, MakingOwner::kSize});
    std::vector<float> samples(std::size_t(box.voxel_count()));
    const Status read = worker->ReadNow(0, box, std::as_writable_bytes(std::span(samples)));
    ++tries;
    tries.notify_all();
    if (!read.ok()) {
      EXPECT_EQ(read.code(), StatusCode::kUnavailable);
      continue;
    }
    ++right;
    EXPECT_EQ(samples, MakingOwner::Of(box));
  }
  ends = true;
  ++tries;
  tries.notify_all();
  EXPECT_EQ(right, 5000);
}

// What `child` exits with, which runs in a process of its own while this one runs `meanwhile` with its id and its first number.
int InAnotherProcess(const auto& child, const auto& meanwhile) {
  std::array<int, 2> pipe = {};
  EXPECT_EQ(::pipe(pipe.data()), 0);
  const pid_t pid = ::fork();
  if (pid == 0) ::_exit(child([&](std::uint32_t number) { (void)!::write(pipe[1], &number, sizeof(number)); }));
  std::uint32_t number = 0;
  ::close(pipe[1]);
  EXPECT_EQ(::read(pipe[0], &number, sizeof(number)), sizeof(number));
  meanwhile(pid, number);
  ::close(pipe[0]);
  int status = 0;
  (void)::waitpid(pid, &status, 0);
  return status;
}

TEST(OwnerMemory, ArraysOfAnotherProcessAreReadUntilItEnds) {
  std::vector<float> samples;
  const auto owner = [](const auto& say) {
    std::vector<float> array(OwnerOfArray::kBytes / sizeof(float));
    std::iota(array.begin(), array.end(), 5.0F);
    const OwnerOfArray of(reinterpret_cast<const std::byte*>(array.data()));
    say(of.memory->file_descriptor());
    return ::pause();
  };
  InAnotherProcess(owner, [&](pid_t pid, std::uint32_t file_descriptor) {
    const auto mapped = MappedOwner::Open({SharedMemoryScope(), std::uint32_t(pid), file_descriptor, OwnerOfArray::kIncarnation}).value();
    EXPECT_TRUE(mapped->Reaches(1));
    ASSERT_TRUE(ReadWhole(*mapped, samples).ok());
    std::vector<float> expected(samples.size());
    std::iota(expected.begin(), expected.end(), 5.0F);
    EXPECT_EQ(samples, expected);
    ::kill(pid, SIGKILL);
    siginfo_t ended;
    ASSERT_EQ(::waitid(P_PID, id_t(pid), &ended, WEXITED | WNOWAIT), 0);
    EXPECT_FALSE(mapped->Reaches(1));
    EXPECT_THAT(ReadWhole(*mapped, samples).message(), HasSubstr("cannot be read: No such process"));
  });
}

// Some containers refuse process_vm_readv.
TEST(OwnerMemory, ArraysAreReadWithoutTheSystemCallForIt) {
  std::vector<float> array(OwnerOfArray::kBytes / sizeof(float));
  std::iota(array.begin(), array.end(), 5.0F);
  const OwnerOfArray owner(reinterpret_cast<const std::byte*>(array.data()));
  const OwnerPlace place = owner.place();
  const auto reader = [&](const auto& say) {
    std::array<sock_filter, 4> refuse = {
        {BPF_STMT(BPF_LD | BPF_W | BPF_ABS, offsetof(seccomp_data, nr)), BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, SYS_process_vm_readv, 0, 1),
         BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ERRNO | EPERM), BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ALLOW)}};
    const sock_fprog filter = {refuse.size(), refuse.data()};
    say(1);
    if (::prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) != 0 || ::prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, &filter) != 0) return 1;
    const auto mapped = MappedOwner::Open(place);
    std::vector<float> samples;
    return mapped.ok() && (*mapped)->Reaches(1) && ReadWhole(**mapped, samples).ok() && samples == array ? 0 : 2;
  };
  EXPECT_EQ(InAnotherProcess(reader, [](pid_t, std::uint32_t) {}), 0);
}

TEST(OwnerMemory, LayoutsThatDoNotFitAreRefusedInOneLine) {
  OwnerLayout layout{.samples = SampleType::kFloat64, .size = {6, 5, 4}};
  layout.boxes = {{.box = {{0, 0, 0}, {6, 5, 4}}, .held = {{0, 0, 0}, {6, 5, 4}}}};
  layout.PlaceDense();
  EXPECT_TRUE(layout.Check().ok());
  const auto error = [&](auto change) {
    OwnerLayout wrong = layout;
    change(wrong);
    return OwnerMemory::Create(1, wrong).status().message();
  };
  EXPECT_THAT(error([](OwnerLayout& l) { l.size.x = 65536; }), HasSubstr("size 65536 x 5 x 4"));
  EXPECT_THAT(error([](OwnerLayout& l) { l.slots = 9; }), HasSubstr("9 slots, must be in [1, 8]"));
  EXPECT_THAT(error([](OwnerLayout& l) { l.boxes[0].held.end.z = 5; }), HasSubstr("box 0 is empty, or not inside"));
  EXPECT_THAT(error([](OwnerLayout& l) { l.boxes[0].strides[2] = 0; }), HasSubstr("a stride of 0 of box 0"));
  EXPECT_THAT(error([](OwnerLayout& l) { l.boxes[0].strides[2] = std::int64_t{1} << 40; }), HasSubstr("box 0 takes"));
  EXPECT_THAT(error([](OwnerLayout& l) { l.boxes[0].offset = 8; }), HasSubstr("box 0 takes 960 bytes from 8 on, a slot has 960"));
  EXPECT_THAT(error([](OwnerLayout& l) { l.slot_bytes = std::uint64_t{1} << 41; }), HasSubstr("limit 1099511627776 bytes"));
  EXPECT_THAT(error([](OwnerLayout& l) { l.boxes.resize(kMostOwnedBoxes + 1); }), HasSubstr("4097 boxes, limit 4096"));
}

}  // namespace
}  // namespace slabstream
