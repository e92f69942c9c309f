#include "gateway/request_fields.h"

#include <fmt/format.h>

#include <algorithm>

#include "common/base/printable.h"

namespace slabstream {

Result<PictureFields> FieldsOf(const Target& target, const HttpRequest& request) {
  PictureFields fields;
  for (const PictureField& field : target.fields) {
    if (field.name != "token") fields.push_back(field);
  }
  if (request.method != "POST" || request.body.empty()) return fields;
  const Result<Json> json = ParseJson(request.body);
  if (!json.ok()) return Status::InvalidArgument("the body: " + json.status().message());
  Result<PictureFields> more = FieldsOfJson(*json);
  if (!more.ok()) return more.status();
  fields.insert(fields.end(), more->begin(), more->end());
  return fields;
}

Result<std::string> Take(PictureFields& fields, const std::string& name, std::string_view purpose) {
  const auto found = std::ranges::find(fields, name, &PictureField::name);
  if (found == fields.end()) return Status::InvalidArgument(fmt::format("{} is missing: {}", name, purpose));
  std::string text = std::move(found->text);
  fields.erase(found);
  if (std::ranges::find(fields, name, &PictureField::name) != fields.end()) return Status::InvalidArgument(name + " is given twice");
  return text;
}

Result<std::string> TakeOr(PictureFields& fields, const std::string& name, std::string_view usual) {
  if (std::ranges::find(fields, name, &PictureField::name) == fields.end()) return std::string(usual);
  return Take(fields, name, "");
}

Result<std::string> OnlyDataset(PictureFields fields) {
  Result<std::string> dataset = Take(fields, "dataset", "the name of a dataset of the service");
  if (!dataset.ok()) return dataset;
  if (!fields.empty()) return Status::InvalidArgument(fmt::format("there is no option '{}'", Printable(fields.front().name.substr(0, 64))));
  if (dataset->empty() || dataset->size() > kMaxNameBytes) {
    return Status::InvalidArgument(fmt::format("dataset has {} bytes, but must have 1 to {}", dataset->size(), kMaxNameBytes));
  }
  return dataset;
}

}  // namespace slabstream
