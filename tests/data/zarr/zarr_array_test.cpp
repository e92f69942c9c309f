// Arrays of both versions, in every way in which they can be stored.
#include "data/zarr/zarr_array.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <future>
#include <mutex>

#include "tests/data/volume_io/volume_files.h"
#include "tests/data/zarr/read_zarr.h"
#include "tests/data/zarr/zarr_files.h"
#include "tests/support/random.h"
#include "tests/support/temporary_directory.h"

namespace slabstream {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

// Different for neighbours, and a value of every type.
double Element(std::span<const std::uint64_t> at) {
  std::uint64_t number = 1;
  for (const std::uint64_t along : at) number = number * 7 + along;
  return double(number % 100);
}

std::vector<double> Expected(const ZarrSpec& spec, const IsMissing& missing, double fill) {
  std::vector<double> elements;
  ForEachIndex(spec.shape, [&](const Counts& at) {
    Counts chunk;
    for (std::size_t axis = 0; axis < at.size(); ++axis) chunk.push_back(at[axis] / spec.chunk[axis]);
    elements.push_back(missing && missing(chunk) ? fill : Element(at));
  });
  return elements;
}

std::vector<std::size_t> AnyOrder(Random& random, std::size_t axes) {
  std::vector<std::size_t> order(axes);
  for (std::size_t i = 0; i < axes; ++i) order[i] = i;
  for (std::size_t i = 0; i + 1 < axes; ++i) std::swap(order[i], order[random.Integer(i, axes - 1)]);
  return order;
}

ZarrSpec AnySpec(Random& random) {
  const std::vector<std::string> codecs = {"", "gzip", "zlib", "zstd", "blosc", "lz4"};
  ZarrSpec spec{.version = random.Integer(2, 3)};
  const auto axes = random.Integer<std::size_t>(1, 4);
  for (std::size_t i = 0; i < axes; ++i) {
    spec.shape.push_back(random.Integer<std::uint64_t>(1, axes > 3 ? 5 : 9));
    spec.chunk.push_back(random.Integer<std::uint64_t>(2, 5));
  }
  spec.type = SampleType(random.Integer(0, int(SampleType::kFloat64)));
  spec.big_endian = random.Chance(0.3);
  spec.separator = random.Chance(0.5) ? '.' : '/';
  spec.codec = codecs[random.Integer<std::size_t>(0, codecs.size() - 1)];
  spec.fill = 7;
  if (spec.version == 2) {
    spec.fortran = random.Chance(0.5);
    spec.shuffled = random.Chance(0.3);
    return spec;
  }
  spec.old_keys = random.Chance(0.3);
  spec.checked = random.Chance(0.3);
  if (random.Chance(0.4)) spec.transpose = AnyOrder(random, axes);
  if (random.Chance(0.6)) {
    for (const std::uint64_t side : spec.chunk) spec.shard.push_back(side * random.Integer<std::uint64_t>(1, 3));
    if (random.Chance(0.4)) spec.inner_transpose = AnyOrder(random, axes);
    spec.index_at_end = random.Chance(0.5);
    spec.index_big_endian = random.Chance(0.3);
    spec.index_checked = random.Chance(0.7);
  }
  return spec;
}

TEST(ZarrArrayTest, EveryElementIsWhereTheMetadataSay) {
  Random random(1);
  SCOPED_TRACE(random.trace());
  constexpr int kArrays = 200;
  for (int i = 0; i < kArrays; ++i) {
    const TemporaryDirectory folder;
    const ZarrSpec spec = AnySpec(random);
    SCOPED_TRACE(MetadataOf(spec).dump());
    const bool some = random.Chance(0.5);
    const IsMissing missing = [&](std::span<const std::uint64_t> chunk) { return some && int(Element(chunk)) % 3 == 0; };
    WriteZarrArray(folder / "group/array", spec, Element, missing);
    const Result<zarr::ZarrArray> array = OpenTestArray(folder.path(), "group/array");
    ASSERT_TRUE(array.ok()) << array.status().message();
    EXPECT_EQ(array->array->shape().type, spec.type);
    const Result<std::vector<double>> elements = ReadElements(*array);
    ASSERT_TRUE(elements.ok()) << elements.status().message();
    ASSERT_EQ(*elements, Expected(spec, missing, 7));
  }
}

TEST(ZarrArrayTest, AxesAreInTheOrderOfStorage) {
  const TemporaryDirectory folder;
  WriteZarrArray(folder / "f", {.shape = {2, 3, 5}, .chunk = {2, 3, 4}, .fortran = true}, Element);
  WriteZarrArray(folder / "t", {.version = 3, .shape = {2, 3, 5}, .chunk = {2, 3, 4}, .transpose = {1, 2, 0}, .names = {"z", nullptr, "x"}},
                 Element);
  const auto fortran = OpenTestArray(folder / "f"), transposed = OpenTestArray(folder / "t");
  EXPECT_THAT(fortran->array->shape().size, ElementsAre(5, 3, 2));
  EXPECT_THAT(fortran->array->shape().chunk, ElementsAre(4, 3, 2));
  EXPECT_THAT(fortran->from, ElementsAre(2, 1, 0));
  EXPECT_THAT(transposed->array->shape().size, ElementsAre(3, 5, 2));
  EXPECT_THAT(transposed->dimension_names, ElementsAre("", "x", "z"));
}

TEST(ZarrArrayTest, HasTheFillValueThatTheMetadataWrite) {
  const TemporaryDirectory folder;
  const struct {
    SampleType type;
    Json fill;
    double value;
  } cases[] = {{SampleType::kUint8, 255, 255},
               {SampleType::kInt8, -128, -128},
               {SampleType::kUint16, 7.0, 7},
               {SampleType::kInt64, -5, -5},
               {SampleType::kUint8, true, 1},
               {SampleType::kFloat32, "Infinity", INFINITY},
               {SampleType::kFloat64, "-Infinity", -INFINITY},
               {SampleType::kFloat32, "0x3fc00000", 1.5},
               {SampleType::kFloat64, "0x3ff8000000000000", 1.5},
               {SampleType::kFloat32, 0.25, 0.25}};
  for (const auto& [type, fill, value] : cases) {
    for (const int version : {2, 3}) {
      const ZarrSpec spec{.version = version, .shape = {3}, .chunk = {2}, .type = type, .fill = fill};
      const std::string path = folder / "array" + std::to_string(version);
      std::filesystem::remove_all(path);
      WriteZarrArray(path, spec, Element, [](auto) { return true; });
      const auto array = OpenTestArray(path);
      ASSERT_TRUE(array.ok()) << array.status().message();
      EXPECT_EQ(*ReadElements(*array), std::vector<double>(3, value)) << fill.dump();
    }
  }
  WriteZarrArray(folder / "nan", {.shape = {1}, .chunk = {1}, .type = SampleType::kFloat32, .fill = "NaN"}, Element,
                 [](auto) { return true; });
  EXPECT_TRUE(std::isnan(ReadElements(*OpenTestArray(folder / "nan"))->front()));
  WriteZarrArray(folder / "null", {.shape = {1}, .chunk = {1}, .fill = nullptr}, Element, [](auto) { return true; });
  EXPECT_EQ(ReadElements(*OpenTestArray(folder / "null"))->front(), 0);
}

TEST(ZarrArrayTest, ChunksOfOtherLengthsAndDamagedOnesAreErrorsThatNameThem) {
  const TemporaryDirectory folder;
  for (const std::string codec : {"", "gzip", "zlib", "zstd", "blosc", "lz4"}) {
    const ZarrSpec spec{.shape = {4, 4}, .chunk = {4, 4}, .codec = codec};
    WriteZarrArray(folder / "a", spec, Element);
    const std::string path = folder / "a/0.0", right = ReadFile(path);
    const auto array = OpenTestArray(folder / "a");
    for (const std::string& wrong : {right.substr(0, right.size() - 3), std::string(), std::string(200'000, 'x'), right + right}) {
      WriteFile(path, wrong);
      const auto chunk = ReadChunkNow(*array->array, {0, 0});
      ASSERT_FALSE(chunk.ok()) << codec << " of " << wrong.size() << " bytes";
      EXPECT_EQ(chunk.status().code(), StatusCode::kDataLoss) << chunk.status().message();
      EXPECT_THAT(chunk.status().message(), HasSubstr("a/0.0: ")) << codec;
    }
    WriteFile(path, right);
    EXPECT_TRUE(ReadElements(*array).ok());
  }
}

constexpr int kIndexCase = 16 * 4 + 4;

ZarrSpec ShardedSpec() {
  return {.version = 3, .shape = {4, 4}, .chunk = {2, 2}, .shard = {4, 4}, .separator = '/', .codec = "zstd", .checked = true};
}

TEST(ZarrArrayTest, DamageInAShardIsAnErrorThatNamesIt) {
  const TemporaryDirectory folder;
  WriteZarrArray(folder.path(), ShardedSpec(), Element);
  const std::string path = folder / "c/0/0", right = ReadFile(path);
  const auto read = [&] { return ReadElements(*OpenTestArray(folder.path())).status(); };
  ASSERT_TRUE(read().ok());
  for (std::size_t i = 0; i < right.size(); ++i) {
    std::string wrong = right;
    wrong[i] = char(wrong[i] ^ 0x10);
    WriteFile(path, wrong);
    const Status status = read();
    ASSERT_EQ(status.code(), StatusCode::kDataLoss) << i << status.message();
    EXPECT_THAT(status.message(), HasSubstr("c/0/0: ")) << i;
    WriteFile(path, right.substr(0, i));
    EXPECT_EQ(read().code(), StatusCode::kDataLoss) << i;
  }
}

TEST(ZarrArrayTest, AnIndexThatPointsOutOfItsShardIsAnError) {
  const TemporaryDirectory folder;
  ZarrSpec spec = ShardedSpec();
  spec.index_checked = false;
  WriteZarrArray(folder.path(), spec, Element);
  const std::string path = folder / "c/0/0", right = ReadFile(path);
  const std::size_t index = right.size() - (kIndexCase - 4);
  for (const std::uint64_t number : {std::uint64_t{1} << 20, std::uint64_t{1} << 62, ~std::uint64_t{0} - 1, ~std::uint64_t{0}}) {
    for (const std::size_t at : {index, index + 8}) {
      std::string wrong = right;
      std::memcpy(wrong.data() + at, &number, sizeof number);
      WriteFile(path, wrong);
      const auto chunk = ReadChunkNow(*OpenTestArray(folder.path())->array, {0, 0});
      EXPECT_EQ(chunk.status().code(), StatusCode::kDataLoss) << number << ": " << chunk.status().message();
      EXPECT_THAT(chunk.status().message(), HasSubstr("chunk 0 of the shard"));
    }
  }
}

// Counts what is asked of another store.
class CountingStore : public Store {
 public:
  explicit CountingStore(std::shared_ptr<Store> store) : store_(std::move(store)) {}
  void Read(const std::string& key, const ByteRange& range, std::uint64_t most, Done done, StillWanted /*wanted*/) override {
    ++(range.from_end ? indices : chunks);
    store_->Read(key, range, most, std::move(done));
  }
  Result<std::vector<std::string>> List(const std::string& folder) override { return store_->List(folder); }
  const std::string& name() const override { return store_->name(); }

  std::atomic<int> indices = 0, chunks = 0;

 private:
  const std::shared_ptr<Store> store_;
};

TEST(ZarrArrayTest, AnIndexIsReadOnceHoweverManyChunksAreAskedFor) {
  const TemporaryDirectory folder;
  WriteZarrArray(folder.path(), {.version = 3, .shape = {16, 16}, .chunk = {2, 2}, .shard = {8, 8}, .separator = '/', .codec = "zstd"},
                 Element, [](std::span<const std::uint64_t> chunk) { return chunk[0] >= 4 && chunk[1] >= 4; });
  const auto store = std::make_shared<CountingStore>(FolderStore(folder.path()));
  const auto array = OpenTestArray(store, "");
  ASSERT_TRUE(array.ok());
  const int metadata = store->chunks;
  std::atomic<int> left = 64, there = 0;
  std::promise<void> all;
  ForEachIndex({8, 8}, [&](const Counts& index) {
    array->array->ReadChunk(index, [&](Result<std::optional<StoredChunk>> chunk) {
      if (chunk.ok() && chunk->has_value()) ++there;
      if (--left == 0) all.set_value();
    });
  });
  all.get_future().wait();
  EXPECT_EQ(there, 48);
  EXPECT_EQ(store->indices, 4);  // one of them of a shard that is not there
  EXPECT_EQ(store->chunks - metadata, 48);
  ASSERT_TRUE(ReadElements(*array).ok());
  EXPECT_EQ(store->indices, 4);
}

TEST(ZarrArrayTest, AShardThatWasReplacedIsReadAnewAfterOneError) {
  const TemporaryDirectory folder;
  ZarrSpec spec = ShardedSpec();
  WriteZarrArray(folder.path(), spec, Element);
  const auto array = OpenTestArray(folder.path());
  ASSERT_TRUE(ReadElements(*array).ok());
  // Its chunks are elsewhere now.
  WriteZarrArray(folder.path(), spec, Element, [](auto chunk) { return chunk[0] == 0; });
  const auto first = ReadElements(*array);
  EXPECT_EQ(first.status().code(), StatusCode::kDataLoss) << first.status().message();
  EXPECT_TRUE(ReadElements(*array).ok());
}

}  // namespace
}  // namespace slabstream
