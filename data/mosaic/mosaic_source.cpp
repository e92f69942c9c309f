#include "data/mosaic/mosaic_source.h"

#include <fmt/format.h>

#include <algorithm>
#include <exception>
#include <list>
#include <mutex>
#include <utility>

#include "common/base/check.h"
#include "common/base/printable.h"
#include "common/volume/box_assembly.h"
#include "data/sources/box_reading.h"
#include "data/sources/copy_samples.h"
#include "data/stores/read_threads.h"

namespace slabstream {
namespace {

// Sources hold their files open, of which a process may have about a thousand.
constexpr std::size_t kMostOpen = 64;

// The parts of a mosaic, which live as long as it or a read of it.
class Parts {
 public:
  Parts(std::string name, const SourceInfo& info, std::vector<MosaicPart> parts)
      : name_(std::move(name)), level_(info.levels.front().description), exact_(info.exact), parts_(std::move(parts)) {}

  const MosaicPart& part(std::size_t i) const { return parts_[i]; }
  SampleType type() const { return exact_.type; }

  // Voxels that lie in no part. Unlike Assemble, takes a part for once, since there may be many.
  std::int64_t Missing() const {
    std::vector<Box> missing = {level_.geometry.bounds()};
    for (const MosaicPart& part : parts_) {
      std::vector<Box> rest;
      for (const Box& box : missing) {
        const std::vector<Box> outside = Difference(box, part.box);
        rest.insert(rest.end(), outside.begin(), outside.end());
      }
      missing = std::move(rest);
    }
    return BoxAssembly{{}, std::move(missing)}.missing_voxels();
  }

  // Blocks lie at multiples of their size in the volume, so those of parts that begin elsewhere are of no use.
  Index3 BlockLike(Index3 block) const {
    for (const MosaicPart& part : parts_) {
      for (int axis = 0; axis < 3; ++axis) {
        if (part.box.begin[axis] % block[axis] != 0) block[axis] = 1;
      }
    }
    return block;
  }

  // Which parts a box is read from.
  BoxAssembly Assembled(const Box& box) const {
    std::vector<Box> boxes;
    std::vector<std::size_t> numbers;
    for (std::size_t i = 0; i < parts_.size(); ++i) {
      if (Intersection(box, parts_[i].box).empty()) continue;
      boxes.push_back(parts_[i].box);
      numbers.push_back(i);
    }
    BoxAssembly assembly = Assemble(box, boxes);
    for (BoxAssembly::Part& copied : assembly.copied) copied.source = numbers[copied.source];
    return assembly;
  }

  // Waits.
  Result<std::shared_ptr<VolumeSource>> Source(std::size_t i) {
    const std::lock_guard lock(mutex_);
    const auto found = std::ranges::find(open_, i, &Open::part);
    if (found != open_.end()) {
      open_.splice(open_.begin(), open_, found);
      return open_.front().source;
    }
    Result<std::shared_ptr<VolumeSource>> source = parts_[i].open();
    if (!source.ok()) return source;
    if (Status status = Check(parts_[i], (*source)->info()); !status.ok()) return status;
    if (open_.size() == kMostOpen) {
      Add(open_.back().source->counts(), closed_);
      open_.pop_back();
    }
    open_.push_front({i, *source});
    return source;
  }

  VolumeSource::Counts counts() {
    const std::lock_guard lock(mutex_);
    VolumeSource::Counts all = closed_;
    for (const Open& open : open_) Add(open.source->counts(), all);
    return all;
  }

 private:
  struct Open {
    std::size_t part = 0;
    std::shared_ptr<VolumeSource> source;
  };

  static void Add(const VolumeSource::Counts& counts, VolumeSource::Counts& all) {
    all.stored_bytes += counts.stored_bytes;
    all.chunks += counts.chunks;
  }

  Status Check(const MosaicPart& part, const SourceInfo& info) const {
    const auto& [geometry, type, mapping] = info.finest();
    const auto text = [](const Index3& size) { return fmt::format("{} x {} x {} voxels", size.x, size.y, size.z); };
    if (geometry.size != part.box.size()) {
      return Status::InvalidArgument(
          fmt::format("{}: {} has {}, must have {}", name_, part.name, text(geometry.size), text(part.box.size())));
    }
    const bool same_exact = info.exact.type == exact_.type && info.exact.mapping == exact_.mapping;
    if (type == level_.type && mapping == level_.mapping && same_exact) return Status::Ok();
    return Status::InvalidArgument(fmt::format("{}: {} has samples of {} from {} and scale {}, must have {} from {} and scale {}", name_,
                                               part.name, ToString(info.exact.type), info.exact.mapping.offset, info.exact.mapping.scale,
                                               ToString(exact_.type), exact_.mapping.offset, exact_.mapping.scale));
  }

  const std::string name_;
  const VolumeDescription level_;
  const ExactType exact_;
  const std::vector<MosaicPart> parts_;
  std::mutex mutex_;             // guards what follows
  std::list<Open> open_;         // the last one that was wanted first; at most kMostOpen
  VolumeSource::Counts closed_;  // of those that are not open any more
};

class MosaicSource : public VolumeSource {
 public:
  MosaicSource(std::string name, SourceInfo info, std::shared_ptr<Parts> parts)
      : name_(std::move(name)), info_(std::move(info)), parts_(std::move(parts)) {}

  const SourceInfo& info() const override { return info_; }
  Counts counts() const override { return parts_->counts(); }

  void Read(int level, const Box& box, const BoxRoom& out, std::stop_token stop, ReadDone done) override {
    CHECK(level == 0 && !box.empty() && info_.finest().geometry.bounds().Contains(box)) << "a box outside the volume";
    const auto reading = std::make_shared<BoxReading>(box, out, std::move(stop), std::move(done));
    const auto failed = [this, &reading](const std::exception& error) {
      reading->Fail(Status::ResourceExhausted(fmt::format("{}: a part cannot be read: {}", name_, error.what())));
    };
    try {
      for (const BoxAssembly::Part& copied : parts_->Assembled(box).copied) {
        reading->BeginPart();
        try {
          // Not on the thread of whoever reads: it may have to be opened.
          PostRead([parts = parts_, reading, copied] { ReadFrom(*parts, copied, reading); });
        } catch (const std::exception& error) {
          failed(error);
          reading->EndPart();
        }
      }
    } catch (const std::exception& error) {
      failed(error);
    }
    reading->EndPart();
  }

 private:
  static void ReadFrom(Parts& parts, const BoxAssembly::Part& copied, const std::shared_ptr<BoxReading>& reading) {
    const auto end = [reading](Status status) {
      if (!status.ok()) reading->Fail(std::move(status));
      reading->EndPart();
    };
    if (!reading->goes_on()) return end(Status::Cancelled("reading was stopped"));
    Result<std::shared_ptr<VolumeSource>> source = parts.Source(copied.source);
    if (!source.ok()) return end(Printable(source.status()));
    BoxRoom out = reading->out();
    const Index3 offset = copied.box.begin - reading->box().begin, begin = parts.part(copied.source).box.begin;
    out.first += (offset.x + offset.y * out.row + offset.z * out.slice) * std::int64_t(CopiedBytes(parts.type(), out.exact));
    (*source)->Read(0, {copied.box.begin - begin, copied.box.end - begin}, out, reading->stop(),
                    [end, keep = *source](Status status) { end(std::move(status)); });
  }

  const std::string name_;
  const SourceInfo info_;
  const std::shared_ptr<Parts> parts_;
};

}  // namespace

Result<std::shared_ptr<VolumeSource>> MakeMosaic(const std::string& name, SourceInfo info, std::vector<MosaicPart> parts) {
  if (parts.empty() || parts.size() > kMaxMosaicParts) {
    return Status::InvalidArgument(fmt::format("{}: has {} parts, must have 1 to {}", name, parts.size(), kMaxMosaicParts));
  }
  const auto all = std::make_shared<Parts>(name, info, std::move(parts));
  const Result<std::shared_ptr<VolumeSource>> first = all->Source(0);
  if (!first.ok()) return first.status();
  const std::int64_t voxels = info.finest().geometry.bounds().voxel_count();
  if (const std::int64_t missing = all->Missing(); missing > 0) {
    return Status::InvalidArgument(fmt::format("{}: its parts hold {} of the {} voxels between them", name, voxels - missing, voxels));
  }
  info.whole = (*first)->info().whole;
  info.levels.front().block = all->BlockLike((*first)->info().levels.front().block);
  return std::shared_ptr<VolumeSource>(std::make_shared<MosaicSource>(name, std::move(info), all));
}

}  // namespace slabstream
