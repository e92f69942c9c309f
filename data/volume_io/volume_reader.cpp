#include "data/volume_io/volume_reader.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <new>
#include <span>

#include "common/base/log.h"
#include "common/base/printable.h"
#include "common/volume/memory_budget.h"
#include "data/volume_io/exact_samples.h"
#include "data/volume_io/file_parts.h"
#include "data/volume_io/formats.h"
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
Status Place(RawVolume& raw, const WorldPlacement& placed, const std::string& path) {
  const SampleType type = raw.header.type;
  if (placed.turn != AxisTurn{}) {
    if (Status status = CheckFitsMemory(std::int64_t(raw.bytes.size()), path); !status.ok()) return status;
    raw.bytes = TurnVoxels(type, raw.bytes, raw.header.size, placed.turn);
  }
  if (placed.slant) {
    const std::int64_t bytes = placed.geometry.bounds().voxel_count() * std::int64_t(BytesPerSample(type));
    if (Status status = CheckFitsMemory(bytes, path); !status.ok()) return status;
    const auto& from = placed.turn.from;
    const Index3 slanted = {raw.header.size[from[0]], raw.header.size[from[1]], raw.header.size[from[2]]};
    raw.bytes = StraightenVoxels(type, raw.bytes, slanted, *placed.slant, placed.geometry.size,
                                 raw.header.labels ? SampleOfNoLabel(raw.header) : LowestSample(raw),
                                 raw.header.labels ? Sampling::kNearest : Sampling::kLinear);
  }
  return Status::Ok();
}

Result<LoadedVolume> Finish(RawVolume raw, const VolumeFormat& format, const std::string& path, const ReadOptions& options) {
  raw.header.labels = raw.header.labels || options.labels;
  const Result<WorldPlacement> placed = PlaceInWorld(raw.header, path);
  if (!placed.ok()) return placed.status();
  if (Status status = Place(raw, *placed, path); !status.ok()) return status;
  const ExactType stored = {raw.header.type, raw.header.rescale};
  if (stored.type == SampleType::kFloat16) {  // the type that grows
    if (Status status = CheckFitsMemory(2 * std::int64_t(raw.bytes.size()), path); !status.ok()) return status;
  }
  KeptSamples kept = KeepBeside(stored.type, raw.bytes);
  LoadedVolume loaded;
  VolumeFileInfo& info = loaded.info;
  info.file_type = ToString(raw.header.type);
  info.format = format.name;
  info.stored_size = raw.header.size;
  info.steps = raw.header.steps;
  info.straightened = placed->slant.has_value();
  info.labels = raw.header.labels;
  info.channels = std::move(raw.header.channels);
  info.channel = raw.header.channel;
  info.times = int(raw.header.volumes);
  info.time = int(raw.header.number);
  info.notes = std::move(raw.header.notes);
  info.other_files = std::move(raw.other_files);
  VolumeDescription& description = info.description;
  description.geometry = placed->geometry;
  description.type = kept.type;
  // value = scale * (stored + shift) + offset
  const auto [scale, offset] = raw.header.rescale;
  description.mapping = {scale, scale * kept.shift + offset};

  auto volume = std::make_shared<Volume>();
  volume->description = description;
  volume->block = {description.geometry.bounds(), kept.type, std::move(kept.bytes)};
  volume->cells = std::move(raw.cells);
  if (MayBeRounded(stored.type)) loaded.exact = std::make_shared<const ExactSamples>(ExactSamples{stored, std::move(raw.bytes)});
  loaded.rounded = !kept.exact;
  loaded.volume = std::move(volume);
  return loaded;
}

Result<RawVolume> ReadAs(const VolumeFormat& format, const std::string& path, const ReadOptions& options) {
  if (format.read != nullptr) return format.read(path, options);
  const Result<LocatedSamples> located = format.locate(path, options);
  return located.ok() ? ReadSamples(path, *located, options) : located.status();
}

struct ReadFile {
  RawVolume raw;
  const VolumeFormat* format = nullptr;
};

Result<ReadFile> ReadRaw(const std::string& path, const ReadOptions& options) {
  if (Status status = CheckVolume(path, options); !status.ok()) return status;
  const VolumeFormat* const format = FindFormat(path, options);
  Result<RawVolume> raw = ReadAs(*format, path, options);
  if (!raw.ok()) return Printable(raw.status());
  return ReadFile{std::move(*raw), format};
}

// What `read` returns, unless there is not enough memory.
template <class Read>
auto WithinMemory(const std::string& path, Read&& read) -> decltype(read()) {
  try {
    return read();
  } catch (const std::bad_alloc&) {
    return Status::ResourceExhausted(path + ": does not fit the memory");
  }
}

}  // namespace

Result<LoadedVolume> ReadVolume(const std::string& path, const ReadOptions& options) {
  return WithinMemory(path, [&]() -> Result<LoadedVolume> {
    Result<ReadFile> file = ReadRaw(path, options);
    if (!file.ok()) return file.status();
    if (const FileParts components{.components = file->raw.header.components}; options.describe) {
      for (const std::string& text : ShownTexts(path, components, options)) LogWarning(text);
    }
    TakeChannel(file->raw, options);
    return Finish(std::move(file->raw), *file->format, path, options);
  });
}

Result<std::vector<std::string>> CheckVolumeHeaders(const std::string& path, const ReadOptions& options) {
  return WithinMemory(path, [&]() -> Result<std::vector<std::string>> {
    ReadOptions of_headers = options;
    of_headers.headers_only = true;
    const Result<ReadFile> file = ReadRaw(path, of_headers);
    if (!file.ok()) return file.status();
    if (const auto placed = PlaceInWorld(file->raw.header, path); !placed.ok()) return placed.status();
    std::vector<std::string> files = {path};
    for (const std::filesystem::path& other : file->raw.other_files) files.push_back(other.string());
    return files;
  });
}

Result<FileParts> PartsOf(const std::string& path, const ReadOptions& options) {
  return WithinMemory(path, [&]() -> Result<FileParts> {
    ReadOptions of_headers = options;
    of_headers.headers_only = true;
    const Result<ReadFile> file = ReadRaw(path, of_headers);
    if (!file.ok()) return file.status();
    const RawHeader& header = file->raw.header;
    return FileParts{int(header.volumes), int(header.number), header.channels, header.channel, header.components};
  });
}

Status CheckVolume(const std::string& path, const ReadOptions& options) {
  std::error_code error;
  const auto kind = std::filesystem::status(path, error).type();
  if (kind == std::filesystem::file_type::not_found) return Printable(Status::NotFound(path + ": no such file"));
  if (kind != std::filesystem::file_type::directory && kind != std::filesystem::file_type::regular) {
    return Printable(Status::InvalidArgument(path + ": not a file that can be read"));
  }
  const VolumeFormat* const format = FindFormat(path, options);
  if (format == nullptr) {
    const std::string_view why = WhyUnread(path);
    return Printable(Status::InvalidArgument(path + ": " + (why.empty() ? "not a volume, which " + ReadableText() : std::string(why))));
  }
  return Printable(CheckOptions(*format, path, options));
}

bool LooksLikeVolume(const std::string& path) { return CheckVolume(path).ok(); }

}  // namespace slabstream
