#include "client/request/option_description.h"

#include <string>

#include "client/request/request_options.h"
#include "client/request/value_window.h"
#include "common/classification/transfer_function.h"
#include "common/cli/add_option.h"
#include "common/renderers/registry.h"

namespace slabstream {
namespace {

// "CAPTION" of "[=CAPTION]".
std::string NameOfOptional(std::string type) {
  std::erase_if(type, [](char c) { return c == '[' || c == '=' || c == ']'; });
  return type;
}

Json DescribeRenderers() {
  Json renderers = Json::array();
  for (const RendererKind* kind : Renderers()) {
    Json json = {{"name", kind->name()},
                 {"title", kind->title()},
                 {"purpose", kind->purpose()},
                 {"abilities", Json::array()},
                 {"parameters", Json::object()}};
    for (const std::string_view ability : kind->AbilityNames()) json["abilities"].push_back(ability);
    for (const RendererParameter& parameter : kind->parameters()) {
      json["parameters"][std::string(parameter.name)] = TextOf(parameter, parameter.standard);
    }
    renderers.push_back(std::move(json));
  }
  return renderers;
}

void DescribePresets(Json& option) {
  option["presets"] = option["region_presets"] = Json::array();
  for (const TransferPreset& preset : TransferPresets()) {
    option["presets"].push_back(preset.name);
    if (preset.has_regions) option["region_presets"].push_back(preset.name);
  }
}

Json DescribeWindows() {
  Json windows = Json::array();
  for (const auto& [name, purpose, window] : kNamedWindows) {
    windows.push_back({{"name", name}, {"width", window.width}, {"level", window.level}});
  }
  return windows;
}

Json Describe(Option option) {
  const std::string name = option.name(), type = option.type_name();
  Json json = {{"name", name}, {"group", option.group()}};
  const bool alone = option.most_values() == 0;
  if (!alone) json["type"] = type;
  if (alone && !type.empty()) json["optional_value"] = NameOfOptional(type);
  if (!option.default_text().empty()) json["default"] = option.default_text();
  const OptionDomain domain = option.domain();
  if (!domain.choices.empty()) json["choices"] = domain.choices;
  if (domain.range) {
    json[domain.range->min_open ? "above" : "min"] = domain.range->min;
    json["max"] = domain.range->max;
  }
  if (option.repeatable()) json["repeatable"] = true;
  if (option.required()) json["required"] = true;
  if (const auto others = option.excluded(); !others.empty()) json["excludes"] = others;
  if (const auto others = option.needed(); !others.empty()) json["needs"] = others;
  const RequestOption* const field = FindRequestOption(name);
  if (field != nullptr && field->help == option.description()) {
    json["path"] = field->path;
    if (!field->unit.empty()) json["unit"] = field->unit;
    if (!field->ability.empty()) json["ability"] = field->ability;
    if (field->same_picture) json["same_picture"] = true;
    if (field->negatable) json["negatable"] = true;
    if (field->path == "renderer") json["renderers"] = DescribeRenderers();
    if (type == "TRANSFER") DescribePresets(json);
  }
  if (name == "window") json["windows"] = DescribeWindows();
  json["help"] = option.description();
  return json;
}

}  // namespace

Json DescribeOptions(const Command& command) {
  Json options = Json::array();
  for (const Option& option : command.options()) {
    if (!option.group().empty() && !command.IsHelp(option)) options.push_back(Describe(option));
  }
  return options;
}

}  // namespace slabstream
