// What a page says over its WebSocket (docs/http.md): text messages, JSON. Hostile until parsed. Pure.
#pragma once

#include <cstdint>
#include <string_view>
#include <variant>

#include "client/request/picture_fields.h"
#include "common/base/status.h"
#include "common/base/time.h"

namespace slabstream {

inline constexpr std::size_t kMaxPageMessageBytes = std::size_t{1} << 20;
inline constexpr std::uint64_t kMaxSequence = std::uint64_t{1} << 53;  // whole numbers up to this are exact in JavaScript

enum class PagePicture : std::uint8_t { kRender = 1, kSlice = 2 };

// A view to be shown. Its options are checked when it is rendered, because most views are overtaken before that.
struct ViewMessage {
  std::uint64_t seq = 0;  // [1, kMaxSequence]
  PagePicture kind = PagePicture::kRender;
  bool timeline = false;
  bool video = false;  // the page can show video/vp9
  PictureFields options;
};

// A picture is drawn.
struct AckMessage {
  std::uint64_t frame = 0;
  Duration in_page{};  // what the page took to draw it; 0: it does not tell
};

// The answer to a ping.
struct PongMessage {
  std::uint64_t ping = 0;
};

using PageMessage = std::variant<ViewMessage, AckMessage, PongMessage>;

// InvalidArgument: wrong in form.
Result<PageMessage> ParsePageMessage(std::string_view text);

// A parsed view, as frames to be rendered, from left to right in the picture.
struct PictureJob {
  std::vector<FrameRequest> frames;  // at least one, all of one size
  ImageSize size;                    // the size of the whole picture
  PictureFormat format;
};
// InvalidArgument: as ParseRenderFields.
Result<PictureJob> MakePictureJob(PagePicture kind, const PictureFields& fields);

}  // namespace slabstream
