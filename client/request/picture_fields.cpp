#include "client/request/picture_fields.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "client/request/option_description.h"
#include "client/request/picture_options.h"
#include "common/base/did_you_mean.h"
#include "common/base/printable.h"
#include "common/wire/validate_request.h"

namespace slabstream {
namespace {

// Its value may be left out: a flag has none, but --color-bar may have one.
bool MayStandAlone(Option option) { return option.most_values() == 0; }
bool IsFlag(Option option) { return MayStandAlone(option) && option.type_name().empty(); }

// The options, and where their values go.
struct RenderOptionsApp {
  RenderOptionsApp() {
    AddRequestOption(app, *FindRequestOption("dataset"), request.frame).Required();
    AddRenderPictureOptions(app, request.frame, request.format, nullptr);
  }
  TransferChoice& transfer() { return request.frame.transfer; }

  Program app;
  RenderRequest request;
};

struct SliceOptionsApp {
  SliceOptionsApp() {
    AddRequestOption(app, *FindRequestOption("dataset"), request.frame).Required();
    AddSlicePictureOptions(app, request, nullptr);
  }
  TransferChoice& transfer() { return request.frame.transfer; }

  Program app;
  SliceRequest request;
};

std::string NoOption(const Command& app, const std::string& name) {
  std::vector<std::string> names;
  for (const Option& option : app.options()) names.push_back(option.name());
  return fmt::format("there is no option '{}'{}", Printable(name.substr(0, 64)), DidYouMean(name, names));
}

// The arguments that say the same. Names are looked up here, so that no text can be taken for another option.
Status AddArgument(const Command& app, const PictureField& field, std::vector<std::string>& arguments) {
  const std::string name = "--" + field.name;
  const bool proper = !field.name.empty() && field.name.find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789-") == std::string::npos;
  const Option option = proper ? app.FindOption(name) : Option();
  if (!option) return Status::InvalidArgument(NoOption(app, field.name));
  if (MayStandAlone(option) && (field.text == "true" || field.text == "false" || field.text.empty())) {
    const std::string off = "--no-" + field.name;
    if (field.text != "false") {
      arguments.push_back(name);
    } else if (option.Has(off)) {
      arguments.push_back(off);
    }
    return Status::Ok();
  }
  if (IsFlag(option)) {
    return Status::InvalidArgument(fmt::format("{} '{}' is neither true nor false", name, Printable(field.text.substr(0, 64))));
  }
  if (field.text.empty()) return Status::InvalidArgument(fmt::format("{} has no value", name));
  arguments.push_back(fmt::format("{}={}", name, field.text));
  return Status::Ok();
}

template <class OptionsApp>
Status Parse(const PictureFields& fields, OptionsApp& options) {
  if (fields.size() > kMaxPictureFields) {
    return Status::InvalidArgument(fmt::format("there are {} options, at most {} are taken", fields.size(), kMaxPictureFields));
  }
  if (std::ranges::find(fields, "dataset", &PictureField::name) == fields.end()) {
    return Status::InvalidArgument("dataset is missing: the name of a dataset of the service");
  }
  std::vector<std::string> arguments;
  for (const PictureField& field : fields) {
    if (Status status = AddArgument(options.app, field, arguments); !status.ok()) return status;
  }
  const ParseEnd end = options.app.Parse(std::move(arguments));
  if (end.kind != ParseEnd::Kind::kParsed) return Status::InvalidArgument(end.message);
  LetSurfacesStandAlone(options.app, options.transfer());
  return Status::Ok();
}

}  // namespace

Result<PictureFields> FieldsOfJson(const Json& object) {
  if (!object.is_object()) return Status::InvalidArgument("options must be a JSON object");
  PictureFields fields;
  for (const auto& [name, value] : object.items()) {
    if (value.is_null()) continue;
    const RequestOption* const option = FindRequestOption(name);
    const auto texts = TextsOfJson(value, option != nullptr && option->repeatable);
    if (!texts) {
      return Status::InvalidArgument(
          fmt::format("option '{}' is not a text, number, boolean, colour map, or a list of texts", Printable(name.substr(0, 64))));
    }
    for (const std::string& text : *texts) fields.push_back({name, text});
  }
  return fields;
}

// Errors repeat texts, which come from anywhere: they are made printable.
Result<RenderRequest> ParseRenderFields(const PictureFields& fields) {
  RenderOptionsApp options;
  Status status = Parse(fields, options);
  if (status.ok()) status = Validate(options.request.frame);
  if (!status.ok()) return Printable(status);
  return std::move(options.request);
}

Result<SliceRequest> ParseSliceFields(const PictureFields& fields) {
  SliceOptionsApp options;
  Status status = Parse(fields, options);
  if (status.ok()) status = FramesOf(options.request).status();
  if (!status.ok()) return Printable(status);
  return std::move(options.request);
}

Json RenderFields() {
  RenderOptionsApp options;
  return DescribeOptions(options.app);
}
Json SliceFields() {
  SliceOptionsApp options;
  return DescribeOptions(options.app);
}

}  // namespace slabstream
