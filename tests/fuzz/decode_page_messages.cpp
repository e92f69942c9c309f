// What pages and scripts send to the gateway: messages of a WebSocket, targets of requests, and tokens.
#include <algorithm>

#include "common/http/access_token.h"
#include "common/http/address.h"
#include "gateway/page_message.h"
#include "gateway/request_fields.h"
#include "tests/fuzz/decoders.h"

namespace slabstream {
namespace {

// Whether the fields are a picture that could be asked for.
bool Takes(PagePicture kind, const PictureFields& fields) {
  const Result<PictureJob> job = MakePictureJob(kind, fields);
  if (!job.ok()) {
    CheckRefusal(job.status());
    return false;
  }
  CHECK(!job->frames.empty());
  for (const FrameRequest& frame : job->frames) {
    CHECK(!frame.dataset.empty());
    CHECK(frame.size.width * int(job->frames.size()) == job->size.width && frame.size.height == job->size.height);
  }
  return true;
}

bool DecodeMessageOfPage(std::string_view text) {
  const Result<PageMessage> message = ParsePageMessage(text);
  if (!message.ok()) {
    CheckRefusal(message.status());
    return false;
  }
  const auto* view = std::get_if<ViewMessage>(&*message);
  return view == nullptr || Takes(view->kind, view->options);
}

bool DecodeTarget(std::string_view text) {
  const Result<Target> target = ParseTarget(text);
  if (!target.ok()) {
    CheckRefusal(target.status());
    return false;
  }
  CHECK(target->path.starts_with('/'));
  CHECK_LE(target->fields.size(), kMaxPictureFields);
  bool taken = Takes(PagePicture::kRender, target->fields);
  taken = Takes(PagePicture::kSlice, target->fields) || taken;
  return taken;
}

// Names of hosts come from the same requests.
void DecodeHost(std::string_view text) {
  static const OriginRules rules({}, false, "https://viewer.example.org", {"http://localhost:*", "vscode-webview:"});
  const auto refusal = rules.Refusal(text, text);
  CHECK(refusal.has_value());  // no host is an origin
  CheckRefusal(Status::InvalidArgument(*refusal));
}

// Any text as a token, and as the claims and the header of one that is signed: whoever holds the gateway's token signs what they want.
bool DecodeToken(std::string_view text) {
  constexpr std::string_view kSecret = "Jb8fXqkz3mYw0nT5sVQy1A", kHeader = R"({"alg":"HS256"})", kClaims = R"({"exp":1})";
  constexpr std::int64_t kNow = 1764450000;
  if (text != kSecret) CheckRefusal(CheckAccess(text, kSecret, kNow).status());
  CheckRefusal(CheckAccess(SignedToken(text, kClaims, kSecret), kSecret, kNow).status());  // it has expired
  const Result<Access> access = CheckAccess(SignedToken(kHeader, text, kSecret), kSecret, kNow);
  if (!access.ok()) {
    CheckRefusal(access.status());
    return false;
  }
  CHECK_GT(access->until, kNow);
  return true;
}

}  // namespace

bool DecodePageMessage(std::span<const std::byte> bytes) {
  const std::string_view text = FuzzInput(bytes).Text();
  DecodeHost(text);
  if (DecodeToken(text)) return true;
  return text.starts_with('/') ? DecodeTarget(text) : DecodeMessageOfPage(text);
}

std::vector<FuzzBytes> PageMessageSeeds() {
  std::vector<FuzzBytes> seeds;
  for (
      const char* text : {
          R"({"type": "view", "seq": 17, "timeline": true, "options": {"dataset": "head", "azimuth": 30, "clip-plane": ["1,0,0,5"], "fit": true}})",
          R"({"type": "view", "seq": 1, "picture": "slice", "options": {"dataset": "head", "plane": "zyx", "size": "64x32", "window": 80}})",
          R"({"type": "view", "seq": 2, "options": {"dataset": "a", "transfer": [{"RGBPoints": [0, 0, 0, 0, 1, 1, 1, 1]}]}})",
          R"({"type": "ack", "frame": 5})",
          "/api/v1/render.png?dataset=head&azimuth=-30.5&renderer=raycast&isovalue=300:red:0.5&light=1,0,0&light=0%2C1,0&title=a+b",
          "/api/v1/slice.png?dataset=head&plane=axial&label-mode=surface",
          R"({"exp": 1764450060, "iat": 1764450000, "datasets": ["head", "fmri@3"], "view_only": true})",
      }) {
    seeds.push_back(SeedOf(text));
  }
  return seeds;
}

}  // namespace slabstream
