// SliceStream: a volume whose samples are one compressed stream (.nii.gz, gzip NRRD, compressed MetaImage, MRC in .gz), which can only be
// read from its beginning. It is read once, some slices at a time, so that they can be written elsewhere and nobody holds all of them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <stop_token>
#include <string>

#include "common/base/status.h"
#include "common/volume/box.h"
#include "data/positional/located_volume.h"

namespace slabstream {

class SliceStream {
 public:
  // Whether `path` is such a volume, by its header.
  static bool Recognises(const std::string& path);
  // Reads the header. Errors of LocateVolume.
  static Result<SliceStream> Open(const std::string& path, const ReadOptions& options);

  // Like a source of one level that has all samples.
  const SourceInfo& info() const { return volume_.info; }
  // Along which axis of the volume the slices of the file lie.
  Axis along() const;

  // Some slices, as a box of the volume with its samples, x fastest, of the type that info() says. They are good until it returns.
  using Take = std::function<Status(const Box& box, std::span<const std::byte> samples)>;
  // Calls `take` for `slices` slices of the file at a time, until all are read or it fails, which ends this. Boxes lie at multiples of
  // `slices` and cover the volume, from its beginning or from its end, as the file has them. Memory: those slices as they are stored and as
  // they are kept. DataLoss: truncated or damaged, which may show only at the end. Cancelled; ResourceExhausted. Waits.
  Status Read(std::int32_t slices, const Take& take, std::stop_token stop = {}) const;

 private:
  SliceStream(std::string path, LocatedVolume volume) : path_(std::move(path)), volume_(std::move(volume)) {}
  Status ReadAll(std::int32_t slices, const Take& take, const std::stop_token& stop) const;

  std::string path_;
  LocatedVolume volume_;
};

}  // namespace slabstream
