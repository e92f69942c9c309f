// Files as sources, compared box by box with the volume that is decoded as a whole.
#pragma once

#include <algorithm>
#include <limits>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "data/positional/file_source.h"
#include "tests/data/positional/read_decoded.h"
#include "tests/data/sources/opened_source.h"
#include "tests/support/random.h"

namespace slabstream {

inline Result<std::shared_ptr<VolumeSource>> Open(const std::string& path, const ReadOptions& options = {}) {
  return OpenFile(*FindFormat(path, options), path, options, TestReadContext());
}

inline std::shared_ptr<VolumeSource> Opened(const std::string& path, const ReadOptions& options = {}) {
  return Opened(Open(path, options));
}

// Kept as their type alone says.
inline bool IsExact(const std::string& file_type) {
  return file_type == "uint8" || file_type == "int8" || file_type == "uint16" || file_type == "int16" || file_type == "float32" ||
         file_type == "float16";
}

// Values of exact samples are those of the whole reader's.
inline void ExpectExact(VolumeSource& source, const Box& box, const LoadedVolume& whole) {
  const ExactType of = source.info().exact, wanted = BestType(*whole.volume, whole.exact.get());
  const std::size_t bytes = BytesPerSample(of.type), wanted_bytes = BytesPerSample(wanted.type);
  std::vector<std::byte> read(std::size_t(box.voxel_count()) * bytes, std::byte{0xa5});
  ASSERT_TRUE(source.ReadNow(0, box, BoxRoom::Dense(box, read.data(), true)).ok());
  const std::byte* const samples = whole.exact != nullptr ? whole.exact->bytes.data() : whole.volume->block.bytes.data();
  for (std::size_t i = 0; i < std::size_t(box.voxel_count()); ++i) {
    const std::size_t place = NumberIn(whole.volume->block.box.size(), box.begin + PlaceIn(box.size(), i));
    ASSERT_EQ(ExactValueOf(of, read.data() + i * bytes), ExactValueOf(wanted, samples + place * wanted_bytes)) << i;
  }
}

inline void ExpectLikeWhole(const std::string& path, const ReadOptions& options, Random& random, int boxes = 12) {
  SCOPED_TRACE(path);
  const LoadedVolume whole = ReadDecoded(path, options).value();
  const std::shared_ptr<VolumeSource> source = Opened(path, options);
  const SourceInfo& info = source->info();
  ASSERT_EQ(info.levels.size(), 1U);
  const VolumeDescription &description = info.levels[0].description, &wanted = whole.info.finest();
  EXPECT_EQ(info.labels, whole.info.labels);
  const bool exact = IsExact(info.file_type);
  EXPECT_EQ(description.type, exact ? wanted.type : ScalarType::kFloat32);
  EXPECT_TRUE(!exact || description.mapping == wanted.mapping);
  ExpectReadsAs(whole, *source, random, boxes, [&](const Box& box, const auto& samples) {
    // Rows may be as far apart as in the file.
    const std::int32_t gap = random.Chance(0.5) ? wanted.geometry.size.x - box.size().x : random.Integer(0, 3);
    EXPECT_TRUE(ReadBoxApart(*source, 0, box, gap) == samples);
    ExpectExact(*source, box, whole);
  });
}

// Whole numbers that float32 holds and, but for 8 and 16 bits, that uint16 does not.
inline std::vector<double> RandomValues(Random& random, SampleType type, std::size_t count) {
  const auto [low, high] = VisitSampleType(type, []<class T>(const T*) {
    return std::pair(std::max(double(std::numeric_limits<T>::lowest()), -1e6), std::min(double(std::numeric_limits<T>::max()), 1e6));
  });
  std::vector<double> values(count);
  for (double& value : values) value = double(random.Integer(std::int64_t(low), std::int64_t(high)));
  return values;
}

}  // namespace slabstream
