#include "common/cli/add_option.h"

#include <fmt/format.h>

namespace slabstream {

ParseText OneOf(std::vector<std::string_view> names) {
  return [names = std::move(names)](const std::string& option, const std::string& text) {
    return TextIf(ParseChoice(option, text, names).status(), text);
  };
}

Option AddNumber(const Command& app, const std::string& names, double& target, NumberRange range, const std::string& help) {
  const auto parse = [range](const std::string& option, const std::string& text) { return ParseNumber(option, text, range); };
  return AddParsed(app, names, target, parse, help).TypeName("NUMBER").Default(fmt::format("{}", target)).Range(range);
}

Option AddRepeated(const Command& app, const std::string& names, std::vector<std::string>& target, const std::string& help) {
  return app.AddTexts(names, target, help + "; may be repeated").Repeatable();
}

}  // namespace slabstream
