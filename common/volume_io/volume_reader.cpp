#include "common/volume_io/volume_reader.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <new>
#include <string_view>

#include "common/base/log.h"
#include "common/base/printable.h"
#include "common/volume_io/raw_volume.h"
#include "common/volume_io/text_header.h"

namespace slabstream {
namespace {

struct Format {
  std::string_view ending;
  std::string_view name;
  Result<RawVolume> (*read)(const std::string& path);
};

// The only list. Endings are in lower case.
constexpr std::array<Format, 8> kFormats = {{
    {".nii", "NIfTI", ReadNifti},
    {".nii.gz", "NIfTI", ReadNifti},
    {".nrrd", "NRRD", ReadNrrd},
    {".nhdr", "NRRD", ReadNrrd},
    {".mha", "MetaImage", ReadMetaImage},
    {".mhd", "MetaImage", ReadMetaImage},
    {".tif", "TIFF", ReadTiff},
    {".tiff", "TIFF", ReadTiff},
}};
constexpr const Format& kTiff = kFormats.back();

const Format* FindFormat(const std::string& path) {
  const std::string lower = ToLower(path);
  const auto found = std::find_if(kFormats.begin(), kFormats.end(), [&](const Format& format) { return lower.ends_with(format.ending); });
  return found == kFormats.end() ? nullptr : &*found;
}

// Renderers need a distance. The sign only tells how the axis runs in the scanner; for zero or NaN, 1 is the best guess.
double UsableSpacing(double spacing, const std::string& path) {
  const double distance = std::abs(spacing);
  if (distance > 0 && std::isfinite(distance)) return distance;
  LogWarning(path + ": a spacing of " + std::to_string(spacing) + " is taken as 1");
  return 1;
}

Result<LoadedVolume> Finish(RawVolume raw, const Format& format, const std::string& path) {
  KeptSamples kept = Keep(raw.header.type, std::move(raw.bytes));
  if (!kept.exact) LogWarning(path + ": values of type " + std::string(ToString(raw.header.type)) + " are rounded to " + "float32");

  LoadedVolume loaded;
  VolumeFileInfo& info = loaded.info;
  info.file_type = ToString(raw.header.type);
  info.format = format.name;
  info.origin = raw.header.origin;
  info.directions = raw.header.directions;
  VolumeDescription& description = info.description;
  description.geometry.size = raw.header.size;
  for (const Axis axis : kAxes) description.geometry.spacing[axis] = UsableSpacing(raw.header.spacing[axis], path);
  description.type = kept.type;
  // value = scale * (stored + shift) + offset
  const auto [scale, offset] = raw.header.rescale;
  description.mapping = {scale, scale * kept.shift + offset};

  auto volume = std::make_shared<Volume>();
  volume->description = description;
  volume->block = {description.geometry.bounds(), kept.type, std::move(kept.bytes)};
  loaded.volume = std::move(volume);
  return loaded;
}

}  // namespace

Result<LoadedVolume> ReadVolume(const std::string& path) {
  std::error_code error;
  const auto kind = std::filesystem::status(path, error).type();
  if (kind == std::filesystem::file_type::not_found) return Status::NotFound(path + ": no such file");
  const bool directory = kind == std::filesystem::file_type::directory;
  if (!directory && kind != std::filesystem::file_type::regular) return Status::InvalidArgument(path + ": not a file that can be read");
  const Format* format = directory ? &kTiff : FindFormat(path);
  if (format == nullptr) {
    return Status::InvalidArgument(path + ": not a volume: the name must end in .nii, .nii.gz, .nrrd, .nhdr, .mha, .mhd, .tif or .tiff");
  }
  try {
    Result<RawVolume> raw = format->read(path);
    if (!raw.ok()) return Printable(raw.status());
    return Finish(std::move(*raw), *format, path);
  } catch (const std::bad_alloc&) {
    return Status::ResourceExhausted(path + ": does not fit the memory");
  }
}

bool LooksLikeVolume(const std::string& path) {
  std::error_code error;
  if (std::filesystem::is_directory(path, error)) return !TiffFilesIn(path).empty();
  return FindFormat(path) != nullptr;
}

}  // namespace slabstream
