// Pictures as messages for a page (docs/http.md): from what the service rendered to the bytes of a binary message. Any thread.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "client/client.h"
#include "client/pictures/picture_writer.h"
#include "client/request/json_value.h"
#include "common/base/status.h"
#include "gateway/picture_coding.h"
#include "gateway/video_encoder.h"

namespace slabstream {

// A picture of a view, with all that is said about it.
struct RenderedView {
  std::uint64_t seq = 0;
  double scale = 1;
  double coarseness = 1;  // how coarse the picture is; 1: a smaller number would change nothing
  ImageSize size;         // the size of the whole picture
  PictureImage image;
  PictureFormat format;
  PictureKey key;
  std::vector<PictureGeometry> panes;  // one for each of the pictures side by side
  FrameStatistics statistics;          // the statistics of the leftmost picture
  Duration latency{};
  bool timeline = false;
};

// Takes the pictures of the frames of a view, at least one, from left to right; `size` is that of each.
RenderedView JoinPictures(std::vector<Picture> pictures, ImageSize size);

struct EncodedView {
  std::uint64_t seq = 0;
  Json header;  // but for "frame" and "round_trip_ms", which are known when it is sent
  std::shared_ptr<const std::vector<std::byte>> bytes;
  Duration encoding{};
  const char* type = "jpeg";  // for Metrics
};

// `quality`: of JPEG. `video`: takes the picture if it is to be video. Cancelled: `given_up` became true. NotFound: the font of
// annotations. Internal: libvpx.
Result<EncodedView> EncodeView(const RenderedView& view, PictureCoding coding, int quality, VideoEncoder& video,
                               const std::atomic<bool>& given_up);

// What comes before the encoded rectangle in the message.
std::string HeadOf(Json header, std::uint64_t frame, Duration round_trip);

Json StatisticsJson(const FrameStatistics& statistics, Duration latency, bool timeline);

}  // namespace slabstream
