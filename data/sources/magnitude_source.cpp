#include "data/sources/magnitude_source.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/memory/pooled_vector.h"
#include "data/sources/box_reading.h"

namespace slabstream {
namespace {

using Components = std::vector<std::shared_ptr<VolumeSource>>;

SourceInfo Described(const SourceInfo& of) {
  SourceInfo info = of;
  for (SourceLevel& level : info.levels) {
    level.description.type = ScalarType::kFloat32;
    level.description.mapping = {};
  }
  info.exact = {SampleType::kFloat32, {}};
  info.channels = {};
  info.channel = 0;
  info.components = 1;
  info.notes.emplace_back("values are the magnitudes of vectors");
  return info;
}

class MagnitudeSource final : public VolumeSource {
 public:
  explicit MagnitudeSource(Components components) : components_(std::move(components)), info_(Described(components_.front()->info())) {}

  const SourceInfo& info() const override { return info_; }

  std::shared_ptr<VolumeSource> At(int time, int channel) override {
    if (channel != 0) return nullptr;
    Components at;
    for (const auto& component : components_) {
      if (at.emplace_back(component->At(time, component->info().channel)) == nullptr) return nullptr;
    }
    return MagnitudeOf(std::move(at));
  }

  Counts counts() const override {
    Counts all;
    for (const auto& component : components_) all += component->counts();
    return all;
  }

  using VolumeSource::Read;
  void Read(int level, const Box& box, const BoxRoom& out, std::stop_token stop, ReadDone done) override {
    const auto samples = std::make_shared<std::vector<UnwrittenVector<std::byte>>>();
    const auto combine = [this, samples, level, box, out, done = std::move(done)](Status read) {
      std::vector<Component> of;
      for (std::size_t i = 0; i < samples->size(); ++i) of.push_back({(*samples)[i].data(), DescriptionOf(i, level)});
      if (read.ok()) Combine(of, box.size(), out);
      done(std::move(read));
    };
    for (std::size_t i = 0; i < components_.size(); ++i) {
      samples->emplace_back(std::size_t(box.voxel_count()) * BytesPerSample(DescriptionOf(i, level).type));
    }
    const auto reading = std::make_shared<BoxReading>(box, out, std::move(stop), combine);
    for (std::size_t i = 0; i < components_.size(); ++i) {
      reading->BeginPart();
      components_[i]->Read(level, box, BoxRoom::Dense(box, (*samples)[i].data()), reading->stop(), [reading](Status read) {
        if (!read.ok()) reading->Fail(std::move(read));
        reading->EndPart();
      });
    }
    reading->EndPart();
  }

 protected:
  // What is read in one order or as a whole is so for each component.
  Result<LevelInMemory> DoReadLevel(int level, ReadProgress* progress, const LevelWanted& wanted) override {
    if (info_.in_parts()) return VolumeSource::DoReadLevel(level, progress, wanted);
    std::vector<LevelInMemory> read;
    std::vector<Component> of;
    for (const auto& component : components_) {
      Result<LevelInMemory> its = component->ReadLevel(level, progress);
      if (!its.ok()) return its.status();
      read.push_back(*std::move(its));
      of.push_back({read.back().volume->block.bytes.data(), read.back().volume->description});
    }
    auto volume = std::make_shared<Volume>();
    volume->description = info_.levels[std::size_t(level)].description;
    const Box box = volume->description.geometry.bounds();
    volume->block = MakeVoxelBlock(box, ScalarType::kFloat32);
    Combine(of, box.size(), BoxRoom::Dense(box, volume->block.bytes.data()));
    return LevelInMemory{.volume = std::move(volume)};
  }

 private:
  struct Component {
    const std::byte* samples;  // of the box, without gaps
    const VolumeDescription& description;
  };

  const VolumeDescription& DescriptionOf(std::size_t component, int level) const {
    return components_[component]->info().levels[std::size_t(level)].description;
  }

  static void Combine(const std::vector<Component>& components, const Index3& size, const BoxRoom& out) {
    std::vector<double> squares(std::size_t(size.x));
    for (std::int64_t row = 0; row < std::int64_t{size.y} * size.z; ++row) {
      std::ranges::fill(squares, 0.0);
      for (const auto& [samples, description] : components) {
        VisitScalarType(description.type, [&]<class Sample>(const Sample*) {
          const Sample* const from = reinterpret_cast<const Sample*>(samples) + row * size.x;
          for (std::size_t x = 0; x < squares.size(); ++x) {
            const double value = description.mapping.FromStored(double(from[x]));
            squares[x] += value * value;
          }
        });
      }
      float* const to = reinterpret_cast<float*>(out.first) + (row / size.y) * out.slice + (row % size.y) * out.row;
      for (std::size_t x = 0; x < squares.size(); ++x) to[x] = float(std::sqrt(squares[x]));
    }
  }

  const Components components_;
  const SourceInfo info_;
};

}  // namespace

std::shared_ptr<VolumeSource> MagnitudeOf(Components components) { return std::make_shared<MagnitudeSource>(std::move(components)); }

}  // namespace slabstream
