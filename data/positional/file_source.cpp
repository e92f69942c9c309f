#include "data/positional/file_source.h"

#include <algorithm>
#include <exception>
#include <optional>
#include <utility>

#include "common/base/check.h"
#include "common/base/printable.h"
#include "data/positional/decoded_source.h"
#include "data/positional/located_volume.h"
#include "data/positional/packed_source.h"
#include "data/positional/slice_stream.h"
#include "data/positional/stored_samples.h"
#include "data/sources/box_reading.h"
#include "data/stores/read_threads.h"

namespace slabstream {
namespace {

Status NoMemory(const std::exception& error) {
  return Status::ResourceExhausted(std::string("a part of a volume cannot be read: ") + error.what());
}

// A part of a box for which there is room.
struct Part {
  std::shared_ptr<BoxReading> reading;
  std::shared_ptr<StoredSamples> samples;
  TurnedBox turned;
  Box part;
  SourceContext context;
  std::uint64_t bytes = 0;

  // Throws nothing.
  void Begin() const {
    try {
      PostRead([self = *this] {
        self.Read();
        self.End();
      });
    } catch (const std::exception& error) {
      reading->Fail(NoMemory(error));
      End();
    }
  }

 private:
  void Read() const {
    if (!reading->goes_on()) return reading->GiveUp();
    try {
      if (const Status status = samples->Read(part, turned); !status.ok()) reading->Fail(Printable(status));
    } catch (const std::exception& error) {
      reading->Fail(NoMemory(error));
    }
  }
  void End() const {
    context->Release(bytes);
    reading->EndPart();
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
    const auto reading = std::make_shared<BoxReading>(turned.Stored(), out, std::move(stop), std::move(done));
    for (const Box& box_of_part : samples_->Parts(reading->box())) {
      const auto bytes = std::uint64_t(samples_->MemoryFor(box_of_part, turned));
      reading->BeginPart();
      try {
        context_->Admit(bytes, [part = Part{reading, samples_, turned, box_of_part, context_, bytes}] { part.Begin(); });
      } catch (const std::exception& error) {
        reading->Fail(NoMemory(error));
        reading->EndPart();
      }
    }
    reading->EndPart();
  }

 private:
  const SourceInfo info_;
  const AxisTurn turn_;
  const std::shared_ptr<StoredSamples> samples_;
  const SourceContext context_;
};

// What a header says. None: it must be decoded as a whole.
Result<std::optional<LocatedVolume>> Described(const std::string& format, const std::string& path, const LocatedSamples& located,
                                               const ReadOptions& options) {
  const RawHeader& header = located.header;
  if (Status status = CheckChannel(path, header, options); !status.ok()) return status;
  const Result<WorldPlacement> placed = PlaceInWorld(header, path);
  if (!placed.ok()) return placed.status();
  if (placed->slant) return std::optional<LocatedVolume>();
  Result<Payload> payload = located.packed != nullptr ? located.payload : PayloadOfVolume(path, located);
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
  return std::optional(LocatedVolume{header, *std::move(payload), located.packed, placed->turn, component, std::move(info)});
}

Result<std::shared_ptr<VolumeSource>> OpenDescribed(const std::string& path, LocatedVolume volume, const ReadOptions& options,
                                                    const SourceContext& context) {
  if (volume.packed != nullptr) return OpenPacked(path, std::move(volume), context);
  if (volume.info.slices)
    return std::shared_ptr<VolumeSource>(std::make_shared<SliceStream>(path, std::move(volume), options.progress, context));
  Result<std::shared_ptr<StoredSamples>> samples = StoredSamples::Open(volume.header, volume.payload, volume.component);
  if (!samples.ok()) return samples.status();
  return std::shared_ptr<VolumeSource>(
      std::make_shared<PositionalSource>(std::move(volume.info), volume.turn, *std::move(samples), context));
}

}  // namespace

Result<std::shared_ptr<VolumeSource>> OpenFile(const VolumeFormat& format, const std::string& path, const ReadOptions& options,
                                               const SourceContext& context) {
  if (format.locate == nullptr || options.channel == kLuminance) return OpenDecoded(format, path, options);
  const Result<LocatedSamples> located = format.locate(path, options);
  if (located.status().code() == StatusCode::kInvalidArgument && format.read != nullptr) return OpenDecoded(format, path, options);
  if (!located.ok()) return located.status();
  Result<std::optional<LocatedVolume>> found = Described(std::string(format.name), path, *located, options);
  if (!found.ok()) return found.status();
  return *found ? OpenDescribed(path, **std::move(found), options, context) : OpenDecoded(format, path, options);
}

}  // namespace slabstream
