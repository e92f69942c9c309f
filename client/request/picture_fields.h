// Pictures as named texts, such as the parameters of an address have: {"azimuth", "30"} says what --azimuth 30 says on the command line.
// The options, their checks and their errors are those of the command line (picture_options.h), but for those that name files of this
// host; and the field "dataset" names the dataset. Any thread.
#pragma once

#include <string>
#include <vector>

#include "client/pictures/picture_writer.h"
#include "client/request/json_value.h"
#include "client/request/slice_request.h"
#include "common/base/status.h"
#include "common/frame/frame_request.h"

namespace slabstream {

struct PictureField {
  std::string name;  // an option's name, without dashes
  std::string text;  // its value. A flag, or an option whose value is left out, has "true", "false", or an empty text for "true"
};
using PictureFields = std::vector<PictureField>;

inline constexpr std::size_t kMaxPictureFields = 256;

// The fields of a JSON object. Values are texts, numbers or booleans; lists of them for fields that are repeated;
// objects for colour maps. A null counts as left out. InvalidArgument: a value of another kind.
Result<PictureFields> FieldsOfJson(const Json& object);

struct RenderRequest {
  FrameRequest frame;
  PictureFormat format;
};

// InvalidArgument: one line that names the field, the value and the limit.
Result<RenderRequest> ParseRenderFields(const PictureFields& fields);
Result<SliceRequest> ParseSliceFields(const PictureFields& fields);

// What there is, as DescribeOptions has it.
Json RenderFields();
Json SliceFields();

}  // namespace slabstream
