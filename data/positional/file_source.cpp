#include "data/positional/file_source.h"

#include <algorithm>
#include <atomic>
#include <exception>
#include <mutex>
#include <optional>
#include <utility>

#include "common/base/check.h"
#include "common/base/printable.h"
#include "data/positional/decoded_source.h"
#include "data/positional/located_volume.h"
#include "data/positional/slice_stream.h"
#include "data/positional/stored_samples.h"
#include "data/stores/read_threads.h"

namespace slabstream {
namespace {

Status NoMemory(const std::exception& error) {
  return Status::ResourceExhausted(std::string("a part of a volume cannot be read: ") + error.what());
}

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
        Fail(NoMemory(error));
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

  void Read(int level, const Box& box, const BoxRoom& out, std::stop_token stop, ReadDone done) override {
    const VolumeDescription& description = info_.levels.front().description;
    CHECK(level == 0 && !box.empty() && description.geometry.bounds().Contains(box)) << "a box outside the volume";
    const TurnedBox turned{turn_, description.geometry.size, box, out};
    const std::vector<Box> parts = samples_->Parts(turned.Stored());
    const std::shared_ptr<Job> job(new Job{samples_, turned, std::move(stop), std::move(done), parts.size()});
    for (const Box& part : parts) {
      const auto bytes = std::uint64_t(samples_->MemoryFor(part, turned));
      try {
        context_->Admit(bytes, [job, part, bytes, context = context_] { Post(context, job, part, bytes); });
      } catch (const std::exception& error) {
        job->Fail(NoMemory(error));
        job->EndPart();
      }
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
      PostRead([job, part, end] {
        job->Run(part);
        end();
      });
    } catch (const std::exception& error) {
      job->Fail(NoMemory(error));
      end();
    }
  }

  const SourceInfo info_;
  const AxisTurn turn_;
  const std::shared_ptr<StoredSamples> samples_;
  const SourceContext context_;
};

// Where the samples lie. None: it must be decoded as a whole.
Result<std::optional<LocatedVolume>> Locate(const VolumeFormat& format, const std::string& path, const ReadOptions& options) {
  if (format.locate == nullptr || options.channel == kLuminance) return std::optional<LocatedVolume>();
  const Result<LocatedSamples> located = format.locate(path, options);
  if (!located.ok() && format.read != nullptr) return std::optional<LocatedVolume>();
  if (!located.ok()) return located.status();
  const RawHeader& header = located->header;
  if (Status status = CheckChannel(path, header, options); !status.ok()) return status;
  const Result<WorldPlacement> placed = PlaceInWorld(header, path);
  if (!placed.ok()) return placed.status();
  if (placed->slant) return std::optional<LocatedVolume>();
  Result<Payload> payload = PayloadOfVolume(path, *located);
  if (!payload.ok()) return payload.status();
  const std::vector<std::filesystem::path> beside = payload->FilesBeside(path);
  const bool in_order = payload->compressed() || !payload->more.empty();
  const Index3 block = {header.size.x, in_order ? header.size.y : 1, 1};  // a slice, or a row: its samples lie together
  SourceInfo info = InfoOfFile(format, path, header, *placed, beside, block, options);
  if (in_order) {
    const auto along = std::size_t(std::ranges::find(placed->turn.from, 2) - placed->turn.from.begin());
    info.slices = SliceOrder{kAxes[along], placed->turn.flipped[along]};
  }
  const int component = header.components > 1 ? options.channel.value_or(0) : 0;
  return std::optional(LocatedVolume{header, *std::move(payload), placed->turn, component, std::move(info)});
}

}  // namespace

Result<std::shared_ptr<VolumeSource>> OpenFile(const VolumeFormat& format, const std::string& path, const ReadOptions& options,
                                               const SourceContext& context) {
  Result<std::optional<LocatedVolume>> found = Locate(format, path, options);
  if (!found.ok()) return found.status();
  if (!*found) return OpenDecoded(format, path, options);
  LocatedVolume& volume = **found;
  if (volume.info.slices)
    return std::shared_ptr<VolumeSource>(std::make_shared<SliceStream>(path, std::move(volume), options.progress, context));
  Result<std::shared_ptr<StoredSamples>> samples = StoredSamples::Open(volume.header, volume.payload, volume.component);
  if (!samples.ok()) return samples.status();
  return std::shared_ptr<VolumeSource>(
      std::make_shared<PositionalSource>(std::move(volume.info), volume.turn, *std::move(samples), context));
}

}  // namespace slabstream
