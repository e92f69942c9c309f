// The target of a request, "/api/v1/render.png?dataset=head&azimuth=30", in parts. Pure.
#pragma once

#include <string>
#include <string_view>

#include "client/request/picture_fields.h"
#include "common/base/status.h"

namespace slabstream {

struct Target {
  std::string path;      // as it stands: the gateway's own paths need no escapes
  PictureFields fields;  // decoded; in their order
};

// InvalidArgument: no path, a '%' that is no escape, or more than kMaxPictureFields fields.
Result<Target> ParseTarget(std::string_view text);

}  // namespace slabstream
