#include "gateway/page_message.h"

#include <fmt/format.h>

#include <array>
#include <optional>
#include <utility>

#include "client/request/json_value.h"
#include "common/base/printable.h"

namespace slabstream {
namespace {

constexpr double kMostPageMs = 1e9;

std::uint64_t Sequence(const JsonValue& value) { return std::uint64_t(value.Number({1, double(kMaxSequence)})); }

}  // namespace

Result<PageMessage> ParsePageMessage(std::string_view text) {
  if (text.size() > kMaxPageMessageBytes) {
    return Status::InvalidArgument(fmt::format("the message has {} bytes, at most {} are taken", text.size(), kMaxPageMessageBytes));
  }
  const Result<Json> json = ParseJson(text);
  if (!json.ok()) return Printable(json.status());
  std::optional<std::string> mistake;
  const JsonValue value(*json, "message", mistake);
  static constexpr std::array<std::string_view, 3> kTypes = {"view", "ack", "pong"};
  static constexpr std::array<std::string_view, 2> kKinds = {"render", "slice"};
  const std::size_t type = value.At("type").OneOf(kTypes);
  if (mistake) return Status::InvalidArgument(Printable(*mistake));
  const auto ignore = [](const JsonValue&) {};
  if (type == 1) {
    AckMessage ack;
    value.Fields({{"type", ignore},
                  {"frame", [&](const JsonValue& v) { ack.frame = Sequence(v); }},
                  {"page_ms", [&](const JsonValue& v) {
                     ack.in_page = Duration(std::int64_t(1e6 * v.Number({0, kMostPageMs})));
                   }}});
    (void)value.At("frame");
    if (mistake) return Status::InvalidArgument(Printable(*mistake));
    return PageMessage(ack);
  }
  if (type == 2) {
    PongMessage pong;
    value.Fields({{"type", ignore}, {"ping", [&](const JsonValue& v) { pong.ping = Sequence(v); }}});
    (void)value.At("ping");
    if (mistake) return Status::InvalidArgument(Printable(*mistake));
    return PageMessage(pong);
  }
  ViewMessage view;
  value.Fields({{"type", ignore},
                {"seq", [&](const JsonValue& v) { view.seq = Sequence(v); }},
                {"picture", [&](const JsonValue& v) { view.kind = v.OneOf(kKinds) == 0 ? PagePicture::kRender : PagePicture::kSlice; }},
                {"timeline", [&](const JsonValue& v) { view.timeline = v.Boolean(); }},
                {"video", [&](const JsonValue& v) { view.video = v.Boolean(); }},
                {"options", ignore}});
  (void)value.At("seq");
  (void)value.At("options");
  if (mistake) return Status::InvalidArgument(Printable(*mistake));
  Result<PictureFields> options = FieldsOfJson((*json)["options"]);
  if (!options.ok()) return options.status();
  view.options = *std::move(options);
  return PageMessage(std::move(view));
}

Result<PictureJob> MakePictureJob(PagePicture kind, const PictureFields& fields) {
  PictureJob job;
  if (kind == PagePicture::kSlice) {
    const Result<SliceRequest> slice = ParseSliceFields(fields);
    if (!slice.ok()) return slice.status();
    Result<std::vector<FrameRequest>> frames = FramesOf(*slice);
    if (!frames.ok()) return frames.status();
    job = {.frames = *std::move(frames), .size = slice->size(), .format = slice->format};
  } else {
    Result<RenderRequest> render = ParseRenderFields(fields);
    if (!render.ok()) return render.status();
    job = {.frames = {render->frame}, .size = render->frame.size, .format = std::move(render->format)};
  }
  return job;
}

}  // namespace slabstream
