#include "data/volume_io/volume_writer.h"

#include "common/base/printable.h"
#include "data/volume_io/formats.h"

namespace slabstream {

Status WriteVolume(const Volume& volume, const std::string& path, const WriteOptions& options) {
  const VolumeFormat* const format = FindWritableFormat(path);
  if (format == nullptr) return Printable(Status::InvalidArgument(path + ": volumes are written as " + WritableEndings()));
  const Result<FileSamples> samples = FileSamples::Of(volume, options.exact, options.type, options.progress);
  if (!samples.ok()) return Printable(Status::InvalidArgument(path + ": " + samples.status().message()));
  return format->write(*samples, path);
}

}  // namespace slabstream
