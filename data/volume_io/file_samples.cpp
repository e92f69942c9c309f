#include "data/volume_io/file_samples.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <type_traits>
#include <vector>

namespace slabstream {
namespace {

// Whether a sample of type T holds the value; a float holds it rounded.
template <class T, class Value>
bool Holds(Value value) {
  if constexpr (!std::is_integral_v<T>) {
    return !std::isfinite(double(value)) || std::abs(double(value)) <= double(std::numeric_limits<T>::max());
  } else if constexpr (std::is_integral_v<Value>) {
    return std::in_range<T>(value);
  } else {
    // The limits of 64 bits are not exact as double: the upper one is a power of two, which is the first value that does not fit.
    const double end = std::ldexp(1.0, std::numeric_limits<T>::digits);
    return std::trunc(value) == value && value >= double(std::numeric_limits<T>::lowest()) && value < end;
  }
}

// Calls function(samples, value): `samples` are the best that the volume has (VisitBestSamples), and value(sample) is its data value, as
// double or, if the samples themselves are data values, as they are.
template <class Function>
decltype(auto) VisitValues(const Volume& volume, const ExactSamples* exact, Function&& function) {
  return VisitBestSamples(volume, exact, [&]<class T>(const T* first, const ValueMapping& mapping) {
    const std::span samples(first, std::size_t(volume.block.box.voxel_count()));
    if (mapping == ValueMapping{}) return function(samples, [](T sample) { return sample; });
    return function(samples, [&](T sample) { return mapping.FromStored(double(sample)); });
  });
}

struct DataRange {
  double low = std::numeric_limits<double>::infinity(), high = -std::numeric_limits<double>::infinity();
};

DataRange RangeOf(const Volume& volume, const ExactSamples* exact) {
  return VisitValues(volume, exact, [](const auto& samples, const auto& value) {
    const auto [least, greatest] = std::ranges::minmax(samples);
    const auto a = double(value(least)), b = double(value(greatest));
    return DataRange{std::min(a, b), std::max(a, b)};
  });
}

SampleType UsualType(const Volume& volume, const ExactSamples* exact) {
  const auto [stored, mapping] = BestType(volume, exact);
  if (mapping == ValueMapping{} || stored == SampleType::kFloat32 || stored == SampleType::kFloat64) return stored;
  // Samples read from signed integers become signed again.
  if (mapping == ValueMapping{1, -128} && stored == SampleType::kUint8) return SampleType::kInt8;
  if (mapping == ValueMapping{1, -32768} && stored == SampleType::kUint16) return SampleType::kInt16;
  const SampleType rounded = MayBeRounded(stored) ? SampleType::kFloat64 : SampleType::kFloat32;
  constexpr double kExact = 0x1p53;
  const auto whole = [](double number) { return std::trunc(number) == number && std::abs(number) < kExact; };
  if (!whole(mapping.scale) || !whole(mapping.offset)) return rounded;
  const DataRange range = RangeOf(volume, exact);
  for (const SampleType candidate :
       {SampleType::kUint8, SampleType::kInt8, SampleType::kUint16, SampleType::kInt16, SampleType::kUint32, SampleType::kInt32}) {
    const bool fits = VisitSampleType(candidate, [&]<class T>(const T*) { return Holds<T>(range.low) && Holds<T>(range.high); });
    if (fits) return candidate;
  }
  return rounded;
}

// The first voxel, by its number, whose data value the type does not hold.
std::optional<std::size_t> FirstMisfit(const Volume& volume, const ExactSamples* exact, SampleType type) {
  return VisitSampleType(type, [&]<class T>(const T*) {
    return VisitValues(volume, exact, [](const auto& samples, const auto& value) -> std::optional<std::size_t> {
      const auto misfit = std::ranges::find_if(samples, [&](auto sample) { return !Holds<T>(value(sample)); });
      return misfit == samples.end() ? std::nullopt : std::optional(std::size_t(misfit - samples.begin()));
    });
  });
}

std::string DataValue(const Volume& volume, const ExactSamples* exact, std::size_t number) {
  return VisitValues(volume, exact, [&](const auto& samples, const auto& value) {
    const auto misfit = value(samples[number]);
    if constexpr (std::is_integral_v<decltype(value(samples[number]))>) return std::to_string(misfit);
    return fmt::format("{}", double(misfit));
  });
}

}  // namespace

Result<FileSamples> FileSamples::Of(const Volume& volume, const ExactSamples* exact, std::optional<SampleType> type,
                                    WriteProgress progress) {
  if (volume.description.geometry.rectilinear()) {
    return Status::InvalidArgument("its grid is rectilinear, and files of voxels hold even grids alone; --resample even makes one");
  }
  if (type == SampleType::kFloat16) return Status::InvalidArgument("float16 samples are read, but not written; float32 holds them");
  if (type) {
    if (const std::optional<std::size_t> misfit = FirstMisfit(volume, exact, *type)) {
      const Index3 voxel = PlaceIn(volume.description.geometry.size, *misfit);
      return Status::InvalidArgument(fmt::format("the value {} of voxel {},{},{} does not fit {}, which holds {}",
                                                 DataValue(volume, exact, *misfit), voxel.x, voxel.y, voxel.z, ToString(*type),
                                                 ValuesOf(*type)));
    }
  }
  return FileSamples(volume, exact, type.value_or(UsualType(volume, exact)), std::move(progress));
}

void FileSamples::ForEachBlock(const std::function<void(std::span<const std::byte>)>& sink) const {
  VisitSampleType(type_, [&]<class Value>(const Value*) {
    VisitValues(*volume_, exact_, [&](const auto& stored, const auto& value) {
      std::vector<Value> values(std::min(stored.size(), kBlockBytes / sizeof(Value)));
      for (std::size_t done = 0; done < stored.size();) {
        const std::span block = stored.subspan(done, std::min(values.size(), stored.size() - done));
        std::ranges::transform(block, values.begin(), [&](auto sample) { return Value(value(sample)); });
        sink(std::as_bytes(std::span(values).first(block.size())));
        done += block.size();
        if (progress_) progress_(std::int64_t(done * sizeof(Value)), bytes());
      }
    });
  });
}

}  // namespace slabstream
