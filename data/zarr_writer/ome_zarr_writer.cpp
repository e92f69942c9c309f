#include "data/zarr_writer/ome_zarr_writer.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <future>
#include <memory>
#include <utility>
#include <vector>

#include "common/files/file_descriptor.h"
#include "common/files/file_stamp.h"
#include "common/files/files.h"
#include "common/json/json.h"
#include "common/memory/aligned_buffer.h"
#include "common/volume/memory_budget.h"
#include "data/zarr_writer/reduce.h"
#include "data/zarr_writer/zarr_objects.h"

namespace slabstream {
namespace {

namespace fs = std::filesystem;

constexpr const char* kConversion = ".slabstream-conversion";

std::int32_t CoarsestSide(const OmeZarrOptions& options) { return options.coarsest_side > 0 ? options.coarsest_side : options.chunk_side; }

Status CheckOptions(const OmeZarrOptions& options) {
  const auto check = [](const char* name, std::int64_t value, std::int64_t least, std::int64_t most) {
    if (value >= least && value <= most) return Status::Ok();
    return Status::InvalidArgument(fmt::format("{}: {} is out of [{}, {}]", name, value, least, most));
  };
  for (const Status& status :
       {check("chunk side", options.chunk_side, 8, 512), check("shard side", options.shard_side, options.chunk_side, 4096),
        check("coarsest side", CoarsestSide(options), 8, 512), check("codec level", options.codec_level, 1, 19)}) {
    if (!status.ok()) return status;
  }
  if (options.shard_side % options.chunk_side != 0 || options.shard_side % 2 != 0) {
    return Status::InvalidArgument(
        fmt::format("shard side: {} is not an even multiple of the chunk side {}", options.shard_side, options.chunk_side));
  }
  return Status::Ok();
}

// A cube, or a slab of slices. Even along each axis that is halved, so that no voxel of a coarser level lies in two of them.
Index3 ShardFor(const OmeZarrOptions& options, const Index3& size) {
  if (!options.slices) return Uniform(options.shard_side);
  Index3 shard = options.chunk_side * CubesOver(size, options.chunk_side);
  shard[options.slices->along] = options.chunk_side * (options.chunk_side % 2 == 0 ? 1 : 2);
  return shard;
}

ZarrObjects ObjectsFor(const SourceInfo& source, const std::string& folder, const OmeZarrOptions& options) {
  const VolumeGeometry& geometry = source.levels.front().description.geometry;
  const ZarrLayout layout = {options.version, source.exact.type, options.chunk_side, ShardFor(options, geometry.size), options.codec_level};
  return {folder, layout, PlanLevels(geometry, CoarsestSide(options))};
}

// What decides the bytes that are written.
std::string Description(const VolumeSource& source, const OmeZarrOptions& options, const Index3& shard,
                        const std::vector<MetadataFile>& metadata, const std::optional<FileStamp>& stamp) {
  Json files;
  for (const MetadataFile& file : metadata) files[file.key] = file.text;
  const Json all = {{"source", options.source},
                    {"format", source.info().format},
                    {"stamp", stamp ? stamp->digest : 0},
                    {"region", {shard.x, shard.y, shard.z}},
                    {"metadata", files}};
  return all.dump(1) + "\n";
}

// The folder, from the moment in which this process alone writes it.
class Target {
 public:
  static Result<Target> Open(const std::string& folder, const std::string& description) {
    std::error_code error;
    const std::string file = folder + "/" + kConversion;
    const bool goes_on = fs::exists(file, error);
    if (fs::exists(folder, error) && !goes_on) {
      const bool empty = fs::is_directory(folder, error) && fs::is_empty(folder, error) && !error;
      if (!empty) return Status::InvalidArgument(fmt::format("'{}' exists: remove it, or name another folder", folder));
    }
    fs::create_directories(folder, error);
    if (error) return Status::Unavailable(fmt::format("cannot write '{}': {}", folder, error.message()));
    if (!goes_on) {
      if (Status status = WriteTextFile(file, description); !status.ok()) return status;
    }
    FileDescriptor lock(::open(file.c_str(), O_RDONLY | O_CLOEXEC));
    if (lock.number() < 0) return Status::Unavailable(fmt::format("cannot read '{}': {}", file, std::strerror(errno)));
    if (::flock(lock.number(), LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK) {
      return Status::Unavailable(fmt::format("'{}': another process is writing it", folder));
    }
    constexpr std::size_t kMost = std::size_t{1} << 20;
    const Result<std::string> before = ReadTextFile(file, kMost);
    if (!before.ok()) return before.status();
    if (*before != description) {
      return Status::InvalidArgument(fmt::format(
          "'{}' holds an unfinished conversion of another source, or with other options: remove it, or name another folder", folder));
    }
    if (goes_on) RemoveParts(folder);
    return Target(folder, std::move(lock));
  }

  Status Finish(const std::vector<MetadataFile>& metadata) const {
    for (const MetadataFile& file : metadata) {
      if (Status status = WriteTextFile(folder_ + "/" + file.key, file.text); !status.ok()) return status;
    }
    std::error_code error;
    fs::remove(folder_ + "/" + kConversion, error);
    return error ? Status::Unavailable(fmt::format("cannot remove '{}/{}': {}", folder_, kConversion, error.message())) : Status::Ok();
  }

 private:
  Target(std::string folder, FileDescriptor lock) : folder_(std::move(folder)), lock_(std::move(lock)) {}

  // What a process that was killed has left of files that it was writing.
  static void RemoveParts(const std::string& folder) {
    std::error_code error;
    for (fs::recursive_directory_iterator each(folder, error), end; !error && each != end; each.increment(error)) {
      std::error_code ignored;
      if (each->path().extension() == ".tmp") fs::remove(each->path(), ignored);
    }
  }

  std::string folder_;
  FileDescriptor lock_;
};

// What is to be done with a region, in this order: make or read its elements, write them, add them to the next level.
struct Step {
  ZarrRegion region;
  bool finished = false;  // read it; it is not to be written
};

// Adds the steps to a region: all regions that are not finished, and those that are finished and needed for them; each behind those that it
// is made of.
void AddSteps(const ZarrObjects& objects, const ZarrRegion& region, bool from_end, std::vector<Step>& steps) {
  if (objects.IsFinished(region)) return steps.push_back({region, true});
  if (region.level > 0) {
    const Index3& step = objects.levels()[std::size_t(region.level)].step;
    const std::size_t count = CountIn(step);
    for (std::size_t i = 0; i < count; ++i) {
      const ZarrRegion part = {region.level - 1, step * region.index + PlaceIn(step, from_end ? count - 1 - i : i)};
      if (!objects.BoxOf(part).empty()) AddSteps(objects, part, from_end, steps);
    }
  }
  steps.push_back({region, false});
}

// Of all levels. Those of the first one come in the order of slices, if there is one.
std::vector<Step> StepsFor(const ZarrObjects& objects, const std::optional<SliceOrder>& slices) {
  const bool from_end = slices && slices->from_end;
  const int last = int(objects.levels().size()) - 1;
  const Index3 counts = objects.RegionsOf(last);
  const std::size_t count = CountIn(counts);
  std::vector<Step> steps;
  for (std::size_t i = 0; i < count; ++i) AddSteps(objects, {last, PlaceIn(counts, from_end ? count - 1 - i : i)}, from_end, steps);
  return steps;
}

// Reads regions of level 0, one of them ahead if there is memory for it.
class Reader {
 public:
  Reader(VolumeSource& source, const ZarrObjects& objects, const std::vector<Step>& steps, bool ahead, std::stop_token stop)
      : source_(source), objects_(objects), steps_(steps), ahead_(ahead), stop_(std::move(stop)) {}
  ~Reader() {
    if (read_.valid()) read_.wait();
  }
  Reader(const Reader&) = delete;
  Reader& operator=(const Reader&) = delete;

  // The samples of a step that is not finished.
  Status Read(std::size_t step, AlignedVector<std::byte>& samples) {
    if (!read_.valid()) {
      samples.swap(buffer_);  // what it holds is not needed any more, so there is one buffer
      Begin(step);
    }
    if (Status status = read_.get(); !status.ok()) return status;
    samples.swap(buffer_);
    if (ahead_) {
      for (std::size_t next = step + 1; next < steps_.size(); ++next) {
        if (steps_[next].finished || steps_[next].region.level > 0) continue;
        Begin(next);
        break;
      }
    }
    return Status::Ok();
  }

 private:
  void Begin(std::size_t step) {
    buffer_.resize(objects_.BytesOf(steps_[step].region));
    const auto end = std::make_shared<std::promise<Status>>();
    read_ = end->get_future();
    const Box box = objects_.BoxOf(steps_[step].region);
    source_.Read(0, box, BoxRoom::Dense(box, buffer_.data(), true), stop_, [end](Status status) { end->set_value(std::move(status)); });
  }

  VolumeSource& source_;
  const ZarrObjects& objects_;
  const std::vector<Step>& steps_;
  const bool ahead_;
  const std::stop_token stop_;
  AlignedVector<std::byte> buffer_;
  std::future<Status> read_;
};

// For a region of each level.
std::uint64_t LeastMemory(const ZarrObjects& objects) {
  std::uint64_t bytes = objects.memory();
  for (int level = 0; level < int(objects.levels().size()); ++level) bytes += objects.BytesOf({level, {0, 0, 0}});
  return bytes;
}

}  // namespace

std::uint64_t LeastMemoryFor(const SourceInfo& source, const OmeZarrOptions& options) {
  return LeastMemory(ObjectsFor(source, "", options));
}

Status WriteOmeZarr(VolumeSource& source, const std::string& folder_text, const OmeZarrOptions& options) {
  if (Status status = CheckOptions(options); !status.ok()) return status;
  std::string folder = folder_text;
  while (folder.size() > 1 && folder.ends_with('/')) folder.pop_back();
  const SourceInfo& info = source.info();
  const VolumeGeometry& geometry = info.levels[0].description.geometry;
  const ZarrObjects objects = ObjectsFor(info, folder, options);
  const ZarrLayout& layout = objects.layout();
  const int levels = int(objects.levels().size());

  // One more region of level 0 if there is room: then it is read while the one before it is compressed.
  const std::uint64_t needed = LeastMemory(objects);
  if (needed > options.memory) {
    return Status::ResourceExhausted(
        fmt::format("writing '{}' needs {} of memory, but only {} are given", folder, MemoryText(needed), MemoryText(options.memory)));
  }
  const bool ahead = options.memory - needed >= objects.BytesOf({0, {0, 0, 0}});

  std::optional<FileStamp> stamp;
  if (!info.files.empty()) {
    Result<FileStamp> stamped = StampFiles(info.files);
    if (!stamped.ok()) return stamped.status();
    stamp = *std::move(stamped);
  }
  const std::string name = fs::path(folder).stem().stem().string();
  const std::vector<MetadataFile> metadata =
      OmeMetadata(layout, objects.levels(), name, geometry.orientation, info.exact.mapping, info.labels);
  const Result<Target> target = Target::Open(folder, Description(source, options, layout.shard, metadata, stamp));
  if (!target.ok()) return target.status();

  const std::vector<Step> steps = StepsFor(objects, options.slices);
  OmeZarrProgress progress;
  for (const WrittenLevel& level : objects.levels()) progress.all_bytes += CountIn(level.size) * BytesPerSample(layout.type);
  progress.done_bytes = progress.all_bytes;
  for (const Step& step : steps) progress.done_bytes -= step.finished ? 0 : objects.BytesOf(step.region);
  const auto report = [&] {
    if (options.progress) options.progress(progress);
  };
  report();

  Reader reader(source, objects, steps, ahead, options.stop);
  std::vector<AlignedVector<std::byte>> buffers(objects.levels().size());  // one region of each level
  for (std::size_t s = 0; s < steps.size(); ++s) {
    const auto& [region, finished] = steps[s];
    if (options.stop.stop_requested()) return Status::Cancelled(fmt::format("writing '{}' was stopped", folder));
    AlignedVector<std::byte>& buffer = buffers[std::size_t(region.level)];
    if (finished) {
      if (region.level == levels - 1) continue;  // nobody needs it
      buffer.resize(objects.BytesOf(region));
      if (Status status = objects.Read(region, buffer.data()); !status.ok()) return status;
    } else {
      if (region.level == 0) {
        if (Status status = reader.Read(s, buffer); !status.ok()) return status;
      }
      if (Status status = objects.Write(region, buffer.data()); !status.ok()) return status;
      progress.done_bytes += objects.BytesOf(region);
      progress.level = region.level;
      report();
    }
    if (region.level == levels - 1) continue;
    const Index3& step = objects.levels()[std::size_t(region.level) + 1].step;
    const Box box = objects.BoxOf(region);
    const ZarrRegion coarser = {region.level + 1, region.index / step};
    const Box coarser_box = objects.BoxOf(coarser);
    buffers[std::size_t(coarser.level)].resize(objects.BytesOf(coarser));
    Reduce(layout.type, info.labels ? Reduction::kMostFrequent : Reduction::kMean, buffer.data(), box.size(), step,
           buffers[std::size_t(coarser.level)].data(), coarser_box.size(), box.begin / step - coarser_box.begin);
  }
  if (stamp) {
    const Result<bool> changed = HaveChanged(*stamp);
    if (!changed.ok()) return changed.status();
    if (*changed) {
      return Status::Unavailable(fmt::format("'{}' changed while it was read: remove '{}', and begin again", options.source, folder));
    }
  }
  return target->Finish(metadata);
}

}  // namespace slabstream
