#include "tests/data/sources/memory_source.h"

#include <cstring>
#include <utility>

#include "common/base/check.h"

namespace slabstream {
namespace {

constexpr std::int32_t kBlock = 64;  // voxels: every box costs the same, so some size that suits whoever cuts boxes

// Integers that the reader has shifted into the unsigned type become what they were.
ExactType ShiftedBack(const ExactType& best, const std::string& file_type) {
  const auto& [type, mapping] = best;
  if (type == SampleType::kUint8 && file_type == ToString(SampleType::kInt8))
    return {SampleType::kInt8, {mapping.scale, mapping.FromStored(128)}};
  if (type == SampleType::kUint16 && file_type == ToString(SampleType::kInt16))
    return {SampleType::kInt16, {mapping.scale, mapping.FromStored(32768)}};
  return best;
}

class MemorySource : public VolumeSource {
 public:
  MemorySource(std::shared_ptr<const Volume> volume, SourceInfo info, std::shared_ptr<const ExactSamples> exact)
      : volume_(std::move(volume)), exact_(std::move(exact)), info_(std::move(info)) {
    info_.levels = {{volume_->description, Min(volume_->description.geometry.size, Uniform(kBlock))}};
    info_.exact = ShiftedBack(BestType(*volume_, exact_.get()), info_.file_type);
  }

  const SourceInfo& info() const override { return info_; }

  void Read(int level, const Box& box, const BoxRoom& out, std::stop_token stop, ReadDone done) override {
    CHECK(level == 0 && volume_->block.box.Contains(box));
    if (stop.stop_requested()) return done(Status::Cancelled("reading was stopped"));
    const bool kept = !out.exact || exact_ == nullptr;
    const std::byte* const samples = kept ? volume_->block.bytes.data() : exact_->bytes.data();
    const std::size_t sample = kept ? BytesPerSample(volume_->block.type) : BytesPerSample(info_.exact.type);
    const bool shifted_back = out.exact && (info_.exact.type == SampleType::kInt8 || info_.exact.type == SampleType::kInt16);
    const std::size_t row = std::size_t(box.size().x) * sample;
    for (Index3 v = box.begin; v.z < box.end.z; ++v.z) {
      for (v.y = box.begin.y; v.y < box.end.y; ++v.y) {
        std::byte* const to = out.first + ((v.z - box.begin.z) * out.slice + (v.y - box.begin.y) * out.row) * std::int64_t(sample);
        std::memcpy(to, samples + std::size_t(volume_->block.Offset(v)) * sample, row);
        for (std::size_t i = sample - 1; shifted_back && i < row; i += sample) to[i] ^= std::byte{0x80};  // the highest bit
      }
    }
    done(Status::Ok());
  }

  Counts counts() const override { return {}; }

 private:
  const std::shared_ptr<const Volume> volume_;
  const std::shared_ptr<const ExactSamples> exact_;  // null: there are none
  SourceInfo info_;
};

}  // namespace

std::shared_ptr<VolumeSource> MakeMemorySource(std::shared_ptr<const Volume> volume, SourceInfo info,
                                               std::shared_ptr<const ExactSamples> exact) {
  return std::make_shared<MemorySource>(std::move(volume), std::move(info), std::move(exact));
}

}  // namespace slabstream
