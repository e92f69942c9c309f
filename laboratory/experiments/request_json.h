// A FrameRequest as JSON, whole: two requests that differ in any field differ in their JSON. Keys of trials are made from it. It is that of
// picture records (common/wire/request_json.h), with the dataset, and with digests for the points of transfer functions.
#pragma once

#include <string>
#include <string_view>

#include "common/frame/frame_request.h"
#include "common/json/json.h"

namespace slabstream {

Json RequestJson(const FrameRequest& request);
// Its field "transfer".
Json TransferJson(const TransferChoice& transfer);

// XXH3-64 in hexadecimal digits.
std::string DigestText(std::string_view bytes);

}  // namespace slabstream
