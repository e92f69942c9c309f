#include "data/positional/decoded_source.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <mutex>
#include <new>
#include <optional>
#include <shared_mutex>
#include <span>
#include <utility>

#include "common/base/check.h"
#include "common/base/printable.h"
#include "common/volume/memory_budget.h"
#include "data/positional/located_volume.h"
#include "data/positional/turned_box.h"
#include "data/sources/copy_samples.h"
#include "data/volume_io/exact_samples.h"
#include "data/volume_io/raw_volume.h"
#include "data/volume_io/world_placement.h"

namespace slabstream {
namespace {

// The sample of the lowest data value that there is: what lies outside a volume.
double LowestSample(const RawVolume& raw) {
  return VisitSampleType(raw.header.type, [&]<class T>(const T*) {
    double least = 0, greatest = 0;
    bool any = false;
    for (const T sample : std::span(reinterpret_cast<const T*>(raw.bytes.data()), raw.bytes.size() / sizeof(T))) {
      if (!std::isfinite(double(sample))) continue;
      least = any ? std::min(least, double(sample)) : double(sample);
      greatest = any ? std::max(greatest, double(sample)) : double(sample);
      any = true;
    }
    return raw.header.rescale.scale < 0 ? greatest : least;
  });
}

// The sample of label 0, or the nearest one that there is: what lies outside a label volume.
double SampleOfNoLabel(const RawHeader& header) {
  return VisitSampleType(header.type, [&]<class T>(const T*) {
    const double sample = -header.rescale.offset / header.rescale.scale;
    return std::clamp(sample, double(std::numeric_limits<T>::lowest()), double(std::numeric_limits<T>::max()));
  });
}

// Turns and straightens the samples.
Status Place(RawVolume& raw, const WorldPlacement& placed, bool labels, const std::string& path) {
  const SampleType type = raw.header.type;
  const Index3& stored = raw.header.size;
  const auto& from = placed.turn.from;
  const Box all = {{}, {stored[from[0]], stored[from[1]], stored[from[2]]}};
  if (placed.turn != AxisTurn{}) {
    if (Status status = CheckFitsMemory(std::int64_t(raw.bytes.size()), path); !status.ok()) return status;
    AlignedVector<std::byte> turned(raw.bytes.size());
    const TurnedBox to{placed.turn, all.end, all, BoxRoom::Dense(all, turned.data(), true)};
    to.Fill({{}, stored}, type, raw.bytes.data(), {1, stored.x, std::int64_t{stored.x} * stored.y});
    raw.bytes = std::move(turned);
  }
  if (placed.slant) {
    const std::int64_t bytes = placed.geometry.bounds().voxel_count() * std::int64_t(BytesPerSample(type));
    if (Status status = CheckFitsMemory(bytes, path); !status.ok()) return status;
    raw.bytes = StraightenVoxels(type, raw.bytes, all.end, *placed.slant, placed.geometry.size,
                                 labels ? SampleOfNoLabel(raw.header) : LowestSample(raw), labels ? Sampling::kNearest : Sampling::kLinear);
  }
  return Status::Ok();
}

// A volume as its format decodes it, and its description.
struct Decoded {
  RawVolume raw;
  SourceInfo info;
};

Result<Decoded> Decode(const VolumeFormat& format, const std::string& path, const ReadOptions& options) try {
  const auto read = [&]() -> Result<RawVolume> {
    if (format.read != nullptr) return format.read(path, options);
    const Result<LocatedSamples> located = format.locate(path, options);
    return located.ok() ? ReadSamples(path, *located, options) : located.status();
  };
  Result<RawVolume> raw = read();
  if (!raw.ok()) return Printable(raw.status());
  const Result<WorldPlacement> placed = PlaceInWorld(raw->header, path);
  if (!placed.ok()) return placed.status();
  SourceInfo info = InfoOfFile(std::string(format.name), path, raw->header, *placed, raw->other_files, raw->header.size, options);
  info.whole = true;
  info.levels.front().block = placed->geometry.size;
  if (!options.headers_only) {
    TakeChannel(*raw, options);
    if (Status status = Place(*raw, *placed, info.labels, path); !status.ok()) return status;
  }
  return Decoded{*std::move(raw), std::move(info)};
} catch (const std::bad_alloc&) {
  return Status::ResourceExhausted(path + ": does not fit the memory");
}

class DecodedSource : public VolumeSource {
 public:
  DecodedSource(const VolumeFormat& format, std::string path, ReadOptions options, Decoded opened)
      : format_(format), path_(std::move(path)), options_(std::move(options)), info_(std::move(opened.info)) {
    options_.headers_only = false;
    if (!opened.raw.bytes.empty()) decoded_ = std::move(opened.raw);
  }

  const SourceInfo& info() const override { return info_; }
  Counts counts() const override { return {}; }

  using VolumeSource::Read;
  void Read(int level, const Box& box, const BoxRoom& out, std::stop_token stop, ReadDone done) override {
    const Index3& size = info_.finest().geometry.size;
    CHECK(level == 0 && !box.empty() && info_.finest().geometry.bounds().Contains(box)) << "a box outside the volume";
    if (stop.stop_requested()) return done(Status::Cancelled(path_ + ": reading was cancelled"));
    Status status;
    {
      std::shared_lock reading(mutex_);  // while it is held, nobody takes what is decoded
      while (status.ok() && !decoded_) {
        reading.unlock();
        status = Keep();
        reading.lock();
      }
      if (status.ok()) {
        const std::array<std::int64_t, 3> steps = {1, size.x, std::int64_t{size.x} * size.y};
        const SampleType type = info_.exact.type;
        CopySamples(type, decoded_->bytes.data() + NumberIn(size, box.begin) * BytesPerSample(type), steps, box.size(), out);
      }
    }
    done(status);
  }

 private:
  Result<RawVolume> DecodeNow() const {
    Result<Decoded> decoded = Decode(format_, path_, options_);
    if (!decoded.ok()) return decoded.status();
    // Other files than those that were opened.
    if (decoded->info.finest() != info_.finest() || decoded->info.exact.type != info_.exact.type) {
      return Status::Unavailable(path_ + ": has changed since it was opened");
    }
    return std::move(decoded->raw);
  }

  // Decodes the volume, unless that is done.
  Status Keep() {
    const std::lock_guard lock(mutex_);
    if (decoded_) return Status::Ok();
    Result<RawVolume> raw = DecodeNow();
    if (raw.ok()) decoded_ = *std::move(raw);
    return raw.status();
  }

  Result<LevelInMemory> DoReadLevel(int level, ReadProgress* /*progress*/, const LevelWanted& wanted) override try {
    CHECK_EQ(level, 0);
    std::optional<RawVolume> raw;
    {
      const std::lock_guard lock(mutex_);
      raw.swap(decoded_);
    }
    if (!raw) {
      Result<RawVolume> decoded = DecodeNow();
      if (!decoded.ok()) return decoded.status();
      raw = *std::move(decoded);
    }
    const ExactType& stored = info_.exact;
    if (stored.type == SampleType::kFloat16) {  // the type that grows
      if (Status status = CheckFitsMemory(2 * std::int64_t(raw->bytes.size()), path_); !status.ok()) return status;
    }
    KeptSamples kept = KeepBeside(stored.type, raw->bytes);
    LevelInMemory level_in_memory;
    FloatReach reach;
    if (stored.type == SampleType::kFloat64) {
      reach.Add({reinterpret_cast<const double*>(raw->bytes.data()), raw->bytes.size() / sizeof(double)});
    }
    if (MayBeRounded(stored.type)) {
      level_in_memory.exact = std::make_shared<const ExactSamples>(ExactSamples{stored, std::move(raw->bytes)});
      if (!kept.exact) level_in_memory.rounding = RoundingText(stored.type, level_in_memory.exact.get(), reach);
      if (!wanted.all_exact && (kept.exact || !MayRoundLabels(stored.type))) level_in_memory.exact = nullptr;
    }
    auto volume = std::make_shared<Volume>();
    volume->description = info_.finest();
    volume->description.type = kept.type;
    volume->description.mapping = {stored.mapping.scale, stored.mapping.FromStored(kept.shift)};
    volume->block = {volume->description.geometry.bounds(), kept.type, std::move(kept.bytes)};
    volume->cells = std::move(raw->cells);
    level_in_memory.cells = std::move(raw->stored_cells);
    level_in_memory.volume = std::move(volume);
    return level_in_memory;
  } catch (const std::bad_alloc&) {
    return Status::ResourceExhausted(path_ + ": does not fit the memory");
  }

  const VolumeFormat& format_;
  const std::string path_;
  ReadOptions options_;
  const SourceInfo info_;
  std::shared_mutex mutex_;  // guards what follows; held while it is decoded, and shared while it is copied
  std::optional<RawVolume> decoded_;
};

}  // namespace

Result<std::shared_ptr<VolumeSource>> OpenDecoded(const VolumeFormat& format, const std::string& path, const ReadOptions& options) {
  ReadOptions of_headers = options;
  of_headers.headers_only = true;
  Result<Decoded> opened = Decode(format, path, of_headers);
  if (opened.ok() && opened->raw.size_unknown && !options.headers_only) opened = Decode(format, path, options);
  if (!opened.ok()) return opened.status();
  return std::shared_ptr<VolumeSource>(std::make_shared<DecodedSource>(format, path, options, *std::move(opened)));
}

}  // namespace slabstream
