#include "data/sources/read_part.h"

#include <gtest/gtest.h>

#include <optional>

#include "tests/data/sources/memory_source.h"
#include "tests/support/random_box.h"
#include "tests/support/random_volume.h"

namespace slabstream {
namespace {

TEST(ReadPartTest, BytesAreThoseOfTheWholeBox) {
  Random random(31);
  SCOPED_TRACE(random.trace());
  for (int round = 0; round < 300; ++round) {
    const ScalarType type = kTypes[random.Integer<std::size_t>(0, 2)];
    const auto volume =
        std::make_shared<const Volume>(RandomVolume(random, {random.Integer(1, 20), random.Integer(1, 20), random.Integer(1, 20)}, type));
    const std::shared_ptr<VolumeSource> source = MakeMemorySource(volume, {});
    const Box box = RandomBox(random, volume->block.box);
    const VoxelBlock whole = CutBlock(volume->block, box);
    for (int part = 0; part < 10; ++part) {
      const auto begin = random.Integer<std::uint64_t>(0, whole.bytes.size() - 1);
      const auto bytes = random.Integer<std::uint64_t>(1, whole.bytes.size() - begin);
      int calls = 0;
      ReadPart(source, 0, box, begin, bytes, [&](const Result<Bytes>& read) {
        ++calls;
        ASSERT_TRUE(read.ok()) << read.status().message();
        ASSERT_EQ(read->size(), bytes);
        EXPECT_TRUE(std::ranges::equal(read->span(), std::span(whole.bytes).subspan(begin, bytes))) << begin << " + " << bytes;
      });
      EXPECT_EQ(calls, 1);
    }
  }
}

// Fails, or answers when it is told to; remembers what was asked for.
class ScriptedSource : public VolumeSource {
 public:
  explicit ScriptedSource(const Index3& size) { info_.levels = {{{.geometry = {size}}, size}}; }
  const SourceInfo& info() const override { return info_; }
  void Read(int, const Box& box, const BoxRoom&, std::stop_token, ReadDone done) override {
    asked = box;
    done(Status::DataLoss("c/0/0/0: damaged"));
  }
  Counts counts() const override { return {}; }

  std::optional<Box> asked;

 private:
  SourceInfo info_;
};

TEST(ReadPartTest, NoMoreIsReadThanRowsOfOneSliceOrWholeSlices) {
  const auto source = std::make_shared<ScriptedSource>(Index3{10, 10, 10});
  const Box box = {{2, 2, 2}, {7, 8, 9}};  // 5 x 6 x 7
  const auto asked_for = [&](std::uint64_t begin, std::uint64_t bytes) {
    ReadPart(source, 0, box, begin, bytes, [](const Result<Bytes>&) {});
    return *source->asked;
  };
  EXPECT_EQ(asked_for(0, 5), (Box{{2, 2, 2}, {7, 3, 3}}));
  EXPECT_EQ(asked_for(4, 2), (Box{{2, 2, 2}, {7, 4, 3}}));
  EXPECT_EQ(asked_for(30, 30), (Box{{2, 2, 3}, {7, 8, 4}}));
  EXPECT_EQ(asked_for(59, 2), (Box{{2, 2, 3}, {7, 8, 5}}));
  EXPECT_EQ(asked_for(209, 1), (Box{{2, 7, 8}, {7, 8, 9}}));
}

TEST(ReadPartTest, AnErrorIsHandedOn) {
  Status status;
  ReadPart(std::make_shared<ScriptedSource>(Index3{4, 4, 4}), 0, {{0, 0, 0}, {4, 4, 4}}, 3, 20,
           [&](const Result<Bytes>& read) { status = read.status(); });
  EXPECT_EQ(status, Status::DataLoss("c/0/0/0: damaged"));
}

}  // namespace
}  // namespace slabstream
