#include "data/sources/mapped_array.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

#include "tests/data/sources/memory_array.h"
#include "tests/data/sources/read_array.h"
#include "tests/support/random.h"

namespace slabstream {
namespace {

TEST(MappedArrayTest, EachElementBecomesTheValueItStandsFor) {
  for (std::uint64_t seed = 0; seed < 60; ++seed) {
    Random random(seed);
    SCOPED_TRACE(random.trace());
    ArrayShape shape{.type = SampleType::kInt16, .cut_at_end = random.Chance(0.5)};
    std::uint64_t count = 1;
    for (int axis = random.Integer(1, 4); axis > 0; --axis) {
      shape.size.push_back(random.Integer<std::uint64_t>(1, 9));
      shape.chunk.push_back(random.Integer<std::uint64_t>(1, 5));
      count *= shape.size.back();
    }
    std::vector<std::int16_t> elements(count);
    for (std::int16_t& element : elements) element = std::int16_t(random.Integer(-20, 20));
    const std::int16_t fill = 7;
    shape.fill.resize(sizeof fill);
    std::memcpy(shape.fill.data(), &fill, sizeof fill);
    const auto bytes = std::as_bytes(std::span(elements));
    const auto array = std::make_shared<MemoryArray>(shape, std::vector(bytes.begin(), bytes.end()));

    ElementMeaning meaning{.mapped_axes = random.Integer<std::size_t>(0, shape.size.size()), .clamp = random.Chance(0.5)};
    std::uint64_t slices = 1;
    for (std::size_t axis = 0; axis < meaning.mapped_axes; ++axis) slices *= shape.size[axis];
    meaning.mappings.clear();
    for (std::uint64_t i = 0; i < slices; ++i) meaning.mappings.push_back({0.5 * random.Integer(1, 5), double(random.Integer(-9, 9))});
    if (random.Chance(0.5)) meaning.least = -15;
    if (random.Chance(0.5)) meaning.most = 16;
    if (random.Chance(0.5)) meaning.missing = {3, std::nan("")};
    const Result<std::vector<std::byte>> read = ReadArray(*MakeMappedArray(array, meaning));
    ASSERT_TRUE(read.ok()) << read.status().message();
    ASSERT_EQ(read->size(), count * sizeof(float));
    for (std::uint64_t i = 0; i < count; ++i) {
      float value = 0;
      std::memcpy(&value, read->data() + i * sizeof value, sizeof value);
      double element = elements[i];
      const bool outside = element < meaning.least || element > meaning.most;
      if ((!meaning.missing.empty() && element == meaning.missing.front()) || (outside && !meaning.clamp)) {
        EXPECT_TRUE(std::isnan(value)) << i;
        continue;
      }
      if (outside) element = element < meaning.least ? meaning.least : meaning.most;
      const ValueMapping& mapping = meaning.mappings[i / (count / slices)];
      EXPECT_EQ(value, float(mapping.scale * element + mapping.offset)) << i;
    }
  }
}

TEST(MappedArrayTest, AChunkThatIsNotThereHasTheFillValueOfEachSlice) {
  ArrayShape shape{.size = {2, 2}, .chunk = {2, 2}, .type = SampleType::kUint8, .fill = {std::byte{4}}};
  const auto array = std::make_shared<MemoryArray>(shape, std::vector(4, std::byte{9}));
  array->missing = {0};
  const auto mapped = MakeMappedArray(array, {.mappings = {{1, 0}, {2, 1}}, .mapped_axes = 1});
  const std::vector<std::uint64_t> first = {0, 0};
  const auto chunk = ReadChunkNow(*mapped, first);
  ASSERT_TRUE(chunk.ok() && chunk->has_value());
  float values[4];
  std::memcpy(values, (*chunk)->elements.span().data(), sizeof values);
  EXPECT_EQ(values[1], 4);
  EXPECT_EQ(values[2], 9);
}

TEST(MappedArrayTest, ALinearMeaningNeedsNoArray) {
  EXPECT_TRUE((ElementMeaning{.mappings = {{2, 3}}, .missing = {std::nan("")}}.linear()));
  EXPECT_FALSE((ElementMeaning{.missing = {0}}.linear()));
  EXPECT_FALSE((ElementMeaning{.most = 4095}.linear()));
  EXPECT_FALSE((ElementMeaning{.mappings = {{0, 5}}}.linear()));
  EXPECT_FALSE((ElementMeaning{.mappings = {{1, 0}, {2, 0}}, .mapped_axes = 1}.linear()));
}

}  // namespace
}  // namespace slabstream
