#include "common/cli/add_option.h"

#include <fmt/format.h>

namespace slabstream {

ParseText OneOf(std::vector<std::string_view> names) {
  return [names = std::move(names)](const std::string& option, const std::string& text) {
    return TextIf(ParseChoice(option, text, names).status(), text);
  };
}

CLI::Option* AddNumber(CLI::App& app, const std::string& names, double& target, NumberRange range, const std::string& help) {
  const auto parse = [range](const std::string& option, const std::string& text) { return ParseNumber(option, text, range); };
  return AddParsed(app, names, target, parse, help)->type_name("NUMBER")->default_str(fmt::format("{}", target));
}

CLI::Option* AddRepeated(CLI::App& app, const std::string& names, std::vector<std::string>& target, const std::string& help) {
  return app.add_option(names, target, help + "; may be repeated")->expected(1)->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
}

}  // namespace slabstream
