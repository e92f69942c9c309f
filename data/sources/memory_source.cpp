#include "data/sources/memory_source.h"

#include <cstring>
#include <utility>

#include "common/base/check.h"

namespace slabstream {
namespace {

constexpr std::int32_t kBlock = 64;  // voxels: every box costs the same, so some size that suits whoever cuts boxes

class MemorySource : public VolumeSource {
 public:
  MemorySource(std::shared_ptr<const Volume> volume, SourceInfo info) : volume_(std::move(volume)), info_(std::move(info)) {
    info_.levels = {{volume_->description, Min(volume_->description.geometry.size, Uniform(kBlock))}};
  }

  const SourceInfo& info() const override { return info_; }

  void Read(int level, const Box& box, const BoxRoom& out, std::stop_token stop, ReadDone done) override {
    CHECK(level == 0 && volume_->block.box.Contains(box));
    if (stop.stop_requested()) return done(Status::Cancelled("reading was stopped"));
    const std::size_t sample = BytesPerSample(volume_->block.type), row = std::size_t(box.size().x) * sample;
    for (Index3 v = box.begin; v.z < box.end.z; ++v.z) {
      for (v.y = box.begin.y; v.y < box.end.y; ++v.y) {
        const std::int64_t place = (v.z - box.begin.z) * out.slice + (v.y - box.begin.y) * out.row;
        std::memcpy(out.first + place * std::int64_t(sample), volume_->block.bytes.data() + std::size_t(volume_->block.Offset(v)) * sample,
                    row);
      }
    }
    done(Status::Ok());
  }

  Counts counts() const override { return {}; }

 private:
  const std::shared_ptr<const Volume> volume_;
  SourceInfo info_;
};

}  // namespace

std::shared_ptr<VolumeSource> MakeMemorySource(std::shared_ptr<const Volume> volume, SourceInfo info) {
  return std::make_shared<MemorySource>(std::move(volume), std::move(info));
}

}  // namespace slabstream
