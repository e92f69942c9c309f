#include "data/volume_io/file_samples.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <type_traits>
#include <vector>

namespace slabstream {
namespace {

// Whether a sample of type T holds the value; a float holds it rounded.
template <class T>
bool Holds(double value) {
  if constexpr (!std::is_integral_v<T>) {
    return !std::isfinite(value) || std::abs(value) <= double(std::numeric_limits<T>::max());
  } else {
    // The limits of 64 bits are not exact as double: the upper one is a power of two, which is the first value that does not fit.
    const double end = std::ldexp(1.0, std::numeric_limits<T>::digits);
    return std::trunc(value) == value && value >= double(std::numeric_limits<T>::lowest()) && value < end;
  }
}

struct DataRange {
  double low = std::numeric_limits<double>::infinity(), high = -std::numeric_limits<double>::infinity();
};

DataRange RangeOf(const Volume& volume) {
  return VisitScalarType(volume.description.type, [&]<class Stored>(const Stored*) {
    const std::span stored(volume.block.samples<Stored>(), std::size_t(volume.block.box.voxel_count()));
    const auto [least, greatest] = std::ranges::minmax(stored);
    const double a = volume.description.mapping.FromStored(double(least)), b = volume.description.mapping.FromStored(double(greatest));
    return DataRange{std::min(a, b), std::max(a, b)};
  });
}

SampleType UsualType(const Volume& volume) {
  const auto& [geometry, type, mapping] = volume.description;
  if (type == ScalarType::kFloat32) return SampleType::kFloat32;
  const bool byte = type == ScalarType::kUint8;
  if (mapping == ValueMapping{}) return byte ? SampleType::kUint8 : SampleType::kUint16;
  // Samples read from signed integers become signed again.
  if (mapping == ValueMapping{1, byte ? -128.0 : -32768.0}) return byte ? SampleType::kInt8 : SampleType::kInt16;
  constexpr double kExact = 0x1p53;
  const auto whole = [](double number) { return std::trunc(number) == number && std::abs(number) < kExact; };
  if (!whole(mapping.scale) || !whole(mapping.offset)) return SampleType::kFloat32;
  const DataRange range = RangeOf(volume);
  for (const SampleType candidate :
       {SampleType::kUint8, SampleType::kInt8, SampleType::kUint16, SampleType::kInt16, SampleType::kUint32, SampleType::kInt32}) {
    const bool fits = VisitSampleType(candidate, [&]<class T>(const T*) { return Holds<T>(range.low) && Holds<T>(range.high); });
    if (fits) return candidate;
  }
  return SampleType::kFloat32;
}

// The first voxel, by its number, whose data value the type does not hold.
std::optional<std::size_t> FirstMisfit(const Volume& volume, SampleType type) {
  return VisitSampleType(type, [&]<class T>(const T*) {
    return VisitScalarType(volume.description.type, [&]<class Stored>(const Stored*) -> std::optional<std::size_t> {
      const std::span stored(volume.block.samples<Stored>(), std::size_t(volume.block.box.voxel_count()));
      const auto misfit =
          std::ranges::find_if(stored, [&](Stored sample) { return !Holds<T>(volume.description.mapping.FromStored(double(sample))); });
      return misfit == stored.end() ? std::nullopt : std::optional(std::size_t(misfit - stored.begin()));
    });
  });
}

double DataValue(const Volume& volume, std::size_t number) {
  return VisitScalarType(volume.description.type, [&]<class Stored>(const Stored*) {
    return volume.description.mapping.FromStored(double(volume.block.samples<Stored>()[number]));
  });
}

}  // namespace

Result<FileSamples> FileSamples::Of(const Volume& volume, std::optional<SampleType> type, WriteProgress progress) {
  if (type == SampleType::kFloat16) return Status::InvalidArgument("float16 samples are read, but not written; float32 holds them");
  if (type) {
    if (const std::optional<std::size_t> misfit = FirstMisfit(volume, *type)) {
      const Index3 voxel = PlaceIn(volume.description.geometry.size, *misfit);
      return Status::InvalidArgument(fmt::format("the value {} of voxel {},{},{} does not fit {}, which holds {}",
                                                 DataValue(volume, *misfit), voxel.x, voxel.y, voxel.z, ToString(*type), ValuesOf(*type)));
    }
  }
  return FileSamples(volume, type.value_or(UsualType(volume)), std::move(progress));
}

void FileSamples::ForEachBlock(const std::function<void(std::span<const std::byte>)>& sink) const {
  const ValueMapping mapping = volume_->description.mapping;
  VisitSampleType(type_, [&]<class Value>(const Value*) {
    VisitScalarType(volume_->description.type, [&]<class Stored>(const Stored*) {
      const std::span stored(volume_->block.samples<Stored>(), std::size_t(volume_->block.box.voxel_count()));
      std::vector<Value> values(std::min(stored.size(), kBlockBytes / sizeof(Value)));
      for (std::size_t done = 0; done < stored.size();) {
        const std::span block = stored.subspan(done, std::min(values.size(), stored.size() - done));
        std::ranges::transform(block, values.begin(), [&](Stored sample) { return Value(mapping.FromStored(double(sample))); });
        sink(std::as_bytes(std::span(values).first(block.size())));
        done += block.size();
        if (progress_) progress_(std::int64_t(done * sizeof(Value)), bytes());
      }
    });
  });
}

}  // namespace slabstream
