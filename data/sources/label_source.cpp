#include "data/sources/label_source.h"

#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <type_traits>
#include <utility>

namespace slabstream {
namespace {

struct LabelType {
  ScalarType type;
  SampleType exact;
};
// The narrowest that holds all labels that samples of this type can be.
LabelType TypeFor(const ExactType& of) {
  const LabelType widest = {ScalarType::kUint64, SampleType::kUint64};
  if (of.mapping != ValueMapping{}) return widest;
  switch (of.type) {
    case SampleType::kInt8:
    case SampleType::kUint8: return {ScalarType::kUint8, SampleType::kUint8};
    case SampleType::kInt16:
    case SampleType::kUint16:
    case SampleType::kFloat16: return {ScalarType::kUint16, SampleType::kUint16};
    case SampleType::kInt32:
    case SampleType::kUint32: return {ScalarType::kUint32, SampleType::kUint32};
    default: return widest;
  }
}

template <class Value>
Status NoLabel(Value value) {
  return Status::InvalidArgument(fmt::format("the value {} is no label, which is a whole number of at least 0", value));
}

// `count` samples as labels.
template <class From, class To>
Status Convert(const From* from, std::size_t count, const ValueMapping& mapping, To* to) {
  const bool plain = mapping == ValueMapping{};
  for (std::size_t i = 0; i < count; ++i) {
    if constexpr (std::is_integral_v<From>) {
      if (plain) {
        if (!std::in_range<To>(from[i])) return NoLabel(from[i]);
        to[i] = To(from[i]);
        continue;
      }
    }
    const double value = mapping.FromStored(double(from[i]));
    constexpr double kEnd = 0x1p64;
    if (!(value >= 0 && value < kEnd && value == std::floor(value) && value <= double(std::numeric_limits<To>::max())))
      return NoLabel(value);
    to[i] = To(value);
  }
  return Status::Ok();
}

Status Convert(const ExactType& of, const std::byte* from, std::size_t count, ScalarType type, std::byte* to) {
  return VisitSampleType(of.type, [&]<class From>(const From*) {
    return VisitLabelType(type, [&]<class To>(const To*) {
      return Convert(reinterpret_cast<const From*>(from), count, of.mapping, reinterpret_cast<To*>(to));
    });
  });
}

class LabelSource final : public DescribedSource {
 public:
  LabelSource(std::shared_ptr<VolumeSource> source, const LabelType& type) : DescribedSource(source, Described(source->info(), type)) {}

  using VolumeSource::Read;
  void Read(int level, const Box& box, const BoxRoom& out, std::stop_token stop, ReadDone done) override {
    const ExactType& stored = source_->info().exact;
    BoxRoom room = out;
    room.exact = true;
    if (stored.type == info_.exact.type && stored.mapping == ValueMapping{}) {
      return source_->Read(level, box, room, std::move(stop), std::move(done));
    }
    auto samples = std::make_shared<AlignedVector<std::byte>>(std::size_t(box.voxel_count()) * BytesPerSample(stored.type));
    const ScalarType type = info_.finest().type;
    const auto convert = [samples, stored, box, out, type, done = std::move(done)](const Status& read) {
      if (!read.ok()) return done(read);
      const Index3 size = box.size();
      for (std::int32_t row = 0; row < size.y * size.z; ++row) {
        const std::byte* const from = samples->data() + std::size_t(row) * std::size_t(size.x) * BytesPerSample(stored.type);
        const std::int64_t at = (row / size.y) * out.slice + (row % size.y) * out.row;
        const Status converted = Convert(stored, from, std::size_t(size.x), type, out.first + at * std::int64_t(BytesPerSample(type)));
        if (!converted.ok()) return done(converted);
      }
      done(Status::Ok());
    };
    source_->Read(level, box, BoxRoom::Dense(box, samples->data(), true), std::move(stop), convert);
  }

 protected:
  Result<LevelInMemory> DoReadLevel(int level, ReadProgress* progress, const LevelWanted& /*wanted*/) override {
    const Result<LevelInMemory> read = source_->ReadLevel(level, progress, {.all_exact = true});
    if (!read.ok()) return read.status();
    auto labels = std::make_shared<Volume>();
    labels->description = info_.levels[std::size_t(level)].description;
    labels->block = MakeVoxelBlock(read->volume->block.box, labels->description.type);
    const Status converted =
        VisitBestSamples(*read->volume, read->exact.get(), [&]<class From>(const From* from, const ValueMapping& mapping) {
          return VisitLabelType(labels->block.type, [&]<class To>(const To*) {
            return Convert(from, std::size_t(labels->block.box.voxel_count()), mapping, labels->block.samples<To>());
          });
        });
    if (!converted.ok()) return converted;
    return LevelInMemory{.volume = std::move(labels)};
  }

 private:
  std::shared_ptr<VolumeSource> Around(std::shared_ptr<VolumeSource> source, SourceInfo /*info*/) const override {
    return AsLabels(std::move(source));
  }

  static SourceInfo Described(SourceInfo info, const LabelType& type) {
    for (SourceLevel& level : info.levels) {
      level.description.type = type.type;
      level.description.mapping = {};
    }
    info.exact = {type.exact, {}};
    info.labels = true;
    return info;
  }
};

}  // namespace

std::shared_ptr<VolumeSource> AsLabels(std::shared_ptr<VolumeSource> source) {
  const LabelType type = TypeFor(source->info().exact);
  return std::make_shared<LabelSource>(std::move(source), type);
}

}  // namespace slabstream
