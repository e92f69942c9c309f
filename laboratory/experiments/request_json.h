// A FrameRequest as JSON, whole: two requests that differ in any field differ in their JSON. Keys of trials are made from it. Names and
// units of fields are those of a sweep file where it has them. A new field of these types does not compile until it is written here.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

#include "common/frame/frame_request.h"

namespace slabstream {

using Json = nlohmann::ordered_json;

Json RequestJson(const FrameRequest& request);
// {"preset": "auto", "opacity_distance": 1}, or "function" with the digest of its points, of which there may be thousands.
Json TransferJson(const TransferChoice& transfer);

// XXH3-64 in hexadecimal digits.
std::string DigestText(std::string_view bytes);

}  // namespace slabstream
