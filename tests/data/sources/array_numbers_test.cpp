// Boxes of arrays of any number of axes, held against the elements themselves.
#include "data/sources/array_numbers.h"

#include <gtest/gtest.h>

#include <cstring>
#include <numeric>

#include "tests/data/sources/memory_array.h"
#include "tests/data/sources/opened_source.h"
#include "tests/support/random.h"

namespace slabstream {
namespace {

struct RandomArray {
  ArrayShape shape{.type = SampleType::kUint32};
  std::vector<std::byte> elements;
};

RandomArray MakeArray(Random& random) {
  RandomArray made;
  std::uint64_t count = 1;
  for (int axes = random.Integer(1, 4); axes > 0; --axes) {
    made.shape.size.push_back(std::uint64_t(random.Integer(1, 9)));
    made.shape.chunk.push_back(std::uint64_t(random.Integer(1, 10)));
    count *= made.shape.size.back();
  }
  made.shape.cut_at_end = random.Chance(0.5);
  made.shape.fill = std::vector<std::byte>(sizeof(std::uint32_t), std::byte{0x7f});
  std::vector<std::uint32_t> numbers(count);
  std::iota(numbers.begin(), numbers.end(), 1U);
  made.elements.resize(count * sizeof(numbers[0]));
  std::memcpy(made.elements.data(), numbers.data(), made.elements.size());
  return made;
}

TEST(ArrayNumbersTest, ABoxHasTheElementsOfTheArrayAndTheFillOfMissingChunks) {
  Random random(61);
  SCOPED_TRACE(random.trace());
  const SourceContext context = TestReadContext();
  for (int run = 0; run < 300; ++run) {
    SCOPED_TRACE(run);
    RandomArray made = MakeArray(random);
    const auto array = std::make_shared<MemoryArray>(made.shape, made.elements, run % 2 == 0 ? context : nullptr);
    for (std::uint64_t chunk = 0; chunk < array->chunk_count(); ++chunk) {
      if (random.Chance(0.2)) array->missing.insert(chunk);
    }
    ArrayBox box;
    for (const std::uint64_t size : made.shape.size) {
      box.begin.push_back(std::uint64_t(random.Integer(0, int(size) - 1)));
      box.count.push_back(std::uint64_t(random.Integer(1, int(size - box.begin.back()))));
    }
    const Result<AlignedVector<std::int64_t>> numbers = ReadNumbers<std::int64_t>("numbers", array, box);
    ASSERT_TRUE(numbers.ok()) << numbers.status().message();
    std::vector<std::uint64_t> at = box.begin;
    for (const std::int64_t number : *numbers) {
      std::vector<std::uint64_t> chunk(at.size());
      for (std::size_t axis = 0; axis < at.size(); ++axis) chunk[axis] = at[axis] / made.shape.chunk[axis];
      std::uint32_t wanted = 0x7f7f7f7f;
      if (!array->missing.contains(array->NumberOf(chunk))) std::memcpy(&wanted, array->element(at), sizeof wanted);
      ASSERT_EQ(number, wanted);
      for (std::size_t axis = at.size(); axis-- > 0;) {
        if (++at[axis] < box.begin[axis] + box.count[axis]) break;
        at[axis] = box.begin[axis];
      }
    }
    EXPECT_EQ(at, box.begin) << "as many numbers as the box has";
  }
}

TEST(ArrayNumbersTest, ADamagedChunkIsTold) {
  ArrayShape shape{.size = {6, 6}, .chunk = {2, 3}, .type = SampleType::kUint8, .fill = {std::byte{0}}};
  const auto array = std::make_shared<MemoryArray>(shape, std::vector<std::byte>(36), TestReadContext());
  array->damaged = {3};
  EXPECT_TRUE(ReadNumbers<double>("numbers", array, {{0, 0}, {2, 6}}).ok());
  EXPECT_EQ(ReadNumbers<double>("numbers", array, {{1, 0}, {5, 6}}).status().code(), StatusCode::kDataLoss);
}

}  // namespace
}  // namespace slabstream
