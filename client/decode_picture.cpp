#include "client/decode_picture.h"

#include <algorithm>
#include <string>
#include <utility>

#include "common/image/add_image.h"
#include "common/image/run_image.h"
#include "common/wire/payload.h"

namespace slabstream {

Result<Picture> DecodePicture(FrameReply& reply, const std::vector<Bytes>& runs, ImageSize expected) {
  if (reply.size != expected) {
    return Status::DataLoss("FrameReply.size is " + std::to_string(reply.size.width) + "x" + std::to_string(reply.size.height) +
                            ", asked for was " + std::to_string(expected.width) + "x" + std::to_string(expected.height));
  }
  const PixelBounds frame = {0, 0, expected.width, expected.height};
  std::vector<LocalImage> shares;
  PixelBounds bounds;
  for (std::size_t share = 0; share < reply.shares.size(); ++share) {
    const EncodedRuns& encoded = reply.shares[share].runs;
    const Result<Bytes> unpacked = UnpackRuns(encoded, runs[share]);
    if (!unpacked.ok()) return unpacked.status();
    Result<LocalImage> image = ReadRuns(encoded.image, unpacked->span(), frame);
    if (!image.ok()) return Status::DataLoss(image.status().message());
    bounds = Union(bounds, image->bounds);
    shares.push_back(*std::move(image));
  }
  Picture picture;
  if (shares.size() == 1) {
    picture.image = std::move(shares.front());
  } else {
    picture.image = MakeLocalImage(shares.front().format, bounds);
    for (const LocalImage& share : shares) AddImage(picture.image, share);
  }
  picture.size = reply.size;
  picture.geometry = reply.geometry;
  picture.final = reply.groups_done == reply.group_count;
  picture.groups_done = reply.groups_done;
  picture.group_count = reply.group_count;
  picture.statistics = std::move(reply.statistics);
  picture.direct = std::ranges::all_of(reply.shares, [](const PictureShare& s) { return s.direct || s.runs.encoded_bytes == 0; }) &&
                   std::ranges::any_of(reply.shares, &PictureShare::direct);
  return picture;
}

}  // namespace slabstream
