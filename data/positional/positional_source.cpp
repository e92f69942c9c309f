#include "data/positional/positional_source.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <exception>
#include <mutex>
#include <utility>

#include "common/base/check.h"
#include "common/base/printable.h"
#include "data/positional/stored_samples.h"
#include "data/sources/copy_samples.h"
#include "data/volume_io/formats.h"
#include "data/volume_io/volume_reader.h"
#include "data/volume_io/world_placement.h"

namespace slabstream {
namespace {

// A box on its way: ends when all parts have.
struct Job {
  std::shared_ptr<StoredSamples> samples;
  TurnedBox box;
  std::stop_token stop;
  VolumeSource::ReadDone done;
  std::atomic<std::size_t> left;
  std::mutex mutex = {};  // guards what follows
  Status end = {};        // the first failure

  void Run(const Box& part) {
    if (stop.stop_requested()) {
      Fail(Status::Cancelled("reading was cancelled"));
    } else if (!failed()) {
      try {
        if (const Status status = samples->Read(part, box); !status.ok()) Fail(Printable(status));
      } catch (const std::exception& error) {
        Fail(Status::ResourceExhausted(std::string("a part of a volume cannot be read: ") + error.what()));
      }
    }
  }
  void EndPart() {
    if (--left == 0) done(end);
  }
  void Fail(Status status) {
    const std::lock_guard lock(mutex);
    if (end.ok()) end = std::move(status);
  }

 private:
  bool failed() {
    const std::lock_guard lock(mutex);
    return !end.ok();
  }
};

class PositionalSource : public VolumeSource {
 public:
  PositionalSource(SourceInfo info, const AxisTurn& turn, std::shared_ptr<StoredSamples> samples, SourceContext context)
      : info_(std::move(info)), turn_(turn), samples_(std::move(samples)), context_(std::move(context)) {}

  const SourceInfo& info() const override { return info_; }
  Counts counts() const override { return {.stored_bytes = samples_->read_bytes()}; }

  void Read(int level, const Box& box, std::span<std::byte> out, std::stop_token stop, ReadDone done) override {
    const VolumeDescription& description = info_.levels.front().description;
    const std::size_t sample_bytes = BytesPerSample(description.type);
    CHECK(level == 0 && !box.empty() && description.geometry.bounds().Contains(box)) << "a box outside the volume";
    CHECK(out.size() == std::size_t(box.voxel_count()) * sample_bytes) << out.size();
    const TurnedBox turned{turn_, description.geometry.size, box, out.data()};
    const std::vector<Box> parts = samples_->Parts(turned.Stored());
    const std::shared_ptr<Job> job(new Job{samples_, turned, std::move(stop), std::move(done), parts.size()});
    for (const Box& part : parts) {
      const auto bytes = std::uint64_t(samples_->MemoryFor(part, turned));
      context_->Admit(bytes, [job, part, bytes, context = context_] { Post(context, job, part, bytes); });
    }
  }

 private:
  // Throws nothing.
  static void Post(const SourceContext& context, const std::shared_ptr<Job>& job, const Box& part, std::uint64_t bytes) {
    const auto end = [job, bytes, context] {
      context->Release(bytes);
      job->EndPart();
    };
    try {
      context->PostDecode([job, part, end] {
        job->Run(part);
        end();
      });
    } catch (const std::exception& error) {
      job->Fail(Status::ResourceExhausted(std::string("reading cannot begin: ") + error.what()));
      end();
    }
  }

  const SourceInfo info_;
  const AxisTurn turn_;
  const std::shared_ptr<StoredSamples> samples_;
  const SourceContext context_;
};

// Whole slices, of about so many bytes in the file: rows of a slice lie together.
Index3 BlockOf(const RawHeader& header, const AxisTurn& turn) {
  constexpr std::int64_t kBytes = std::int64_t{1} << 20;
  const std::int64_t slice_bytes = header.sample_bytes() / header.size.z;
  Index3 stored = header.size;
  stored.z = std::int32_t(std::clamp<std::int64_t>(kBytes / slice_bytes, 1, header.size.z));
  return {stored[turn.from[0]], stored[turn.from[1]], stored[turn.from[2]]};
}

Status NotByPosition(const std::string& path, const std::string& why) {
  return Status::InvalidArgument(fmt::format("{}: cannot be read by position: {}", path, why));
}

// InvalidArgument: the file's samples cannot be read by position; or its header is wrong.
Result<LocatedSamples> Locate(const VolumeFormat& format, const std::string& path, const ReadOptions& options) {
  if (format.locate == nullptr) return NotByPosition(path, fmt::format("it is {}", format.name));
  Result<LocatedSamples> located = format.locate(path, options);
  if (!located.ok()) return located;
  if (located->payload.compressed) return NotByPosition(path, "its samples are compressed");
  if (located->halves) return NotByPosition(path, "its samples are half floats");
  return located;
}

// InvalidArgument: the voxels would have to be straightened; or errors of PlaceInWorld.
Result<WorldPlacement> PlaceUpright(const RawHeader& header, const std::string& path) {
  Result<WorldPlacement> placed = PlaceInWorld(header, path);
  if (placed.ok() && placed->slant) return NotByPosition(path, "its axes are not at right angles, so that its voxels are straightened");
  return placed;
}

bool Recognises(const std::string& path) {
  if (!CheckVolume(path).ok()) {
    // Options that a format requires are known only to `open`.
    const VolumeFormat* const format = FindFormat(path, {});
    return format != nullptr && format->locate != nullptr && !format->required.empty();
  }
  ReadOptions any_time;
  any_time.time = TimeRange{};
  const Result<LocatedSamples> located = Locate(*FindFormat(path, {}), path, any_time);
  if (!located.ok()) return false;
  // Axes that a file does not state are at right angles.
  return located->header.world == World::kVoxels || PlaceUpright(located->header, path).ok();
}

Result<std::shared_ptr<VolumeSource>> OpenFile(const std::string& path, const ReadOptions& options, const SourceContext& context) {
  if (Status status = CheckVolume(path, options); !status.ok()) return status;
  const VolumeFormat& format = *FindFormat(path, options);
  const Result<LocatedSamples> located = Locate(format, path, options);
  if (!located.ok()) return located.status();
  const RawHeader& header = located->header;
  if (Status status = CheckChannel(path, header.components, options); !status.ok()) return status;
  if (options.channel == kLuminance) return NotByPosition(path, "luminance needs several components of a voxel");
  const Result<WorldPlacement> placed = PlaceUpright(header, path);
  if (!placed.ok()) return placed.status();
  const Result<Payload> payload = PayloadOfVolume(path, *located);
  if (!payload.ok()) return payload.status();
  Result<std::shared_ptr<StoredSamples>> samples = StoredSamples::Open(header, *payload, options.channel.value_or(0));
  if (!samples.ok()) return samples.status();

  const auto [type, shift] = KeptTypeOf(header.type);
  // value = scale * (stored + shift) + offset
  const auto [scale, offset] = header.rescale;
  const VolumeDescription description = {placed->geometry, type, {scale, scale * shift + offset}};
  SourceInfo info = {.levels = {{description, BlockOf(header, placed->turn)}},
                     .format = std::string(format.name),
                     .file_type = std::string(ToString(header.type)),
                     .labels = header.labels,
                     .times = int(header.volumes),
                     .files = {path}};
  if (header.components > 1) info.channels.resize(std::size_t(header.components));
  if (payload->file != path) info.files.push_back(payload->file.string());
  return std::shared_ptr<VolumeSource>(std::make_shared<PositionalSource>(std::move(info), placed->turn, *std::move(samples), context));
}

Result<std::shared_ptr<VolumeSource>> Open(const std::string& path, const ReadOptions& options, const SourceContext& context) {
  Result<std::shared_ptr<VolumeSource>> source = OpenFile(path, options, context);
  if (!source.ok()) return Printable(source.status());
  return source;
}

}  // namespace

SourceFormat UncompressedFile() {
  return {.name = "uncompressed file",
          .recognises = Recognises,
          .options = {"time", "channel", "spacing", "dims", "type", "endian", "offset"},
          .open = Open};
}

}  // namespace slabstream
