#include "client/cli/input_volume.h"

#include <fmt/format.h>

#include <filesystem>

namespace slabstream {

Status CheckVolumePath(const std::string& path) {
  std::error_code error;
  if (!std::filesystem::exists(path, error)) return Status::NotFound(fmt::format("SOURCE '{}' does not exist", path));
  if (LooksLikeVolume(path)) return Status::Ok();
  return Status::InvalidArgument(
      fmt::format("SOURCE '{}' is not a volume: .nii, .nii.gz, .nrrd, .nhdr, .mhd, .mha, .tif, or a directory of .tif slices", path));
}

Result<LoadedVolume> ReadInputVolume(const std::string& path) {
  Result<LoadedVolume> loaded = ReadVolume(path);
  if (loaded.ok() || loaded.status().code() != StatusCode::kDataLoss) return loaded;
  return Status::InvalidArgument(loaded.status().message());
}

}  // namespace slabstream
