#include "laboratory/experiments/request_json.h"

#include <fmt/format.h>

#include <span>

#include "common/wire/digest.h"
#include "common/wire/request_json.h"

namespace slabstream {
namespace {

// A function may have thousands of points: its digest stands for them.
Json Shortened(Json transfer) {
  if (transfer.contains("function")) transfer["function"] = DigestText(transfer["function"].dump());
  return transfer;
}

}  // namespace

std::string DigestText(std::string_view bytes) { return fmt::format("{:016x}", Digest(std::as_bytes(std::span(bytes)))); }

Json TransferJson(const TransferChoice& transfer) { return RequestJson({.transfer = transfer})["transfer"]; }

Json RequestJson(const FrameRequest& request) {
  Json json = Json::Parse(RequestToJson(request)).value();
  json["dataset"] = request.dataset;
  json["transfer"] = Shortened(json["transfer"]);
  for (Json& field : json["fields"]) field = Shortened(field);
  return json;
}

}  // namespace slabstream
