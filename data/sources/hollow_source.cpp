#include "data/sources/hollow_source.h"

#include <cstring>
#include <utility>

namespace slabstream {
namespace {

class HollowSource final : public DescribedSource {
 public:
  explicit HollowSource(std::shared_ptr<VolumeSource> source) : DescribedSource(source, Described(source->info())) {}

  using VolumeSource::Read;
  void Read(int /*level*/, const Box& box, const BoxRoom& out, std::stop_token /*stop*/, ReadDone done) override {
    const Index3 size = box.size();
    for (std::int64_t row = 0; !out.zeroed && row < std::int64_t{size.y} * size.z; ++row) {
      std::memset(out.first + (row / size.y) * out.slice + (row % size.y) * out.row, 0, std::size_t(size.x));
    }
    done(Status::Ok());
  }

 private:
  static SourceInfo Described(const SourceInfo& of) {
    SourceInfo info{.levels = of.levels, .format = of.format, .file_type = of.file_type, .exact = {SampleType::kUint8, {}}, .hollow = true};
    for (SourceLevel& level : info.levels) {
      level.description.type = ScalarType::kUint8;
      level.description.mapping = {};
    }
    info.files = of.files;
    info.version = of.version;
    info.folder = of.folder;
    return info;
  }
};

}  // namespace

std::shared_ptr<VolumeSource> AsHollow(std::shared_ptr<VolumeSource> source) { return std::make_shared<HollowSource>(std::move(source)); }

}  // namespace slabstream
