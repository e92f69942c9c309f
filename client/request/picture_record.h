// The record of a picture: how it was made, as the text that its file holds (PictureNotes). It is JSON:
//
//   {"program": "slabstream 0.2.0", "source": "brain.nii.gz",             SOURCE as it was typed
//    "layers": {"labels", "overlay"},                                     paths as they were typed, if there are any
//    "request": {...},                                                    RequestToJson (common/wire/request_json.h)
//    "picture": {"depth", "background", "title", "scale_bar", "orientation_marker", "axes", "color_bar", "legend", "font_size",
//                "quality", "dpi"},
//    "geometry": {"world", "unit", "projection", "right", "up", "forward", "target", "target_depth", "pixel_size",
//                 "box_corner", "box_edges"},
//    "levels": [2]}                                                       that the picture was drawn from, if not from level 0 alone
//
// It names no host, no time and no place of the service, so the same picture has the same record wherever and whenever it is made.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "client/pictures/picture_writer.h"
#include "client/request/json_value.h"
#include "client/request/request_options.h"
#include "common/base/status.h"
#include "common/frame/frame_request.h"
#include "common/wire/client_messages.h"
#include "data/layers/layer_files.h"

namespace slabstream {

struct PictureRecord {
  std::string program;
  std::string source;
  LayerFiles layers;
  FrameRequest request;  // its dataset does not count
  PictureFormat format;
  Json json;  // the whole record
};

// The fields of the record's "picture", but for the background: they set those of `format`.
std::vector<std::pair<std::string, JsonValue::Read>> FormatFields(PictureFormat& format);
// The record's "geometry".
Json GeometryJson(const PictureGeometry& geometry);

// The request of a picture with the renderer and the view that it was made by, so that its record names these. The
// request of a preview stays as it is.
FrameRequest AsMade(FrameRequest request, const FrameStatistics& statistics);

// ASCII, one line.
std::string RecordText(const std::string& source, const FrameRequest& request, const PictureFormat& format, const PictureGeometry& geometry,
                       const LayerFiles& layers = {}, const std::vector<LevelUse>& levels = {});
// InvalidArgument, one line: what is wrong with the text.
Result<PictureRecord> ParseRecord(std::string_view text);

// The command line that makes the picture again as `output`: "render", SOURCE, and each option whose value is not its default. --local if
// SOURCE is the name of a file.
std::vector<std::string> RenderArguments(const PictureRecord& record, const std::string& output);
// The same as a line for a shell: "slabstream render ...".
std::string CommandText(const PictureRecord& record, const std::string& output);

}  // namespace slabstream
