// Sources as tests open and read them.
#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <future>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "common/base/check.h"
#include "data/sources/read_context.h"
#include "data/sources/volume_source.h"

namespace slabstream {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;

inline SourceContext TestReadContext() { return std::make_shared<ReadContext>(ReadContext::Limits{.decode_threads = 2}); }

inline std::shared_ptr<VolumeSource> Opened(const Result<std::shared_ptr<VolumeSource>>& source) {
  CHECK(source.ok()) << source.status().message();
  return *source;
}

// Refused in one line that says why.
inline void ExpectRefusal(const Result<std::shared_ptr<VolumeSource>>& source, const std::string& why) {
  ASSERT_FALSE(source.ok()) << why;
  EXPECT_THAT(source.status().message(), HasSubstr(why));
  EXPECT_EQ(source.status().message().find('\n'), std::string::npos);
}

// Filled with a value before, so that samples that were not read are found.
inline AlignedVector<std::byte> ReadBox(VolumeSource& source, int level, const Box& box) {
  const ScalarType type = source.info().levels[std::size_t(level)].description.type;
  AlignedVector<std::byte> bytes(std::size_t(box.voxel_count()) * BytesPerSample(type), std::byte{0xa5});
  const Status status = source.ReadNow(level, box, bytes);
  EXPECT_TRUE(status.ok()) << status.message();
  return bytes;
}

// The same, read to where `gap` samples lie between rows, and a row between slices: nothing is written there.
inline AlignedVector<std::byte> ReadBoxApart(VolumeSource& source, int level, const Box& box, std::int64_t gap) {
  const std::size_t sample = BytesPerSample(source.info().levels[std::size_t(level)].description.type);
  const Index3 size = box.size();
  const std::int64_t row = size.x + gap, slice = row * (size.y + 1);
  std::vector<std::byte> room(std::size_t(slice * size.z) * sample, std::byte{0x5a});
  std::promise<Status> end;
  source.Read(level, box, BoxRoom{room.data(), row, slice}, {}, [&end](Status status) { end.set_value(std::move(status)); });
  const Status status = end.get_future().get();
  EXPECT_TRUE(status.ok()) << status.message();
  AlignedVector<std::byte> bytes;
  for (std::int64_t i = 0; i < slice * size.z; ++i) {
    const auto first = room.begin() + i * std::ptrdiff_t(sample);
    if (i % row < size.x && i % slice / row < size.y) {
      bytes.insert(bytes.end(), first, first + std::ptrdiff_t(sample));
    } else {
      EXPECT_EQ(*first, std::byte{0x5a}) << "between the rows";
    }
  }
  return bytes;
}

// Whether a source of float32 has value(place) at all its voxels, whose places are held between `low` and `high`.
template <class F>
void ExpectValuesOfPlaces(VolumeSource& source, const Vec3& low, const Vec3& high, F value) {
  const VolumeDescription& description = source.info().finest();
  const Index3& size = description.geometry.size;
  ASSERT_EQ(description.type, ScalarType::kFloat32);
  const AlignedVector<std::byte> bytes = ReadBox(source, 0, description.geometry.bounds());
  for (std::size_t i = 0; i < CountIn(size); ++i) {
    const auto n = std::int32_t(i);
    Vec3 place = description.geometry.ToWorld(ToVec3(Index3{n % size.x, n / size.x % size.y, n / size.x / size.y}));
    for (const Axis axis : kAxes) place[axis] = std::clamp(place[axis], low[axis], high[axis]);
    const double wanted = value(place);
    const double read = description.mapping.FromStored(double(reinterpret_cast<const float*>(bytes.data())[i]));
    ASSERT_NEAR(read, wanted, 1e-5 * (1 + std::abs(wanted))) << place.x << ' ' << place.y << ' ' << place.z;
  }
}

// The samples of a whole level.
template <class T>
Result<std::vector<T>> SamplesOf(VolumeSource& source, int level = 0) {
  const VolumeDescription& description = source.info().levels[std::size_t(level)].description;
  std::vector<T> samples(std::size_t(description.voxel_bytes()) / sizeof(T));
  const Status status = source.ReadNow(level, description.geometry.bounds(), std::as_writable_bytes(std::span(samples)));
  if (!status.ok()) return status;
  return samples;
}

}  // namespace slabstream
