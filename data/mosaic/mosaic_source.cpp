#include "data/mosaic/mosaic_source.h"

#include <fmt/format.h>

#include <algorithm>
#include <exception>
#include <mutex>
#include <utility>

#include "common/base/check.h"
#include "common/base/lru_map.h"
#include "common/base/printable.h"
#include "common/memory/pooled_vector.h"
#include "common/volume/box_assembly.h"
#include "data/mosaic/box_tree.h"
#include "data/sources/box_reading.h"
#include "data/sources/copy_samples.h"
#include "data/sources/prolong.h"
#include "data/stores/read_threads.h"

namespace slabstream {
namespace {

Status TooMany(const std::string& name, std::size_t parts) {
  return Status::InvalidArgument(fmt::format("{}: has {} parts, must have 1 to {}", name, parts, kMaxMosaicParts));
}

// Parts that are sources. They hold their files open, of which a process may have about a thousand.
class SourceParts : public PartReader {
 public:
  SourceParts(std::string name, SourceInfo info, std::vector<std::vector<MosaicPart>> levels)
      : name_(std::move(name)), info_(std::move(info)), levels_(std::move(levels)) {}

  void Read(int level, std::size_t part, const Box& box, const BoxRoom& out, std::stop_token stop, VolumeSource::ReadDone done) override {
    Result<std::shared_ptr<VolumeSource>> source = Source(level, part);
    if (!source.ok()) return done(Printable(source.status()));
    const Index3 begin = levels_[std::size_t(level)][part].box.begin;
    (*source)->Read(0, {box.begin - begin, box.end - begin}, out, std::move(stop),
                    [done = std::move(done), keep = *source](Status status) { done(std::move(status)); });
  }

  VolumeSource::Counts counts() override {
    const std::lock_guard lock(mutex_);
    VolumeSource::Counts all = closed_;
    for (const auto& open : open_.entries()) all += open.value->counts();
    return all;
  }

  // Waits.
  Result<std::shared_ptr<VolumeSource>> Source(int level, std::size_t i) {
    constexpr std::size_t kMostOpen = 64;
    const std::lock_guard lock(mutex_);
    if (const auto* const found = open_.Find({level, i})) return *found;
    const MosaicPart& part = levels_[std::size_t(level)][i];
    Result<std::shared_ptr<VolumeSource>> source = part.open();
    if (!source.ok()) return source;
    if (Status status = CheckPart(part, (*source)->info()); !status.ok()) return status;
    open_.Put({level, i}, *source);
    for (const auto& closed : open_.DropBeyond(kMostOpen)) closed_ += closed.value->counts();
    return source;
  }

  // Blocks lie at multiples of their size in the level, so those of parts that begin elsewhere are of no use.
  Index3 BlockLike(Index3 block, std::size_t level) const {
    for (const MosaicPart& part : levels_[level]) {
      for (int axis = 0; axis < 3; ++axis) {
        if (part.box.begin[axis] % block[axis] != 0) block[axis] = 1;
      }
    }
    return block;
  }

 private:
  Status CheckPart(const MosaicPart& part, const SourceInfo& info) const {
    const auto& [geometry, type, mapping] = info.finest();
    const VolumeDescription& wanted = info_.finest();
    const auto text = [](const Index3& size) { return fmt::format("{} x {} x {} voxels", size.x, size.y, size.z); };
    if (geometry.size != part.box.size()) {
      return Status::InvalidArgument(
          fmt::format("{}: {} has {}, must have {}", name_, part.name, text(geometry.size), text(part.box.size())));
    }
    const auto& [exact_type, exact] = info_.exact;
    if (type == wanted.type && mapping == wanted.mapping && info.exact.type == exact_type && info.exact.mapping == exact) {
      return Status::Ok();
    }
    return Status::InvalidArgument(fmt::format("{}: {} has samples of {} from {} and scale {}, must have {} from {} and scale {}", name_,
                                               part.name, ToString(info.exact.type), info.exact.mapping.offset, info.exact.mapping.scale,
                                               ToString(exact_type), exact.offset, exact.scale));
  }

  const std::string name_;
  const SourceInfo info_;
  const std::vector<std::vector<MosaicPart>> levels_;
  std::mutex mutex_;                                                         // guards what follows
  LruMap<std::pair<int, std::size_t>, std::shared_ptr<VolumeSource>> open_;  // by level and number
  VolumeSource::Counts closed_;                                              // of those that are not open any more
};

// What lies in the parts, and what is interpolated. Lives as long as the mosaic or a read of it.
class Parts : public std::enable_shared_from_this<Parts> {
 public:
  Parts(std::string name, SourceInfo info, const PartBoxes& boxes, std::shared_ptr<PartReader> reader)
      : name_(std::move(name)), info_(std::move(info)), boxes_(boxes), trees_(boxes.begin(), boxes.end()), reader_(std::move(reader)) {}

  // Errors of MakeMosaic.
  Result<SourceInfo> Check() {
    const SampleType type = info_.exact.type;
    if (boxes_.size() > 1 && type != SampleType::kFloat32 && type != SampleType::kFloat64) {
      return Status::InvalidArgument(fmt::format("{}: has samples of {}, must have float32 or float64", name_, ToString(type)));
    }
    const Box coarsest = info_.levels.back().description.geometry.bounds();
    if (const std::int64_t missing = Assembled(int(boxes_.size()) - 1, coarsest).missing_voxels(); missing > 0) {
      return Status::InvalidArgument(fmt::format("{}: its parts hold {} of the {} voxels between them", name_,
                                                 coarsest.voxel_count() - missing, coarsest.voxel_count()));
    }
    for (std::size_t level = 0; level + 1 < boxes_.size(); ++level) info_.levels[level].refined = boxes_[level];
    if (boxes_.size() == 1 && boxes_.front()->size() <= kMostOwners) info_.levels.front().owned = Owned();
    return info_;
  }

  void Read(int level, const Box& box, const BoxRoom& out, std::stop_token stop, VolumeSource::ReadDone done) {
    const auto reading = std::make_shared<BoxReading>(box, out, std::move(stop), std::move(done));
    try {
      auto assembly = std::make_shared<const BoxAssembly>(Assembled(level, box));
      if (assembly->missing.empty()) {
        ReadParts(level, assembly, reading);
      } else {
        Begin(reading, [self = shared_from_this(), level, assembly, reading] {
          self->EndIfItThrows(reading, [&] { self->Interpolate(level, assembly, reading); });
        });
      }
    } catch (const std::exception& error) {
      reading->Fail(NoMemory(error));
    }
    reading->EndPart();
  }

  VolumeSource::Counts counts() const { return reader_->counts(); }

 private:
  Status NoMemory(const std::exception& error) const {
    return Status::ResourceExhausted(fmt::format("{}: a part cannot be read: {}", name_, error.what()));
  }

  static constexpr std::size_t kMostOwners = 1 << 14;

  // Each part owns its voxels, but for those that an earlier one has, too.
  std::shared_ptr<const OwnedBoxes> Owned() const {
    const std::vector<Box>& parts = *boxes_.front();
    auto owned = std::make_shared<OwnedBoxes>();
    for (std::uint32_t part = 0; part < parts.size(); ++part) {
      std::vector<Box> earlier;
      for (const std::uint32_t other : trees_.front().Meeting(parts[part])) {
        if (other < part) earlier.push_back(parts[other]);
      }
      for (const Box& box : Assemble(parts[part], earlier).missing) owned->push_back({box, part});
    }
    return owned;
  }

  // Which parts a box is read from, in ascending order.
  BoxAssembly Assembled(int level, const Box& box) const {
    const std::vector<Box>& parts = *boxes_[std::size_t(level)];
    BoxAssembly assembly{{}, {box}};
    for (const std::uint32_t part : trees_[std::size_t(level)].Meeting(box)) {
      std::vector<Box> missing;
      for (const Box& each : assembly.missing) {
        if (const Box common = Intersection(each, parts[part]); !common.empty()) assembly.copied.push_back({part, common});
        const std::vector<Box> rest = Difference(each, parts[part]);
        missing.insert(missing.end(), rest.begin(), rest.end());
      }
      assembly.missing = std::move(missing);
      if (assembly.missing.empty()) break;
    }
    return assembly;
  }

  template <class Task>
  void Begin(const std::shared_ptr<BoxReading>& reading, Task task) {
    reading->BeginPart();
    EndIfItThrows(reading, [&] { PostRead(std::move(task)); });
  }

  // What `task` ends when it has done its work.
  template <class Task>
  void EndIfItThrows(const std::shared_ptr<BoxReading>& reading, Task&& task) {
    try {
      task();
    } catch (const std::exception& error) {
      reading->Fail(NoMemory(error));
      reading->EndPart();
    }
  }

  // Where a part of the box that is read goes.
  BoxRoom RoomFor(const Box& part, const BoxReading& reading) const {
    BoxRoom room = reading.out();
    const Index3 offset = part.begin - reading.box().begin;
    room.first += (offset.x + offset.y * room.row + offset.z * room.slice) * std::int64_t(CopiedBytes(info_.exact.type, room.exact));
    return room;
  }

  static VolumeSource::ReadDone EndOf(const std::shared_ptr<BoxReading>& reading) {
    return [reading](Status status) {
      if (!status.ok()) reading->Fail(std::move(status));
      reading->EndPart();
    };
  }

  // A task for several parts, which may be small. Not on the thread of whoever reads: files may have to be opened.
  void ReadParts(int level, const std::shared_ptr<const BoxAssembly>& assembly, const std::shared_ptr<BoxReading>& reading) {
    constexpr std::size_t kTogether = 32;
    for (std::size_t first = 0; first < assembly->copied.size(); first += kTogether) {
      const std::size_t end = std::min(first + kTogether, assembly->copied.size());
      Begin(reading, [self = shared_from_this(), level, assembly, first, end, reading] {
        for (std::size_t i = first; i < end && reading->goes_on(); ++i) {
          const BoxAssembly::Part& copied = assembly->copied[i];
          reading->BeginPart();
          self->EndIfItThrows(reading, [&] {
            self->reader_->Read(level, copied.source, copied.box, self->RoomFor(copied.box, *reading), reading->stop(), EndOf(reading));
          });
        }
        if (!reading->goes_on()) reading->GiveUp();
        reading->EndPart();
      });
    }
  }

  // Of a box some voxels of which lie in no part. One read of the coarser level is quicker than one for each of the gaps, so what lies
  // between them is interpolated, too, before the parts are read.
  void Interpolate(int level, const std::shared_ptr<const BoxAssembly>& assembly, const std::shared_ptr<BoxReading>& reading) {
    const VolumeSource::ReadDone end = EndOf(reading);
    if (!reading->goes_on()) return end(Status::Cancelled("reading was stopped"));
    Box gaps;
    for (const Box& missing : assembly->missing) gaps = Hull(gaps, missing);
    VoxelPlaces places = PlacesBetween(gaps, info_.levels[std::size_t(level)].description.geometry,
                                       info_.levels[std::size_t(level) + 1].description.geometry);
    const Box between = BoxBetween(places);
    const bool exact = reading->out().exact;
    const auto samples =
        std::make_shared<UnwrittenVector<std::byte>>(std::size_t(between.voxel_count()) * CopiedBytes(info_.exact.type, exact));
    Read(level + 1, between, BoxRoom::Dense(between, samples->data(), exact), reading->stop(),
         [self = shared_from_this(), level, assembly, samples, gaps, places = std::move(places), reading, end](Status status) {
           if (status.ok()) {
             const BoxRoom room = self->RoomFor(gaps, *reading);
             if (room.exact && self->info_.exact.type == SampleType::kFloat64) {
               Prolong<double, double>(reinterpret_cast<const double*>(samples->data()), places, room);
             } else {
               Prolong<float, float>(reinterpret_cast<const float*>(samples->data()), places, room);
             }
             self->ReadParts(level, assembly, reading);
           }
           end(std::move(status));
         });
  }

  const std::string name_;
  SourceInfo info_;  // complete once it is checked
  const PartBoxes boxes_;
  const std::vector<BoxTree> trees_;  // by level
  const std::shared_ptr<PartReader> reader_;
};

class MosaicSource : public VolumeSource {
 public:
  MosaicSource(SourceInfo info, std::shared_ptr<Parts> parts) : info_(std::move(info)), parts_(std::move(parts)) {}

  const SourceInfo& info() const override { return info_; }
  Counts counts() const override { return parts_->counts(); }
  void Read(int level, const Box& box, const BoxRoom& out, std::stop_token stop, ReadDone done) override {
    CHECK(!box.empty() && info_.levels.at(std::size_t(level)).description.geometry.bounds().Contains(box)) << "a box outside the volume";
    parts_->Read(level, box, out, std::move(stop), std::move(done));
  }

 private:
  const SourceInfo info_;
  const std::shared_ptr<Parts> parts_;
};

}  // namespace

Result<std::shared_ptr<VolumeSource>> MakeMosaic(const std::string& name, SourceInfo info, const PartBoxes& boxes,
                                                 std::shared_ptr<PartReader> reader) {
  CHECK(!boxes.empty() && boxes.size() == info.levels.size());
  for (const auto& of_level : boxes) {
    if (of_level->empty() || of_level->size() > kMaxMosaicParts) return TooMany(name, of_level->size());
  }
  const auto parts = std::make_shared<Parts>(name, std::move(info), boxes, std::move(reader));
  Result<SourceInfo> checked = parts->Check();
  if (!checked.ok()) return checked.status();
  return std::shared_ptr<VolumeSource>(std::make_shared<MosaicSource>(*std::move(checked), parts));
}

Result<std::shared_ptr<VolumeSource>> MakeMosaic(const std::string& name, SourceInfo info, std::vector<std::vector<MosaicPart>> levels) {
  CHECK(!levels.empty() && levels.size() == info.levels.size());
  PartBoxes boxes;
  for (const std::vector<MosaicPart>& parts : levels) {
    std::vector<Box> of_level;
    for (const MosaicPart& part : parts) of_level.push_back(part.box);
    boxes.push_back(std::make_shared<const std::vector<Box>>(std::move(of_level)));
  }
  if (levels.back().empty()) return TooMany(name, 0);
  const auto reader = std::make_shared<SourceParts>(name, info, std::move(levels));
  const Result<std::shared_ptr<VolumeSource>> first = reader->Source(int(boxes.size()) - 1, 0);
  if (!first.ok()) return first.status();
  info.whole = (*first)->info().whole;
  for (std::size_t level = 0; level < boxes.size(); ++level) {
    info.levels[level].block = reader->BlockLike((*first)->info().levels.front().block, level);
  }
  return MakeMosaic(name, std::move(info), boxes, reader);
}

}  // namespace slabstream
