#include "data/sources/part_source.h"

#include <utility>

#include "common/base/check.h"

namespace slabstream {
namespace {

class PartSource : public VolumeSource {
 public:
  PartSource(std::shared_ptr<VolumeSource> source, int level, const Box& box)
      : source_(std::move(source)), level_(level), begin_(box.begin), info_(source_->info()) {
    SourceLevel part = info_.levels.at(std::size_t(level));
    VolumeGeometry& geometry = part.description.geometry;
    CHECK(!box.empty() && geometry.bounds().Contains(box));
    geometry.orientation.origin = geometry.ToWorld(ToVec3(box.begin));
    geometry.size = box.size();
    part.block = Min(part.block, box.size());
    info_.levels = {part};
  }

  const SourceInfo& info() const override { return info_; }

  void Read(int level, const Box& box, const BoxRoom& out, std::stop_token stop, ReadDone done) override {
    CHECK_EQ(level, 0);
    source_->Read(level_, {box.begin + begin_, box.end + begin_}, out, std::move(stop), std::move(done));
  }

  Counts counts() const override { return source_->counts(); }

 private:
  const std::shared_ptr<VolumeSource> source_;
  const int level_;
  const Index3 begin_;
  SourceInfo info_;
};

}  // namespace

std::shared_ptr<VolumeSource> MakePartSource(std::shared_ptr<VolumeSource> source, int level, const Box& box) {
  return std::make_shared<PartSource>(std::move(source), level, box);
}

}  // namespace slabstream
