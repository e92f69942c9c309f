// `slice`: a plane through a volume, or a slab of it (slice_request.h).
#include <fmt/format.h>

#include <iostream>
#include <utility>

#include "client/cli/about_pictures.h"
#include "client/cli/commands.h"
#include "client/cli/service_connection.h"
#include "client/pictures/picture_writer.h"
#include "common/files/files.h"

namespace slabstream {

Status RunSlice(const SliceOptions& options) {
  if (Status status = CheckPictureFile(options.output, options.slice.size()); !status.ok()) return status;
  if (Status status = CheckCanWrite("--output", options.output); !status.ok()) return status;
  if (Status status = CheckCanDraw(options.slice.format.annotations); !status.ok()) return status;
  SliceRequest slice = options.slice;
  slice.frame.dataset = "-";  // not known yet, and the rest is checked before anything is connected
  if (const auto frames = FramesOf(slice); !frames.ok()) return frames.status();
  Result<ServiceConnection> connection = ServiceConnection::Open(options.connection, options.source, options.layers);
  if (!connection.ok()) return connection.status();
  slice.frame.dataset = connection->dataset();
  slice.frame.key = slice.format.annotations.needs_key();
  slice.frame.straight8 = FileHoldsStraight8(options.output, slice.format);
  slice.frame.straight8_over = OpaqueBackground(slice.format);
  const Result<std::vector<FrameRequest>> frames = FramesOf(slice);
  if (!frames.ok()) return frames.status();
  if (Status status = CheckCanWritePicture(options.output); !status.ok()) return status;
  PictureNotes notes;
  std::vector<PictureImage> images;
  for (const FrameRequest& frame : *frames) {
    Result<Picture> picture = connection->client().Render(frame);
    if (!picture.ok()) return picture.status();
    images.push_back(std::move(picture->image));
    notes.panes.push_back(picture->geometry);
    notes.key = std::move(picture->key);
  }
  const ImageSize whole = slice.size();
  const PictureImage all = SideBySide(images, slice.frame.size);
  if (Status status = WritePicture(all, whole, options.output, slice.format, notes); !status.ok()) return status;
  WarnOf(connection->client(), frames->front(), all.IsEmpty(), slice.shown_window());
  std::cout << fmt::format("wrote {} {}x{}\n", options.output, whole.width, whole.height);
  return Status::Ok();
}

}  // namespace slabstream
