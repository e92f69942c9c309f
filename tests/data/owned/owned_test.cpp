// Volumes of owners: whoever reads them gets the voxels of one array, bit for bit, from memory of this host or by asking. A layout that
// does not fit is refused. (tests/fuzz/decode_owners.cpp: headers that are anything.)
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cstring>
#include <numeric>
#include <utility>

#include "common/volume/stored_at.h"
#include "data/owned/owned_source.h"
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

// A float32 volume of random owners, each with boxes, ghosts, gaps and an order of axes of its own.
class OwnedVolumeOf {
 public:
  OwnedVolumeOf(Random& random, int owners)
      : size_{random.Integer(4, 40), random.Integer(4, 40), random.Integer(4, 40)}, array_(CountIn(size_)) {
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
    volume.ask = [this](std::uint32_t, const Box& box, const std::function<void(Result<Bytes>)>& done) {
      ++asked;
      const std::vector<float> samples = Of(box, volume.field.time);
      const auto bytes = std::as_bytes(std::span(samples));
      done(Bytes(std::vector<std::byte>(bytes.begin(), bytes.end())));
    };
  }

  // Of the array at a time, whose samples are those of time 0 plus a million each.
  std::vector<float> Of(const Box& box, std::uint64_t time) const {
    std::vector<float> samples;
    for (std::int32_t z = box.begin.z; z < box.end.z; ++z) {
      for (std::int32_t y = box.begin.y; y < box.end.y; ++y) {
        for (std::int32_t x = box.begin.x; x < box.end.x; ++x) samples.push_back(At({x, y, z}, time));
      }
    }
    return samples;
  }
  float At(const Index3& voxel, std::uint64_t time) const { return array_[NumberIn(size_, voxel)] + 1e6F * float(time); }

  void Write(std::size_t owner, std::uint32_t slot, std::uint64_t time) {
    const std::span<std::byte> bytes = memory[owner]->Begin(slot);
    for (const HeldBox& each : layouts_[owner].boxes) {
      auto* const samples = reinterpret_cast<float*>(bytes.data() + each.offset);
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
    memory[owner]->Commit(slot, time, 0.5 * double(time));
  }
  void WriteAll(std::uint64_t time) {
    for (std::size_t owner = 0; owner < memory.size(); ++owner) Write(owner, std::uint32_t(time % 2), time);
    volume.field.time = time;
  }
  Box Bounds() const { return {{0, 0, 0}, size_}; }

  OwnedVolume volume;
  std::vector<std::shared_ptr<OwnerMemory>> memory;
  std::atomic<int> asked = 0;

 private:
  Index3 size_;
  std::vector<float> array_;
  std::vector<OwnerLayout> layouts_;
};

std::vector<float> ReadBox(VolumeSource& source, const Box& box) {
  std::vector<float> samples(std::size_t(box.voxel_count()));
  const Status read = source.ReadNow(0, box, std::as_writable_bytes(std::span(samples)));
  EXPECT_TRUE(read.ok()) << read.message();
  return samples;
}

TEST(OwnedSource, BoxesAreThoseOfOneArrayHereAndAsked) {
  Random random(11);
  SCOPED_TRACE(random.trace());
  for (const int owners : {1, 3, 8}) {
    OwnedVolumeOf of(random, owners);
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
      EXPECT_TRUE(mixed->Reaches(box));
      EXPECT_EQ(ReadBox(*mixed, box), expected);
      if (opened.ok() && (*opened)->Reaches(box)) {
        EXPECT_EQ(ReadBox(**opened, box), expected);
      }
      of.asked = 0;
    }
    EXPECT_EQ(opened.ok(), owners > 1) << "every second owner is on this host";
    if (opened.ok()) {
      EXPECT_FALSE((*opened)->Reaches(of.Bounds()));
    }
    EXPECT_EQ(OpenOwned(of.volume.field.Text(), Here()).value()->info().version, here->info().version);
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

TEST(OwnedField, ATextIsReadAsItWasWritten) {
  OwnedField field{"rho", ~std::uint64_t{0}, {}};
  for (std::uint32_t i = 0; i < 4096; ++i)
    field.owners.push_back({i < 64 ? 0 : ~std::uint64_t{i / 64}, 0xFFFFFFFF - i, i, ~std::uint64_t{i}});
  const std::string text = field.Text();
  EXPECT_LE(text.size(), kMaxSourceBytes) << "of 4096 owners";
  EXPECT_EQ(OwnedField::Parse(text).value(), field);
  for (std::size_t length = 0; length < 60; ++length) (void)OwnedField::Parse(text.substr(0, length));
  for (const char* wrong :
       {"", "owned:", "owned:a/b:1:", "owned:rho:1", "owned:rho:x:", "owned:rho:1:1.2.3", "owned:rho:1:@1,", "owned:rho:1:-1.2.3,"}) {
    EXPECT_FALSE(OwnedField::Parse(wrong).ok()) << wrong;
  }
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
