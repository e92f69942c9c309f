// SliceStream: a volume whose samples are one compressed stream (.nii.gz, .mgz, gzip NRRD, compressed MetaImage, MRC in .gz), or several,
// which can only be read from the beginning; or samples in several files. As a source it gives any box, but what lies in front of a box is
// read, too: from the last slice that was read if that lies in front of it, else from the beginning. So read boxes of whole slices in the
// order of the file (SourceInfo::slices): then the stream is read once, and nobody holds all of it.
#pragma once

#include <cstdint>
#include <memory>
#include <mutex>
#include <string>

#include "common/base/status.h"
#include "common/memory/aligned_buffer.h"
#include "common/volume/box.h"
#include "data/positional/located_volume.h"
#include "data/sources/read_context.h"

namespace slabstream {

class SliceStream : public VolumeSource {
 public:
  // `progress`, if any, must stay as long as this is read; it counts each slice once.
  SliceStream(std::string path, LocatedVolume volume, ReadProgress* progress, SourceContext context);

  // One level; its block is a slice.
  const SourceInfo& info() const override { return volume_.info; }
  // Takes memory for some slices. DataLoss: truncated or damaged; damage may show only with the last slice.
  void Read(int level, const Box& box, const BoxRoom& out, std::stop_token stop, ReadDone done) override;
  Counts counts() const override;

 private:
  Status ReadBox(const Box& box, const BoxRoom& out, const std::stop_token& stop);
  Status ReadSlices(const Box& box, const BoxRoom& out, const std::stop_token& stop);
  Status Rewind();

  const std::string path_;
  const LocatedVolume volume_;
  const SourceContext context_;
  mutable std::mutex mutex_;  // guards what follows; held while slices are read
  ReadProgress* progress_;    // null: nobody asks
  std::unique_ptr<PayloadStream> stream_;
  std::int32_t next_ = 0;     // slice of the file
  std::int32_t counted_ = 0;  // slices that progress_ knows
  AlignedVector<std::byte> stored_;
  Counts counts_;
};

}  // namespace slabstream
