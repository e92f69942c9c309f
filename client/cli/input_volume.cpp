#include "client/cli/input_volume.h"

#include <fmt/format.h>

#include "data/catalogue/shape_data.h"
#include "data/open/open_source.h"
#include "data/volume_io/formats.h"

namespace slabstream {

Status CheckInputVolume(const std::string& source) {
  const Result<SourceText> parsed = ParseSourceText(source);
  return parsed.ok() ? CheckInputVolume(*parsed) : Status(parsed.status().code(), "SOURCE " + parsed.status().message());
}

Status CheckInputVolume(const SourceText& source) {
  if (NamesShape(source.path)) {
    return Status::InvalidArgument(
        fmt::format("SOURCE {} is a mesh, lines or points, which show beside a volume: --mesh {}", source.path, source.path));
  }
  const Status status = CheckVolume(source.path, source.options);
  return status.ok() ? status : Status(status.code(), "SOURCE " + status.message());
}

Status CheckLevel(int level, const SourceInfo& info, const std::string& path) {
  const std::size_t levels = info.levels.size();
  if (std::size_t(level) < levels) return Status::Ok();
  return Status::InvalidArgument(levels == 1 ? fmt::format("--level is {}, but '{}' has level 0 alone", level, path)
                                             : fmt::format("--level is {}, but '{}' has levels 0 to {}", level, path, levels - 1));
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
