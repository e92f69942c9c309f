#include "client/request/picture_fields.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "client/request/picture_options.h"
#include "common/base/printable.h"
#include "common/planning/validate_request.h"

namespace slabstream {
namespace {

constexpr char kDataset[] = "dataset";

bool IsFlag(const CLI::Option& option) { return option.get_expected_max() == 0; }
bool IsRepeated(const CLI::Option& option) { return option.get_multi_option_policy() == CLI::MultiOptionPolicy::TakeAll; }

// The options, and where their values go.
struct RenderOptionsApp {
  RenderOptionsApp() {
    app.set_help_flag();
    AddRenderPictureOptions(app, request.frame, request.format, nullptr);
  }
  TransferChoice& transfer() { return request.frame.transfer; }
  std::string& dataset() { return request.frame.dataset; }

  CLI::App app;
  RenderRequest request;
};

struct SliceOptionsApp {
  SliceOptionsApp() {
    app.set_help_flag();
    AddSlicePictureOptions(app, request, nullptr);
  }
  TransferChoice& transfer() { return request.frame.transfer; }
  std::string& dataset() { return request.frame.dataset; }

  CLI::App app;
  SliceRequest request;
};

// The arguments that say the same. Names are looked up here, so that no text can be taken for another option.
Status AddArgument(CLI::App& app, const PictureField& field, std::vector<std::string>& arguments) {
  const std::string name = "--" + field.name;
  const bool proper = !field.name.empty() && field.name.find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789-") == std::string::npos;
  const CLI::Option* const option = proper ? app.get_option_no_throw(name) : nullptr;
  if (option == nullptr) return Status::InvalidArgument(fmt::format("there is no option '{}'", Printable(field.name.substr(0, 64))));
  if (IsFlag(*option)) {
    if (field.text != "true" && field.text != "false" && !field.text.empty()) {
      return Status::InvalidArgument(fmt::format("{} '{}' is neither true nor false", name, Printable(field.text.substr(0, 64))));
    }
    if (field.text != "false") arguments.push_back(name);
    return Status::Ok();
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
  std::vector<std::string> arguments;
  for (const PictureField& field : fields) {
    if (field.name == kDataset) {
      if (!options.dataset().empty()) return Status::InvalidArgument("dataset is given twice");
      options.dataset() = field.text;
    } else if (Status status = AddArgument(options.app, field, arguments); !status.ok()) {
      return status;
    }
  }
  if (options.dataset().empty()) return Status::InvalidArgument("dataset is missing: the name of a dataset of the service");
  std::ranges::reverse(arguments);  // as CLI11 wants them
  try {
    options.app.parse(std::move(arguments));
  } catch (const CLI::Error& error) {
    return Status::InvalidArgument(error.what());
  }
  LetSurfacesStandAlone(options.app, options.transfer());
  return Status::Ok();
}

// Numbers have the fewest digits that read back the same.
std::optional<std::string> TextOf(const Json& value) {
  if (value.is_string()) return value.get<std::string>();
  if (value.is_boolean()) return value.get<bool>() ? "true" : "false";
  if (value.is_number_integer()) return value.dump();
  if (value.is_number_float()) return fmt::format("{}", value.get<double>());
  if (value.is_object()) return value.dump(-1, ' ', true, Json::error_handler_t::replace);
  return std::nullopt;
}

std::vector<FieldDescription> Describe(const CLI::App& app) {
  std::vector<FieldDescription> fields;
  fields.push_back({kDataset, "Options", "Name of the dataset", "NAME", "", false});
  for (const CLI::Option* option : app.get_options()) {
    if (option->get_group() == kHidden) continue;
    const bool flag = IsFlag(*option);
    fields.push_back({.name = option->get_lnames().front(),
                      .group = option->get_group(),
                      .purpose = option->get_description(),
                      .value = flag ? "" : option->get_type_name(),
                      .standard = option->get_default_str(),
                      .repeated = IsRepeated(*option)});
  }
  return fields;
}

}  // namespace

Result<PictureFields> FieldsOfJson(const Json& object) {
  if (!object.is_object()) return Status::InvalidArgument("options must be a JSON object");
  PictureFields fields;
  for (const auto& [name, value] : object.items()) {
    if (value.is_null()) continue;
    const bool list = value.is_array() && !value.empty() && !value.front().is_object();              // a list of objects is a colour map
    const auto add = [&fields, &name = name, whole = value.is_array() && !list](const Json& item) {  // clang 14 does not take [&] here
      std::optional<std::string> text = whole ? item.dump(-1, ' ', true, Json::error_handler_t::replace) : TextOf(item);
      if (text) fields.push_back({name, *std::move(text)});
      return text.has_value();
    };
    bool taken = true;
    if (list) {
      for (const Json& item : value) taken = taken && fields.size() <= kMaxPictureFields && add(item);
    } else if (!value.is_array() || !value.empty()) {
      taken = add(value);
    }
    if (!taken) {
      return Status::InvalidArgument(
          fmt::format("option '{}' is not a text, number, boolean, colour map, or a list of texts", Printable(name.substr(0, 64))));
    }
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

std::vector<FieldDescription> RenderFields() { return Describe(RenderOptionsApp().app); }
std::vector<FieldDescription> SliceFields() { return Describe(SliceOptionsApp().app); }

}  // namespace slabstream
