#include "client/cli/input_volume.h"

#include "data/open/open_source.h"
#include "data/volume_io/formats.h"

namespace slabstream {

Status CheckInputVolume(const std::string& source) {
  const Result<SourceText> parsed = ParseSourceText(source);
  return parsed.ok() ? CheckInputVolume(*parsed) : Status(parsed.status().code(), "SOURCE " + parsed.status().message());
}

Status CheckInputVolume(const SourceText& source) {
  const Status status = CheckVolume(source.path, source.options);
  return status.ok() ? status : Status(status.code(), "SOURCE " + status.message());
}

Status CheckInputHeaders(const std::string& source) {
  Result<SourceText> parsed = ParseSourceText(source);
  if (!parsed.ok()) return Status(parsed.status().code(), "SOURCE " + parsed.status().message());
  if (Status status = CheckInputVolume(*parsed); !status.ok()) return status;
  parsed->options.describe = true;
  return AsInput(CheckVolumeHeaders(parsed->path, parsed->options).status());
}

Result<bool> CanBeReadInParts(const std::string& source, std::uint64_t most_bytes) {
  Result<SourceText> parsed = ParseSourceText(source);
  if (!parsed.ok()) return parsed.status();
  const VolumeFormat* const format = FindFormat(parsed->path, parsed->options);
  if (format != nullptr && format->open == nullptr && format->locate == nullptr) return false;
  parsed->options.describe = parsed->options.headers_only = true;
  const Result<std::shared_ptr<VolumeSource>> opened = OpenSource(parsed->path, parsed->options, ProcessReadContext());
  if (!opened.ok()) return AsInput(opened.status());
  const SourceInfo& info = (*opened)->info();
  return info.in_parts() || (info.slices && std::uint64_t(info.finest().voxel_bytes()) > most_bytes);
}

Status AsInput(const Status& status) { return status.code() == StatusCode::kDataLoss ? Status::InvalidArgument(status.message()) : status; }

Result<LoadedVolume> ReadInputVolume(const std::string& source, const TellRead& tell) {
  Result<SourceText> parsed = ParseSourceText(source);
  if (!parsed.ok()) return parsed.status();
  ReadProgress progress(tell);
  parsed->options.progress = &progress;
  parsed->options.describe = true;
  return ReadInputVolume(*parsed);
}

Result<LoadedVolume> ReadInputVolume(const SourceText& source, bool all_exact) {
  Result<LoadedVolume> loaded = ReadVolume(source.path, source.options, all_exact);
  if (!loaded.ok()) return AsInput(loaded.status());
  return loaded;
}

}  // namespace slabstream
