#include "gateway/frame_message.h"

#include <algorithm>
#include <array>
#include <utility>

#include "client/report/frame_spans.h"
#include "client/report/frame_summary.h"
#include "client/request/camera_file.h"
#include "client/request/picture_record.h"
#include "client/request/slice_request.h"

namespace slabstream {
namespace {

constexpr std::size_t kMaxTimelineEntries = 4096;

Json TimelineJson(const FrameStatistics& statistics) {
  Json entries = Json::array();
  for (const StageSpan& span : StageSpans(statistics)) {
    if (entries.size() == kMaxTimelineEntries) break;
    entries.push_back({{"worker", span.worker},
                       {"group", span.group},
                       {"stage", ToString(span.stage)},
                       {"begin_ms", Milliseconds(span.begin_ns - statistics.begin_ns)},
                       {"end_ms", Milliseconds(span.end_ns - statistics.begin_ns)}});
  }
  return entries;
}

}  // namespace

Json StatisticsJson(const FrameStatistics& statistics, Duration latency, bool timeline) {
  const FrameSummary summary = Summarize(statistics);
  Json json = {{"latency_ms", Milliseconds(latency.count())},
               {"queued_ms", Milliseconds(statistics.queued_ns)},
               {"attempts", statistics.attempts},
               {"workers", statistics.workers},
               {"groups", statistics.groups},
               {"imbalance", summary.imbalance},
               {"idle_share", summary.idle_share},
               {"levels", LevelsJson(statistics)},
               {"bytes", BytesJson(summary)},
               {"stages_ms", StagesJson(summary)},
               {"plan",
                {{"renderer", statistics.renderer},
                 {"decomposition", statistics.decomposition},
                 {"axis", statistics.axis},
                 {"assignment", statistics.assignment},
                 {"balance", statistics.balance},
                 {"combine", statistics.combine},
                 {"balance_by", statistics.balance_by}}}};
  if (!statistics.lowered.empty()) json["lowered"] = statistics.lowered;
  if (!statistics.missing.empty()) json["missing"] = statistics.missing;
  if (timeline) json["timeline"] = TimelineJson(statistics);
  return json;
}

RenderedView JoinPictures(std::vector<Picture> pictures, ImageSize size) {
  RenderedView view;
  for (const Picture& picture : pictures) view.panes.push_back(picture.geometry);
  view.key = std::move(pictures.front().key);
  view.statistics = std::move(pictures.front().statistics);
  for (const Picture& picture : pictures) view.latency = std::max(view.latency, picture.latency);
  view.size = {size.width * int(pictures.size()), size.height};
  if (pictures.size() == 1) {
    view.image = std::move(pictures.front().image);
    return view;
  }
  std::vector<PictureImage> images;
  for (Picture& picture : pictures) images.push_back(std::move(picture.image));
  view.image = SideBySide(images, size);
  return view;
}

Result<EncodedView> EncodeView(const RenderedView& view, PictureCoding coding, int quality, VideoEncoder& video,
                               const std::atomic<bool>& given_up) {
  const Time begin = MonotonicNow();
  const Result<ComposedPicture> picture = ComposedPicture::Make(view.image, view.size, view.format, view.panes, view.key);
  if (!picture.ok()) return picture.status();
  const bool final = coding == PictureCoding::kLossless, is_video = coding == PictureCoding::kVideo;
  // Outside of what was rendered is background, unless something was drawn onto the picture. Pictures of a video have one size.
  const PixelBounds bounds =
      view.format.annotations.any() || is_video ? PixelBounds{0, 0, view.size.width, view.size.height} : view.image.ContentBounds();
  EncodedView encoded{.seq = view.seq, .header = {}, .bytes = nullptr, .encoding = {}, .type = final ? "png" : is_video ? "vp9" : "jpeg"};
  std::vector<std::byte> bytes;
  bool key = false;
  if (is_video) {
    Result<VideoEncoder::Chunk> chunk = video.Encode(*picture);
    if (!chunk.ok()) return chunk.status();
    bytes = std::move(chunk->bytes);
    key = chunk->key;
  } else if (!bounds.empty()) {
    const PictureFileType type = final ? PictureFileType::kPng : PictureFileType::kJpeg;
    std::optional<std::vector<std::byte>> part = EncodePart(type, *picture, bounds, quality, given_up);
    if (!part) return Status::Cancelled("a newer view has come");
    bytes = *std::move(part);
  }
  const StraightColor& background = view.format.background;
  Json statistics = StatisticsJson(view.statistics, view.latency, view.timeline);
  statistics["bytes"]["picture"] = bytes.size();
  encoded.encoding = MonotonicNow() - begin;
  statistics["encode_ms"] = Milliseconds(encoded.encoding.count());
  const auto area = bounds.empty() ? std::array{0, 0, 0, 0} : std::array{bounds.x_begin, bounds.y_begin, bounds.width(), bounds.height()};
  encoded.header = {{"frame", 0},
                    {"seq", view.seq},
                    {"final", final},
                    {"type", final      ? "image/png"
                             : is_video ? "video/vp9"
                                        : "image/jpeg"},
                    {"size", {view.size.width, view.size.height}},
                    {"scale", view.scale},
                    {"coarseness", view.coarseness},
                    {"bounds", area},
                    {"background", {Decimal(background.r), Decimal(background.g), Decimal(background.b), Decimal(background.a)}},
                    {"geometry", GeometryJson(view.panes.front())},
                    {"statistics", std::move(statistics)}};
  if (is_video) encoded.header["key"] = key;
  if (view.statistics.view) encoded.header["view"] = CameraJson(*view.statistics.view);
  encoded.bytes = std::make_shared<const std::vector<std::byte>>(std::move(bytes));
  return encoded;
}

std::string HeadOf(Json header, std::uint64_t frame, Duration round_trip) {
  header["frame"] = frame;
  header["statistics"]["round_trip_ms"] = Milliseconds(round_trip.count());
  const std::string text = header.dump();
  std::string head;
  for (int byte = 0; byte < 4; ++byte) head += char((text.size() >> (8 * byte)) & 0xFF);
  return head + text;
}

}  // namespace slabstream
