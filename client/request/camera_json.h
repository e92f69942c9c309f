// A view as JSON, with the names of the options of `render`: what --save-camera writes, --camera reads, and experiments state.
//   {"projection": "perspective", "azimuth": 30, "elevation": 20, "roll": 0, "zoom": 1, "fov": 30, "look_at": [1, 2, 3]}
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "client/request/json_value.h"
#include "common/view/camera.h"
#include "common/view/clip.h"

namespace slabstream {

// Whole: views that differ in any field differ in their JSON.
Json ViewJson(const ViewParameters& view);
// For JsonValue::Fields: those of `view`, which must live as long. Each is in its range; Validate judges them together.
std::vector<std::pair<std::string, JsonValue::Read>> ViewFields(ViewParameters& view);

// Whole, as above.
Json ClippingJson(const Clipping& clipping);

// The view of a file's text. InvalidArgument, one line that names the field, the value and what is expected.
Result<ViewParameters> ParseCamera(const std::string& text);

}  // namespace slabstream
