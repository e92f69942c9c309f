#include "data/positional/positional_source.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <mutex>
#include <utility>

#include "common/base/check.h"
#include "common/base/printable.h"
#include "data/positional/keep_samples.h"
#include "data/positional/stored_samples.h"
#include "data/volume_io/formats.h"
#include "data/volume_io/volume_reader.h"
#include "data/volume_io/world_placement.h"

namespace slabstream {
namespace {

// A box as it is read: where it lies by the stored axes, and where its samples belong.
struct Wanted {
  Box stored;
  PlacedSamples<std::byte> to;  // by the stored axes

  PlacedSamples<std::byte> Of(const Box& part) const {
    PlacedSamples<std::byte> placed = to;
    for (int i = 0; i < 3; ++i) placed.first += (part.begin[i] - stored.begin[i]) * to.steps[std::size_t(i)];
    return placed;
  }
};

// `size`: of the volume, turned like `box`.
Wanted FindStored(const AxisTurn& turn, const Index3& size, const Box& box, std::byte* out, std::int64_t sample_bytes) {
  Wanted wanted{.stored = {}, .to = {.first = out}};
  std::int64_t step = sample_bytes;
  for (int i = 0; i < 3; ++i) {
    const int axis = turn.from[std::size_t(i)];
    const bool flipped = turn.flipped[std::size_t(i)];
    wanted.stored.begin[axis] = flipped ? size[i] - box.end[i] : box.begin[i];
    wanted.stored.end[axis] = flipped ? size[i] - box.begin[i] : box.end[i];
    wanted.to.steps[std::size_t(axis)] = flipped ? -step : step;
    if (flipped) wanted.to.first += step * (box.size()[i] - 1);
    step *= box.size()[i];
  }
  return wanted;
}

// A box on its way: ends when all parts have.
struct Job {
  std::shared_ptr<StoredSamples> samples;
  Wanted wanted;
  std::stop_token stop;
  VolumeSource::ReadDone done;
  std::atomic<std::size_t> left;
  std::mutex mutex = {};  // guards what follows
  Status end = {};        // the first failure

  void Run(const Box& part) {
    if (stop.stop_requested()) {
      Fail(Status::Cancelled("reading was cancelled"));
    } else if (!failed()) {
      if (const Status status = samples->Read(part, wanted.Of(part)); !status.ok()) Fail(Printable(status));
    }
  }
  void EndPart() {
    if (--left == 0) done(end);
  }

 private:
  void Fail(Status status) {
    const std::lock_guard lock(mutex);
    if (end.ok()) end = std::move(status);
  }
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
    const Wanted wanted = FindStored(turn_, description.geometry.size, box, out.data(), std::int64_t(sample_bytes));
    const std::vector<Box> parts = samples_->Parts(wanted.stored);
    const std::shared_ptr<Job> job(new Job{samples_, wanted, std::move(stop), std::move(done), parts.size()});
    for (const Box& part : parts) {
      const auto bytes = std::uint64_t(samples_->MemoryFor(part, wanted.Of(part)));
      context_->Admit(bytes, [job, part, bytes, context = context_] {
        context->PostDecode([job, part, bytes, context] {
          job->Run(part);
          context->Release(bytes);
          job->EndPart();
        });
      });
    }
  }

 private:
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

  const auto [type, shift] = KeptSampleTypeOf(header.type);
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
