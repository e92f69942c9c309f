// Datasets as libhdf5 writes them: every layout, type, byte order, filter and index of chunks. libhdf5's own reading is the oracle.
#include "data/hdf5/hdf5_array.h"
#include "data/sources/file_array.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "data/sources/read_context.h"
#include "tests/data/hdf5/hdf5_files.h"
#include "tests/data/sources/read_array.h"
#include "tests/support/random.h"
#include "tests/support/temporary_directory.h"
#include "tests/support/whole_file.h"

namespace slabstream {
namespace {

using testing::HasSubstr;

class Hdf5ArrayTest : public testing::Test {
 protected:
  Result<std::shared_ptr<ChunkedArray>> Open(const std::string& path, const std::string& dataset = "/data") {
    const Result<std::shared_ptr<Hdf5File>> file = Hdf5File::Open(path);
    if (!file.ok()) return file.status();
    Result<std::shared_ptr<Hdf5Dataset>> found = (*file)->Dataset(dataset);
    if (!found.ok()) return found.status();
    return MakeHdf5Array(*std::move(found), context_);
  }

  TemporaryDirectory directory_;
  SourceContext context_ = std::make_shared<ReadContext>(ReadContext::Limits{.decode_threads = 2});
};

std::vector<std::byte> RandomBytes(std::size_t count, Random& random) {
  std::vector<std::byte> bytes(count);
  for (std::byte& byte : bytes) byte = std::byte(random.Integer(0, 3) * 41);
  return bytes;
}

// Writes some boxes of a dataset, so that other chunks stay away.
void WriteSome(hid_t dataset, const Hdf5Writer::Layout& layout, Random& random) {
  for (int i = random.Integer(0, 2); i >= 0; --i) {
    std::vector<hsize_t> begin, count;
    std::size_t elements = 1;
    for (const hsize_t side : layout.size) {
      begin.push_back(random.Integer<hsize_t>(0, side - 1));
      count.push_back(random.Integer<hsize_t>(1, side - begin.back()));
      elements *= count.back();
    }
    const hid_t space = H5Dget_space(dataset), memory = H5Screate_simple(int(count.size()), count.data(), nullptr);
    ASSERT_GE(H5Sselect_hyperslab(space, H5S_SELECT_SET, begin.data(), nullptr, count.data(), nullptr), 0);
    const std::vector<std::byte> samples = RandomBytes(elements * BytesPerSample(layout.type), random);
    ASSERT_GE(H5Dwrite(dataset, NativeHdf5Type(layout.type), memory, space, H5P_DEFAULT, samples.data()), 0);
    H5Sclose(space);
    H5Sclose(memory);
  }
}

TEST_F(Hdf5ArrayTest, GivesWhatTheLibraryGives) {
  Random random(3);
  SCOPED_TRACE(random.trace());
  int missing = 0;
  for (int round = 0; round < 300; ++round) {
    Hdf5Writer::Layout layout{.type = SampleType(random.Integer(0, 9)), .big_endian = random.Chance(0.5)};
    for (int axes = random.Integer(1, 4); axes > 0; --axes) layout.size.push_back(random.Integer<hsize_t>(1, 14));
    const int kind = random.Integer(0, 5);
    layout.compact = kind == 0;
    if (kind > 1) {
      layout.grows = random.Chance(0.4);
      for (const hsize_t side : layout.size) layout.chunk.push_back(random.Integer<hsize_t>(1, layout.grows ? side + 3 : side));
      layout.filters = {random.Chance(0.5), random.Chance(0.5), random.Chance(0.5), random.Chance(0.3)};
    }
    if (random.Chance(0.5)) layout.fill = RandomBytes(BytesPerSample(layout.type), random);
    SCOPED_TRACE(testing::Message() << "round " << round << ": sizes " << testing::PrintToString(layout.size) << ", chunks "
                                    << testing::PrintToString(layout.chunk) << (layout.grows ? ", grows" : "")
                                    << (layout.compact ? ", compact" : "") << ", filters " << layout.filters.shuffle
                                    << layout.filters.deflate << layout.filters.fletcher32 << layout.filters.not_of_cut_chunks);
    const std::string path = directory_ / "random.h5";
    std::vector<std::byte> expected;
    {
      Hdf5Writer writer(path, random.Chance(0.5));
      const hid_t dataset = writer.Create("/data", layout);
      WriteSome(dataset, layout, random);
      std::size_t bytes = BytesPerSample(layout.type);
      for (const hsize_t side : layout.size) bytes *= side;
      expected.resize(bytes);
      ASSERT_GE(H5Dread(dataset, NativeHdf5Type(layout.type), H5S_ALL, H5S_ALL, H5P_DEFAULT, expected.data()), 0);
      ASSERT_GE(H5Dclose(dataset), 0);
    }
    const auto array = Open(path);
    ASSERT_TRUE(array.ok()) << array.status().message();
    ASSERT_EQ((*array)->shape().type, layout.type);
    ASSERT_TRUE(std::ranges::equal((*array)->shape().size, layout.size));
    const Result<std::vector<std::byte>> elements = ReadArray(**array);
    ASSERT_TRUE(elements.ok()) << elements.status().message();
    ASSERT_EQ(*elements, expected);
    const std::vector<std::uint64_t> first(layout.size.size(), 0);
    missing += ReadChunkNow(**array, first).value().has_value() ? 0 : 1;
  }
  EXPECT_GT(missing, 0);
}

TEST_F(Hdf5ArrayTest, FindsAnyOfManyChunks) {
  for (const bool latest : {false, true}) {
    const std::string path = directory_ / "many.h5";
    std::vector<std::uint16_t> samples(40 * 50 * 60);
    for (std::size_t i = 0; i < samples.size(); ++i) samples[i] = std::uint16_t(i * 7);
    Hdf5Writer(path, latest).Write("/data", {.size = {40, 50, 60}, .chunk = {3, 4, 5}, .filters = {.deflate = true}}, samples.data());
    const auto array = Open(path);
    ASSERT_TRUE(array.ok()) << array.status().message();
    const Result<std::vector<std::byte>> elements = ReadArray(**array);
    ASSERT_TRUE(elements.ok()) << elements.status().message();
    EXPECT_EQ(std::memcmp(elements->data(), samples.data(), elements->size()), 0);
  }
}

TEST_F(Hdf5ArrayTest, SlicesWhatLiesInOnePiece) {
  std::vector<std::uint16_t> samples(7 * 1000 * 300);
  for (std::size_t i = 0; i < samples.size(); ++i) samples[i] = std::uint16_t(i * 31 >> 3);
  const std::string path = directory_ / "piece.h5";
  Hdf5Writer(path).Write("/data", {.size = {7, 1000, 300}}, samples.data());
  const auto array = Open(path);
  ASSERT_TRUE(array.ok()) << array.status().message();
  EXPECT_LE((*array)->shape().chunk_bytes(), kFileSliceBytes);
  EXPECT_EQ((*array)->shape().chunk, (std::vector<std::uint64_t>{1, 1000, 300}));
  const Result<std::vector<std::byte>> elements = ReadArray(**array);
  ASSERT_TRUE(elements.ok()) << elements.status().message();
  EXPECT_EQ(std::memcmp(elements->data(), samples.data(), elements->size()), 0);
}

TEST_F(Hdf5ArrayTest, LeavesFiltersOutWhereAChunkSaysSo) {
  const std::string path = directory_ / "mask.h5";
  const std::vector<std::uint16_t> samples = {1, 2, 3, 4};
  {
    Hdf5Writer writer(path);
    const hid_t dataset = writer.Create("/data", {.size = {8}, .chunk = {4}, .filters = {.shuffle = true, .deflate = true}});
    const hsize_t first = 0, second = 4;
    constexpr std::uint32_t kNone = 3, kNoDeflate = 2;
    ASSERT_GE(H5Dwrite_chunk(dataset, H5P_DEFAULT, kNone, &first, 8, samples.data()), 0);
    const std::vector<std::uint8_t> shuffled = {1, 2, 3, 4, 0, 0, 0, 0};
    ASSERT_GE(H5Dwrite_chunk(dataset, H5P_DEFAULT, kNoDeflate, &second, 8, shuffled.data()), 0);
    H5Dclose(dataset);
  }
  const auto array = Open(path);
  ASSERT_TRUE(array.ok()) << array.status().message();
  for (const std::uint64_t index : {0, 1}) {
    const auto chunk = ReadChunkNow(**array, std::span(&index, 1));
    ASSERT_TRUE(chunk.ok()) << chunk.status().message();
    EXPECT_EQ((*chunk)->stored_bytes, 8U);
    EXPECT_EQ(std::memcmp((*chunk)->elements.span().data(), samples.data(), 8), 0) << "chunk " << index;
  }
}

TEST_F(Hdf5ArrayTest, SaysWhichFilterIsMissing) {
  const std::string path = directory_ / "filter.h5";
  {
    Hdf5Writer writer(path);
    const hid_t creation = H5Pcreate(H5P_DATASET_CREATE), space = H5Screate_simple(1, std::array<hsize_t, 1>{8}.data(), nullptr);
    const hsize_t chunk = 4;
    H5Pset_chunk(creation, 1, &chunk);
    constexpr H5Z_filter_t kBlosc2 = 32026;
    H5Pset_filter(creation, kBlosc2, H5Z_FLAG_OPTIONAL, 0, nullptr);
    H5Dclose(H5Dcreate2(writer.file(), "/data", H5T_NATIVE_UINT8, space, H5P_DEFAULT, creation, H5P_DEFAULT));
    H5Pclose(creation);
    H5Sclose(space);
  }
  const auto array = Open(path);
  ASSERT_FALSE(array.ok());
  EXPECT_EQ(array.status().code(), StatusCode::kInvalidArgument);
  EXPECT_THAT(array.status().message(),
              HasSubstr("filter.h5: dataset '/data' is packed by the filter 32026 (blosc2), which is not supported"));
}

TEST_F(Hdf5ArrayTest, NoticesDamage) {
  const std::string path = directory_ / "damaged.h5";
  std::vector<std::uint16_t> samples(1000);
  for (std::size_t i = 0; i < samples.size(); ++i) samples[i] = std::uint16_t(i);
  Hdf5Writer(path).Write("/data", {.size = {1000}, .chunk = {1000}, .filters = {.fletcher32 = true}}, samples.data());
  const auto array = Open(path);
  ASSERT_TRUE(array.ok()) << array.status().message();
  ASSERT_TRUE(ReadArray(**array).ok());
  const std::vector<std::uint64_t> first = {0};
  const std::string bytes = ReadFile(path);
  const std::size_t at = bytes.find(std::string(reinterpret_cast<const char*>(samples.data()), 2000));
  ASSERT_NE(at, std::string::npos);
  std::string damaged = bytes;
  damaged[at + 100] ^= 1;
  std::ofstream(path, std::ios::binary) << damaged;
  const Status flipped = ReadChunkNow(**array, first).status();
  EXPECT_EQ(flipped.code(), StatusCode::kDataLoss);
  EXPECT_THAT(flipped.message(), HasSubstr("damaged.h5: dataset '/data': chunk 0: damaged: its checksum is"));
  std::ofstream(path, std::ios::binary | std::ios::trunc) << bytes.substr(0, at + 100);
  const Status cut = ReadChunkNow(**array, first).status();
  EXPECT_EQ(cut.code(), StatusCode::kDataLoss);
  EXPECT_THAT(cut.message(), HasSubstr("dataset '/data': chunk 0: the file ends before it does"));
  std::filesystem::remove(path);
  const Status gone = ReadChunkNow(**array, first).status();
  EXPECT_EQ(gone.code(), StatusCode::kUnavailable) << "a file that is gone is no chunk that was never written";
}

}  // namespace
}  // namespace slabstream
