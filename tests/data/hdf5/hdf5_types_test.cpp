// Types and filters beyond plain numbers, and what files of later versions of HDF5 are called.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "common/files/files.h"
#include "data/hdf5/hdf5_file.h"
#include "data/open/open_source.h"
#include "tests/data/codecs/packed_bytes.h"
#include "tests/data/hdf5/hdf5_files.h"
#include "tests/data/sources/opened_source.h"
#include "tests/support/temporary_directory.h"

namespace slabstream {
namespace {

class Hdf5TypesTest : public testing::Test {
 protected:
  std::shared_ptr<VolumeSource> Open(const ReadOptions& options = {}) { return Opened(OpenSource(path_, options, context_)); }
  void ExpectRefused(const std::string& why, const ReadOptions& options = {}) { ExpectRefusal(OpenSource(path_, options, context_), why); }

  // 2 x 2 x 2 samples of a type, as they are stored.
  void Write(hid_t type, const void* samples, hid_t creation = H5P_DEFAULT) {
    const hsize_t size[3] = {2, 2, 2};
    const Hdf5Writer writer(path_);
    const hid_t space = H5Screate_simple(3, size, nullptr);
    const hid_t dataset = H5Dcreate2(writer.file(), "/data", type, space, H5P_DEFAULT, creation, H5P_DEFAULT);
    ASSERT_GE(H5Dwrite(dataset, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, samples), 0);
    H5Dclose(dataset);
    H5Sclose(space);
    H5Tclose(type);
  }

  TemporaryDirectory directory_;
  std::string path_ = directory_ / "types.h5";
  SourceContext context_ = TestReadContext();
};

hid_t Enumeration(hid_t of, std::initializer_list<const char*> names) {
  const hid_t type = H5Tenum_create(of);
  std::int16_t value = 0;
  for (const char* const name : names) {
    H5Tenum_insert(type, name, &value);
    ++value;
  }
  return type;
}

TEST_F(Hdf5TypesTest, TruthValuesAreZeroAndOne) {
  const std::vector<std::uint8_t> samples = {0, 1, 1, 0, 0, 0, 1, 1};
  Write(Enumeration(H5T_NATIVE_INT8, {"FALSE", "TRUE"}), samples.data());
  EXPECT_EQ(Open()->info().file_type, "uint8");
  EXPECT_EQ(SamplesOf<std::uint8_t>(*Open()).value(), samples);
  EXPECT_FALSE(Open()->info().labels);
}

TEST_F(Hdf5TypesTest, EnumerationsAreLabels) {
  const std::vector<std::int16_t> samples = {0, 1, 2, 0, 1, 2, 2, 2};
  for (const bool compact : {false, true}) {
    const hid_t creation = H5Pcreate(H5P_DATASET_CREATE);
    if (compact) H5Pset_layout(creation, H5D_COMPACT);
    Write(Enumeration(H5T_STD_I16BE, {"background", "grey", "white"}), samples.data(), creation);
    H5Pclose(creation);
    const auto source = Open();
    EXPECT_TRUE(source->info().labels);
    EXPECT_EQ(source->info().file_type, "int16");
    EXPECT_EQ(source->info().levels[0].description.mapping, (ValueMapping{1, -32768}));
  }
}

TEST_F(Hdf5TypesTest, BitFieldsAreUnsigned) {
  const std::vector<std::uint8_t> samples = {0, 1, 255, 128, 0, 0, 1, 1};
  Write(H5Tcopy(H5T_STD_B8LE), samples.data());
  EXPECT_EQ(SamplesOf<std::uint8_t>(*Open()).value(), samples);
}

TEST_F(Hdf5TypesTest, HalfFloatsOfBothByteOrders) {
  const hid_t half = H5Tcopy(H5T_IEEE_F32LE);
  H5Tset_fields(half, 15, 10, 5, 0, 10);
  H5Tset_precision(half, 16);
  H5Tset_size(half, 2);
  H5Tset_ebias(half, 15);
  std::vector<std::uint16_t> codes = {0x0000, 0x3c00, 0xc000, 0x7bff, 0x0001, 0x3555, 0xbc00, 0x4248};
  const std::vector<float> values = {0, 1, -2, 65504, 0x1p-24F, 0.333251953125F, -1, 3.140625F};
  Write(H5Tcopy(half), codes.data());
  EXPECT_EQ(Open()->info().file_type, "float16");
  EXPECT_EQ(SamplesOf<float>(*Open()).value(), values);
  for (std::uint16_t& code : codes) code = std::uint16_t(code << 8 | code >> 8);
  H5Tset_order(half, H5T_ORDER_BE);
  Write(half, codes.data());
  EXPECT_EQ(SamplesOf<float>(*Open()).value(), values);
}

TEST_F(Hdf5TypesTest, WhatIsNotSupportedIsNamed) {
  const std::vector<float> samples(16);
  const auto compound = [](const char* first, const char* second) {
    const hid_t type = H5Tcreate(H5T_COMPOUND, 8);
    H5Tinsert(type, first, 0, H5T_NATIVE_FLOAT);
    H5Tinsert(type, second, 4, H5T_NATIVE_FLOAT);
    return type;
  };
  Write(compound("r", "i"), samples.data());
  ExpectRefused("dataset '/data' holds complex numbers (members r, i) of 64 bits; supported: integers");
  Write(compound("red", "green"), samples.data());
  ExpectRefused("dataset '/data' holds compounds (members red, green) of 64 bits");
  {
    const Hdf5Writer writer(path_);
    const hid_t space = H5Screate(H5S_SCALAR);
    H5Dclose(H5Dcreate2(writer.file(), "/one", H5T_NATIVE_INT, space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT));
    H5Sclose(space);
  }
  ExpectRefused("has no dataset of two axes or more");
  ExpectRefused("dataset '/one' has no axes: it is one value, or none", {.dataset = "one"});
  const std::vector<std::uint16_t> picture(6);
  Hdf5Writer(path_).Write("/picture", {.size = {2, 3}}, picture.data());
  // A slice.
  EXPECT_EQ(Open()->info().levels[0].description.geometry.size, (Index3{3, 2, 1}));
}

// The version of the message that says how a dataset is stored is raised, as HDF5 2.0 does.
TEST_F(Hdf5TypesTest, ADatasetOfALaterVersionIsNotCalledMissing) {
  const std::vector<std::uint16_t> samples(60);
  Hdf5Writer(path_).Write("/data", {.size = {3, 4, 5}, .chunk = {2, 2, 2}}, samples.data());
  std::string file = ReadTextFile(path_, 1 << 20).value();
  const std::string message("\x03\x02\x04", 3);  // version 3, chunks, of three axes and the bytes of an element
  const std::size_t at = file.find(message);
  ASSERT_NE(at, std::string::npos);
  ASSERT_EQ(file.find(message, at + 1), std::string::npos);
  file[at] = 5;
  ASSERT_TRUE(WriteTextFile(path_, file).ok());
  ExpectRefused("dataset '/data' is stored in a way that came after HDF5 1.");
  ExpectRefused("dataset '/data' is stored in a way that came after HDF5 1.", {.dataset = "/data"});
}

// libhdf5 1.10 would copy all of the heap's object to where the attribute's length has room.
TEST_F(Hdf5TypesTest, TheHeapOfATextMayBeLongerThanTheText) {
  const std::vector<std::uint16_t> samples(24);
  constexpr std::uint32_t kLength = 60'000;
  {
    Hdf5Writer writer(path_);
    writer.Write("/data", {.size = {2, 3, 4}}, samples.data());
    writer.Text("/data", "axistags", std::string(kLength, '{'));
  }
  std::string file = ReadTextFile(path_, 1 << 20).value();
  const std::size_t heap = file.find("GCOL");
  ASSERT_NE(heap, std::string::npos);
  const auto bytes_of = [](auto number) { return std::string(reinterpret_cast<const char*>(&number), sizeof number); };
  const std::size_t place = file.find(bytes_of(kLength) + bytes_of(std::uint64_t{heap}) + bytes_of(std::uint32_t{1}));
  ASSERT_NE(place, std::string::npos);
  for (const std::uint32_t length : {std::uint32_t{5}, kLength + 5, ~std::uint32_t{0}}) {
    ASSERT_TRUE(WriteTextFile(path_, file.replace(place, sizeof length, bytes_of(length))).ok());
    const auto text = (*Hdf5File::Open(path_))->Text("/data", "axistags");
    EXPECT_EQ(text.value_or(""), length == 5 ? "{{{{{" : "") << length;
  }
  // The heap states more bytes than it has.
  file.replace(place, sizeof kLength, bytes_of(kLength));
  ASSERT_TRUE(WriteTextFile(path_, file.replace(heap + 24, 8, bytes_of(std::uint64_t{1} << 40))).ok());
  EXPECT_FALSE((*Hdf5File::Open(path_))->Text("/data", "axistags"));
}

// A chunk that is packed already. The library asks for code of the filter, which it does not call.
TEST_F(Hdf5TypesTest, FiltersOfLibrariesThatAreNotThere) {
  std::string bytes;
  for (int i = 0; i < 24; ++i) bytes += std::string{char(i * 3), char(i / 7)};
  struct Case {
    H5Z_filter_t filter;
    std::vector<unsigned> values;
    std::string packed;
  };
  const Case cases[] = {{32004, {}, PackBlocks("lz4 block", bytes, 20, 0)},
                        {32008, {0, 3, 2, 8, 2}, PackBlocks("lz4 block", bytes, 16, 2)},
                        {32008, {0, 4, 2, 16, 3}, PackBlocks("zstd", bytes, 32, 2)},
                        {32008, {0, 3, 2, 16, 0}, BitshuffledBytes(bytes, 2, 16)},
                        {32008, {0, 3, 2}, BitshuffledBytes(bytes, 2, 4096)},
                        {307, {9}, PackBytes("bzip2", bytes)},
                        {32023, {3}, bytes}};
  for (const Case& each : cases) {
    SCOPED_TRACE(each.filter);
    const H5Z_class2_t nothing = {
        H5Z_CLASS_T_VERS,
        each.filter,
        1,
        1,
        "test",
        nullptr,
        nullptr,
        [](unsigned, std::size_t, const unsigned*, std::size_t bytes_in, std::size_t*, void**) { return bytes_in; }};
    ASSERT_GE(H5Zregister(&nothing), 0);
    {
      const Hdf5Writer writer(path_);
      const hsize_t size[3] = {2, 3, 4}, first[3] = {0, 0, 0};
      const hid_t creation = H5Pcreate(H5P_DATASET_CREATE), space = H5Screate_simple(3, size, nullptr);
      H5Pset_chunk(creation, 3, size);
      ASSERT_GE(H5Pset_filter(creation, each.filter, 0, each.values.size(), each.values.data()), 0);
      const hid_t dataset = H5Dcreate2(writer.file(), "/data", H5T_STD_U16LE, space, H5P_DEFAULT, creation, H5P_DEFAULT);
      ASSERT_GE(H5Dwrite_chunk(dataset, H5P_DEFAULT, 0, first, each.packed.size(), each.packed.data()), 0);
      H5Dclose(dataset);
      H5Pclose(creation);
      H5Sclose(space);
    }
    const auto samples = SamplesOf<std::uint16_t>(*Open());
    ASSERT_TRUE(samples.ok()) << samples.status().message();
    EXPECT_EQ(std::string(reinterpret_cast<const char*>(samples->data()), 2 * samples->size()), bytes);
  }
}

}  // namespace
}  // namespace slabstream
