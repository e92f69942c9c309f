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
  return CheckVolumeHeaders(parsed->path, parsed->options).status();
}

Result<LoadedVolume> ReadInputVolume(const std::string& source) {
  Result<SourceText> parsed = ParseSourceText(source);
  if (!parsed.ok()) return parsed.status();
  parsed->options.describe = true;
  return ReadInputVolume(*parsed);
}

Result<LoadedVolume> ReadInputVolume(const SourceText& source, bool all_exact) {
  return ReadVolume(source.path, source.options, all_exact);
}

}  // namespace slabstream
