#include "client/cli/option_description.h"

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>
#include <set>

#include "common/cli/add_option.h"

namespace slabstream {
namespace {

using Json = nlohmann::ordered_json;

std::string NameOf(const CLI::Option& option) {
  const std::vector<std::string>& names = option.get_lnames();
  return names.empty() ? option.get_name() : names.front();
}

// In order of their names: CLI11 keeps them in order of their addresses.
Json NamesOf(const std::set<CLI::Option*>& options) {
  std::set<std::string> names;
  for (const CLI::Option* option : options) names.insert(NameOf(*option));
  return names;
}

Json Describe(CLI::Option& option) {
  Json json = {{"name", NameOf(option)}, {"group", option.get_group()}};
  if (option.get_items_expected_max() > 0) json["type"] = option.get_type_name();
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
  json["help"] = option.get_description();
  return json;
}

}  // namespace

std::string DescribeOptions(CLI::App& command) {
  Json options = Json::array();
  for (CLI::Option* option : command.get_options()) {
    if (!option->get_group().empty() && option != command.get_help_ptr()) options.push_back(Describe(*option));
  }
  return options.dump(1) + "\n";
}

}  // namespace slabstream
