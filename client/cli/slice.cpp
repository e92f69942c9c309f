// `slice`: a plane through a volume, or a slab of it (slice_request.h).
#include <fmt/format.h>

#include <iostream>
#include <utility>

#include "client/cli/commands.h"
#include "client/cli/service_connection.h"
#include "client/image_io/image_writer.h"
#include "common/base/files.h"

namespace slabstream {

Status RunSlice(const SliceOptions& options) {
  if (Status status = CheckCanWritePicture(options.output); !status.ok()) return status;
  if (Status status = CheckCanWrite("--output", options.output); !status.ok()) return status;
  SliceRequest slice = options.slice;
  slice.frame.dataset = "-";  // not known yet, and the rest is checked before anything is connected
  if (const auto frames = FramesOf(slice); !frames.ok()) return frames.status();
  Result<ServiceConnection> connection = ServiceConnection::Open(options.connection, options.source, options.layers);
  if (!connection.ok()) return connection.status();
  slice.frame.dataset = connection->dataset();
  const Result<std::vector<FrameRequest>> frames = FramesOf(slice);
  if (!frames.ok()) return frames.status();
  std::vector<LocalImage> images;
  for (const FrameRequest& frame : *frames) {
    Result<Picture> picture = connection->client().Render(frame);
    if (!picture.ok()) return picture.status();
    images.push_back(std::move(picture->image));
  }
  const ImageSize whole = slice.size();
  if (Status status = WritePicture(SideBySide(images, slice.frame.size), whole, options.output, slice.format); !status.ok()) return status;
  std::cout << fmt::format("wrote {} {}x{}\n", options.output, whole.width, whole.height);
  return Status::Ok();
}

}  // namespace slabstream
