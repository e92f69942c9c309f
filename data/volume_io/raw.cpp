// Raw samples without a header: options say what they are.
#include <fmt/format.h>

#include "common/base/log.h"
#include "data/volume_io/formats.h"

namespace slabstream {
namespace {

// Files of any name whose dimensions are given.
bool Recognises(const std::string&, const ReadOptions& options) { return options.dims.has_value(); }

Result<LocatedSamples> Locate(const std::string& path, const ReadOptions& options) {
  RawHeader header{.size = *options.dims, .type = *options.type};
  header.steps = StepsOf(options.spacing.value_or(Vec3{1, 1, 1}));
  Payload payload{.file = path, .offset = options.offset.value_or(0), .big_endian = options.big_endian.value_or(false)};
  std::error_code error;
  const auto file_bytes = std::int64_t(std::filesystem::file_size(path, error));
  // Wrong options read something as well, so say what does not add up.
  if (const std::int64_t used = payload.offset + header.sample_bytes(); !error && file_bytes > used) {
    LogWarning(fmt::format("{}: has {} bytes, of which its dims, type and offset use {}", path, file_bytes, used));
  }
  return LocatedSamples{header, std::move(payload)};
}

}  // namespace

VolumeFormat Raw() {
  return {.name = "raw",
          .endings = {".raw"},
          .also = "any file with --dims and --type",
          .recognises = Recognises,
          .options = {"dims", "type", "spacing", "endian", "offset"},
          .required = {"dims", "type"},
          .locate = Locate};
}

}  // namespace slabstream
