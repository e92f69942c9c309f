#include "client/cli/input_volume.h"

#include <fmt/format.h>

#include <optional>

#include "data/brick_store/brick_store.h"
#include "data/open/any_volume.h"
#include "data/open/open_source.h"

namespace slabstream {

Status CheckInputVolume(const std::string& source) {
  const Result<SourceText> parsed = ParseSourceText(source);
  return parsed.ok() ? CheckInputVolume(*parsed) : Status(parsed.status().code(), "SOURCE " + parsed.status().message());
}

Status CheckInputVolume(const SourceText& source) {
  const Status status = CheckAnyVolume(source.path, source.options);
  return status.ok() ? status : Status(status.code(), "SOURCE " + status.message());
}

Status CheckInputHeaders(const std::string& source) {
  Result<SourceText> parsed = ParseSourceText(source);
  if (!parsed.ok()) return Status(parsed.status().code(), "SOURCE " + parsed.status().message());
  if (Status status = CheckInputVolume(*parsed); !status.ok()) return status;
  parsed->options.describe = true;
  return AsInput(CheckAnyVolumeHeaders(parsed->path, parsed->options).status());
}

bool CanBeReadInParts(const std::string& source, std::uint64_t most_bytes) {
  Result<SourceText> parsed = ParseSourceText(source);
  if (!parsed.ok()) return false;
  parsed->options.describe = true;
  if (IsReadInParts(parsed->path, parsed->options)) return true;
  const Result<std::optional<SourceInfo>> stream = DescribeStream(parsed->path, parsed->options);
  return stream.ok() && *stream && std::uint64_t((*stream)->levels.front().description.voxel_bytes()) > most_bytes;
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

Result<LoadedVolume> ReadInputVolume(const SourceText& source) {
  Result<LoadedVolume> loaded = ReadAnyVolume(source.path, source.options);
  if (!loaded.ok()) return AsInput(loaded.status());
  return loaded;
}

}  // namespace slabstream
