// Whole numbers of 32 and 64 bits and float64 stay what they are from file to file, whatever the volume in memory rounds.
#include "data/volume_io/exact_samples.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cstring>
#include <limits>
#include <string>
#include <vector>

#include "data/open/read_volume.h"
#include "data/volume_io/formats.h"
#include "data/volume_io/volume_writer.h"
#include "tests/data/volume_io/volume_files.h"
#include "tests/support/random.h"
#include "tests/support/text_of.h"

namespace slabstream {
namespace {

using testing::HasSubstr;

constexpr SampleType kWide[] = {SampleType::kInt32, SampleType::kUint32, SampleType::kInt64, SampleType::kUint64, SampleType::kFloat64};

template <class T>
std::string BytesOf(const std::vector<T>& values) {
  return {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T)};
}

// Samples of all magnitudes that the type has, little endian.
std::string RandomSamples(SampleType type, std::size_t count, Random& random) {
  std::string bytes;
  for (std::size_t i = 0; i < count; ++i) {
    const std::int64_t number = random.Integer(std::numeric_limits<std::int64_t>::min(), std::numeric_limits<std::int64_t>::max());
    const std::int64_t smaller = number >> random.Integer(0, 63);
    bytes += VisitSampleType(type, [&]<class T>(const T*) {
      if constexpr (std::is_integral_v<T>) return BytesOf(std::vector<T>{T(smaller)});
      return BytesOf(std::vector<T>{T(double(smaller) / 3)});
    });
  }
  return bytes;
}

std::vector<std::string> WrittenFiles() {
  std::vector<std::string> files;
  for (const VolumeFormat& format : FileFormats()) {
    for (const std::string_view ending : format.written_endings) files.push_back("out" + std::string(ending));
  }
  return files;
}

TEST(ExactSamples, EveryReaderHasThemAndEveryWriterWritesThem) {
  Random random(2);
  SCOPED_TRACE(random.trace());
  const TemporaryDirectory directory;
  for (const SampleType type : kWide) {
    const FileSpec spec{.size = {5, 4, 3}, .type = type};
    const std::string samples = RandomSamples(type, CountIn(spec.size), random);
    WriteFile(directory / "in.nrrd", NrrdHeader(spec, "raw") + samples);
    const LoadedVolume first = ReadVolume(directory / "in.nrrd", {}, true).value();
    for (const std::string& file : WrittenFiles()) {
      SCOPED_TRACE(std::string(ToString(type)) + " " + file);
      ASSERT_TRUE(WriteVolume(*first.volume, directory / file, {.type = {}, .progress = {}, .exact = first.exact.get()}).ok());
      const Result<LoadedVolume> read = ReadVolume(directory / file, {}, true);
      ASSERT_TRUE(read.ok()) << read.status().message();
      EXPECT_EQ(read->info.file_type, ToString(type));
      ASSERT_NE(read->exact, nullptr);
      EXPECT_TRUE(!read->rounding.empty());
      EXPECT_EQ(read->exact->of.type, type);
      EXPECT_EQ(TextOf(read->exact->bytes), samples);
    }
  }
}

TEST(ExactSamples, AreTurnedAsTheVolumeIs) {
  const TemporaryDirectory directory;
  const FileSpec spec{.size = {2, 2, 1}, .type = SampleType::kUint64};
  const std::uint64_t id = 12857642016;
  std::string header = NrrdHeader(spec, "raw");
  // x of the file runs to the left.
  header.insert(header.find("endian"), "space: RAS\nspace directions: (-1,0,0) (0,1,0) (0,0,1)\n");
  const std::size_t spacings = header.find("spacings");
  if (spacings != std::string::npos) header.erase(spacings, header.find('\n', spacings) + 1 - spacings);
  WriteFile(directory / "v.nrrd", header + BytesOf(std::vector<std::uint64_t>{id, id + 1, id + 2, id + 3}));
  const Result<LoadedVolume> read = ReadVolume(directory / "v.nrrd", {}, true);
  ASSERT_TRUE(read.ok()) << read.status().message();
  EXPECT_EQ(TextOf(read->exact->bytes), BytesOf(std::vector<std::uint64_t>{id + 1, id, id + 3, id + 2}));
}

TEST(ExactSamples, OfOtherTypesAreThoseOfTheVolume) {
  const TemporaryDirectory directory;
  for (const SampleType type : {SampleType::kInt8, SampleType::kUint8, SampleType::kInt16, SampleType::kUint16, SampleType::kFloat32}) {
    const FileSpec spec{.size = {2, 1, 1}, .type = type};
    WriteFile(directory / "v.nrrd", NrrdHeader(spec, "raw") + EncodeSamples(type, {1, 2}));
    EXPECT_EQ(ReadVolume(directory / "v.nrrd", {}, true).value().exact, nullptr);
  }
}

TEST(ExactSamples, AreRoundedOnlyWhereTheVolumeDoesNotHoldThem) {
  const auto rounded = [](const std::vector<std::uint64_t>& values) {
    AlignedVector<std::byte> bytes(values.size() * 8);
    std::memcpy(bytes.data(), values.data(), bytes.size());
    const KeptSamples kept = KeepBeside(SampleType::kUint64, bytes);
    EXPECT_EQ(std::memcmp(bytes.data(), values.data(), bytes.size()), 0);
    return !kept.exact;
  };
  EXPECT_FALSE(rounded({0, 1 << 24}));
  EXPECT_TRUE(rounded({0, (1 << 24) + 1}));
  EXPECT_FALSE(rounded({1 << 30, (1 << 30) + 65535})) << "uint16 with an offset";
  EXPECT_TRUE(rounded({(std::uint64_t{1} << 53) + 1, (std::uint64_t{1} << 53) + 1})) << "the offset itself is rounded";
  EXPECT_TRUE(rounded({std::uint64_t{1} << 60, (std::uint64_t{1} << 60) + 1})) << "an offset that double does not add to";
}

// Pictures do not show what lies beyond float32: somebody must say so, and what to do.
TEST(ExactSamples, ValuesBeyondFloat32AreCountedInWords) {
  const auto text = [](const std::vector<double>& values) {
    FloatReach reach;
    reach.Add(values);
    return RoundingText(SampleType::kFloat64, nullptr, reach);
  };
  EXPECT_EQ(text({0, 3e40, -1e39, 1}),
            "2 of 4 values are beyond those of float32 (3.4e38) and are not shown: divide the values, by 1e40 for example");
  EXPECT_EQ(text({0, 2e-45}), "the largest value, 2e-45, is too small for float32 (1.2e-38): multiply the values, by 1e45 for example");
  for (const std::vector<double>& fitting : {std::vector<double>{0.1, 3e38}, {std::numeric_limits<double>::infinity(), 0.1}, {1e-300, 1}}) {
    EXPECT_THAT(text(fitting), testing::HasSubstr("rounded to float32, and none beyond 3.4e38"));
  }
}

TEST(ExactSamples, ADataValueIsExactToItsLastBit) {
  const auto value_of = []<class T>(SampleType type, T sample, const ValueMapping& mapping = {}) {
    return ExactValueOf({type, mapping}, reinterpret_cast<const std::byte*>(&sample));
  };
  EXPECT_EQ(value_of(SampleType::kUint64, std::numeric_limits<std::uint64_t>::max()), (ExactValue{0x1p64, -1}));
  EXPECT_EQ(value_of(SampleType::kInt64, std::numeric_limits<std::int64_t>::max()), (ExactValue{0x1p63, -1}));
  EXPECT_EQ(value_of(SampleType::kInt64, std::numeric_limits<std::int64_t>::min()), (ExactValue{-0x1p63, 0}));
  EXPECT_EQ(value_of(SampleType::kUint64, (std::uint64_t{1} << 53) + 1), (ExactValue{0x1p53, 1}));
  EXPECT_EQ(value_of(SampleType::kUint64, std::uint64_t{12857642016}), (ExactValue{12857642016, 0}));
  EXPECT_EQ(value_of(SampleType::kFloat64, 0.1), (ExactValue{0.1, 0}));
  EXPECT_EQ(value_of(SampleType::kInt32, std::int32_t{-5}, {0.5, 1}), (ExactValue{-1.5, 0}));
}

TEST(ExactSamples, ATypeThatDoesNotHoldALabelNamesItToTheLastDigit) {
  const TemporaryDirectory directory;
  const FileSpec spec{.size = {2, 1, 1}, .type = SampleType::kUint64};
  WriteFile(directory / "v.nrrd", NrrdHeader(spec, "raw") + BytesOf(std::vector<std::uint64_t>{1, std::uint64_t{1} << 63 | 1}));
  const LoadedVolume read = ReadVolume(directory / "v.nrrd", {}, true).value();
  const auto write = [&](SampleType type) {
    return WriteVolume(*read.volume, directory / "w.nrrd", {.type = type, .progress = {}, .exact = read.exact.get()});
  };
  EXPECT_THAT(write(SampleType::kInt64).message(), HasSubstr("the value 9223372036854775809 of voxel 1,0,0 does not fit int64"));
  EXPECT_TRUE(write(SampleType::kUint64).ok());
}

}  // namespace
}  // namespace slabstream
