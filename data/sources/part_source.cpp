#include "data/sources/part_source.h"

#include <utility>

#include "common/base/check.h"

namespace slabstream {
namespace {

SourceInfo InfoOfPart(SourceInfo info, int level, const Box& box) {
  SourceLevel part = info.levels.at(std::size_t(level));
  VolumeGeometry& geometry = part.description.geometry;
  CHECK(!box.empty() && geometry.bounds().Contains(box));
  geometry.orientation.origin = geometry.ToWorld(ToVec3(box.begin));
  geometry.size = box.size();
  part.block = Min(part.block, box.size());
  info.levels = {part};
  return info;
}

class PartSource : public DescribedSource {
 public:
  PartSource(const std::shared_ptr<VolumeSource>& source, int level, const Box& box)
      : DescribedSource(source, InfoOfPart(source->info(), level, box)), level_(level), begin_(box.begin) {}

  void Read(int level, const Box& box, const BoxRoom& out, std::stop_token stop, ReadDone done) override {
    CHECK_EQ(level, 0);
    source_->Read(level_, {box.begin + begin_, box.end + begin_}, out, std::move(stop), std::move(done));
  }

 private:
  const int level_;
  const Index3 begin_;
};

}  // namespace

std::shared_ptr<VolumeSource> MakePartSource(std::shared_ptr<VolumeSource> source, int level, const Box& box) {
  return std::make_shared<PartSource>(std::move(source), level, box);
}

}  // namespace slabstream
