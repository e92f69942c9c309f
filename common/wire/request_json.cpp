#include "common/wire/request_json.h"

#include <google/protobuf/util/json_util.h>

#include "common/base/check.h"
#include "common/base/printable.h"
#include "common/wire/codecs.h"
#include "slabstream/v1/frame.pb.h"

namespace slabstream {

std::string RequestToJson(const FrameRequest& request) {
  v1::FrameRequest message;
  Write(request, message);
  message.clear_dataset();
  google::protobuf::util::JsonPrintOptions options;
  options.always_print_primitive_fields = true;
  options.preserve_proto_field_names = true;
  std::string json;
  CHECK(google::protobuf::util::MessageToJsonString(message, &json, options).ok());
  return json;
}

Result<FrameRequest> RequestFromJson(const std::string& json, const std::string& dataset) {
  v1::FrameRequest message;
  if (const auto status = google::protobuf::util::JsonStringToMessage(json, &message); !status.ok()) {
    return Printable(Status::InvalidArgument("FrameRequest: " + std::string(status.message())));
  }
  message.set_dataset(dataset);
  FrameRequest request;
  Checker check("FrameRequest");
  Read(message, request, check);
  if (!check.ok()) return check.status();
  return request;
}

}  // namespace slabstream
