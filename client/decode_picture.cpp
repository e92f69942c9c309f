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

PixelBounds BoundsOf(const std::vector<RunsOfShare>& shares) {
  PixelBounds bounds;
  for (const RunsOfShare& share : shares) bounds = Union(bounds, share.header->bounds);
  return bounds;
}

// Errors of ReadRuns.
Result<PictureImage> PutCodesTogether(const std::vector<RunsOfShare>& shares, const PixelBounds& frame, const std::optional<Rgb>& over) {
  StraightImage picture = MakeStraightImage(BoundsOf(shares), over ? Premultiplied{over->r, over->g, over->b, 1} : Premultiplied{});
  for (const auto& [header, runs] : shares) {
    if (Status status = ReadCodesInto(*header, runs.span(), frame, picture); !status.ok()) return status;
  }
  return PictureImage(std::move(picture));
}

// Errors of ReadRuns.
Result<PictureImage> PutTogether(const std::vector<RunsOfShare>& shares, const PixelBounds& frame, const std::optional<Rgb>& over) {
  const auto is_code = [](const RunsOfShare& share) { return share.header->color == ColorCoding::kStraight8; };
  if (std::ranges::all_of(shares, is_code)) return PutCodesTogether(shares, frame, over);
  const auto read = [&](const RunsOfShare& share) { return ReadRuns(*share.header, share.runs.span(), frame); };
  if (shares.size() == 1) {
    Result<LocalImage> picture = read(shares.front());
    if (!picture.ok()) return picture.status();
    return PictureImage(*std::move(picture));
  }
  LocalImage picture = MakeLocalImage(shares.front().header->format, BoundsOf(shares));
  for (const RunsOfShare& each : shares) {
    const Result<LocalImage> share = read(each);
    if (!share.ok()) return share.status();
    AddImage(picture, *share);  // shares that were resampled overlap at their seams
  }
  return PictureImage(std::move(picture));
}

}  // namespace

Result<Picture> DecodePicture(FrameReply& reply, const std::vector<Bytes>& runs, const FrameRequest& asked) {
  const ImageSize expected = asked.size;
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
  Result<PictureImage> image = PutTogether(shares, frame, asked.straight8_over);
  if (!image.ok()) return Status::DataLoss(image.status().message());
  Picture picture;
  picture.image = *std::move(image);
  picture.size = reply.size;
  picture.geometry = reply.geometry;
  picture.key = std::move(reply.key);
  picture.final = reply.groups_done == reply.group_count;
  picture.groups_done = reply.groups_done;
  picture.group_count = reply.group_count;
  picture.statistics = std::move(reply.statistics);
  picture.direct = std::ranges::all_of(reply.shares, [](const PictureShare& s) { return s.direct || s.runs.encoded_bytes == 0; }) &&
                   std::ranges::any_of(reply.shares, &PictureShare::direct);
  return picture;
}

}  // namespace slabstream
