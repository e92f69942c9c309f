#include "client/decode_picture.h"

#include <algorithm>
#include <string>
#include <utility>

#include "common/image/add_image.h"
#include "common/image/run_image.h"
#include "common/wire/payload.h"

namespace slabstream {
namespace {

struct RunsOfShare {
  const RunImageHeader* header = nullptr;  // valid
  Bytes runs;
};

// Errors of ReadRuns.
Result<LocalImage> PutTogether(const std::vector<RunsOfShare>& shares, const PixelBounds& frame) {
  if (shares.size() == 1) return ReadRuns(*shares.front().header, shares.front().runs.span(), frame);
  PixelBounds bounds;
  for (const RunsOfShare& share : shares) bounds = Union(bounds, share.header->bounds);
  LocalImage picture = MakeLocalImage(shares.front().header->format, bounds);
  for (const auto& [header, runs] : shares) {
    // Shares that were resampled overlap at their seams. They come as floats.
    if (header->color != ColorCoding::kFloat32) {
      if (Status status = ReadRunsInto(*header, runs.span(), frame, picture); !status.ok()) return status;
      continue;
    }
    const Result<LocalImage> share = ReadRuns(*header, runs.span(), frame);
    if (!share.ok()) return share.status();
    AddImage(picture, *share);
  }
  return picture;
}

}  // namespace

Result<Picture> DecodePicture(FrameReply& reply, const std::vector<Bytes>& runs, ImageSize expected) {
  if (reply.size != expected) {
    return Status::DataLoss("FrameReply.size is " + std::to_string(reply.size.width) + "x" + std::to_string(reply.size.height) +
                            ", asked for was " + std::to_string(expected.width) + "x" + std::to_string(expected.height));
  }
  const PixelBounds frame = {0, 0, expected.width, expected.height};
  std::vector<RunsOfShare> shares;
  for (std::size_t share = 0; share < reply.shares.size(); ++share) {
    const RunImageHeader& header = reply.shares[share].runs.image;
    Result<Bytes> unpacked = UnpackRuns(reply.shares[share].runs, runs[share]);
    if (!unpacked.ok()) return unpacked.status();
    if (Status status = ValidateRunHeader(header, frame); !status.ok()) return Status::DataLoss(status.message());
    shares.push_back({&header, *std::move(unpacked)});
  }
  Result<LocalImage> image = PutTogether(shares, frame);
  if (!image.ok()) return Status::DataLoss(image.status().message());
  Picture picture;
  picture.image = *std::move(image);
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
