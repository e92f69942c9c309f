#include "client/request/option_description.h"

#include <CLI/CLI.hpp>
#include <set>
#include <string>
#include <vector>

#include "client/request/request_options.h"
#include "client/request/value_window.h"
#include "common/classification/transfer_function.h"
#include "common/cli/add_option.h"
#include "common/renderers/registry.h"

namespace slabstream {
namespace {

std::string NameOf(const CLI::Option& option) {
  const std::vector<std::string>& names = option.get_lnames();
  return names.empty() ? option.get_name() : names.front();
}

// "CAPTION" of "[=CAPTION]".
std::string NameOfOptional(std::string type) {
  std::erase_if(type, [](char c) { return c == '[' || c == '=' || c == ']'; });
  return type;
}

// In order of their names: CLI11 keeps them in order of their addresses.
Json NamesOf(const std::set<CLI::Option*>& options) {
  std::set<std::string> names;
  for (const CLI::Option* option : options) names.insert(NameOf(*option));
  return names;
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

Json Describe(CLI::Option& option) {
  Json json = {{"name", NameOf(option)}, {"group", option.get_group()}};
  const bool alone = option.get_items_expected_max() == 0;
  if (!alone) json["type"] = option.get_type_name();
  if (alone && !option.get_type_name().empty()) json["optional_value"] = NameOfOptional(option.get_type_name());
  if (!option.get_default_str().empty()) json["default"] = option.get_default_str();
  const OptionDomain domain = DomainOf(option);
  if (!domain.choices.empty()) json["choices"] = domain.choices;
  if (domain.range) {
    json[domain.range->min_open ? "above" : "min"] = domain.range->min;
    json["max"] = domain.range->max;
  }
  if (option.get_multi_option_policy() == CLI::MultiOptionPolicy::TakeAll) json["repeatable"] = true;
  if (option.get_required()) json["required"] = true;
  if (!option.get_excludes().empty()) json["excludes"] = NamesOf(option.get_excludes());
  if (!option.get_needs().empty()) json["needs"] = NamesOf(option.get_needs());
  const RequestOption* const field = FindRequestOption(NameOf(option));
  if (field != nullptr && field->help == option.get_description()) {
    json["path"] = field->path;
    if (!field->unit.empty()) json["unit"] = field->unit;
    if (!field->ability.empty()) json["ability"] = field->ability;
    if (field->same_picture) json["same_picture"] = true;
    if (field->negatable) json["negatable"] = true;
    if (field->path == "renderer") json["renderers"] = DescribeRenderers();
    if (option.get_type_name() == "TRANSFER") DescribePresets(json);
  }
  if (NameOf(option) == "window") json["windows"] = DescribeWindows();
  json["help"] = option.get_description();
  return json;
}

}  // namespace

Json DescribeOptions(CLI::App& command) {
  Json options = Json::array();
  for (CLI::Option* option : command.get_options()) {
    const bool help = option == command.get_help_ptr() || option == command.get_help_all_ptr();
    if (!option->get_group().empty() && !help) options.push_back(Describe(*option));
  }
  return options;
}

}  // namespace slabstream
