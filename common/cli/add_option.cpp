#include "common/cli/add_option.h"

#include <fmt/format.h>

#include <charconv>

namespace slabstream {
namespace {

// CLI11 keeps nothing with an option but validators. A note is one that lets every value pass, and its name is the note.
constexpr std::string_view kChoice = "choice ", kMin = "min ", kMax = "max ", kAbove = "above ";

CLI::Option* Note(CLI::Option* option, const std::string& note) {
  return option->check(CLI::Validator([](std::string&) { return std::string(); }, "", note));
}

double Number(std::string_view text) {
  double number = 0;
  std::from_chars(text.data(), text.data() + text.size(), number);
  return number;
}

}  // namespace

CLI::Option* NoteChoices(CLI::Option* option, const std::vector<std::string_view>& names) {
  for (const std::string_view name : names) Note(option, fmt::format("{}{}", kChoice, name));
  return option;
}

CLI::Option* NoteRange(CLI::Option* option, const NumberRange& range) {
  Note(option, fmt::format("{}{}", range.min_open ? kAbove : kMin, range.min));
  return Note(option, fmt::format("{}{}", kMax, range.max));
}

OptionDomain DomainOf(CLI::Option& option) {
  OptionDomain domain;
  for (int i = 0;; ++i) {
    std::string note;
    try {
      note = option.get_validator(i)->get_name();
    } catch (const CLI::OptionNotFound&) {
      return domain;  // there is no further one
    }
    const std::string_view text = note, value = text.substr(std::min(text.find(' ') + 1, text.size()));
    if (text.starts_with(kChoice)) {
      domain.choices.emplace_back(value);
    } else if (text.starts_with(kMin) || text.starts_with(kAbove)) {
      domain.range.emplace(NumberRange{.min = Number(value), .max = 0, .min_open = text.starts_with(kAbove)});
    } else if (text.starts_with(kMax) && domain.range) {
      domain.range->max = Number(value);
    }
  }
}

ParseText OneOf(std::vector<std::string_view> names) {
  return [names = std::move(names)](const std::string& option, const std::string& text) {
    return TextIf(ParseChoice(option, text, names).status(), text);
  };
}

CLI::Option* AddNumber(CLI::App& app, const std::string& names, double& target, NumberRange range, const std::string& help) {
  const auto parse = [range](const std::string& option, const std::string& text) { return ParseNumber(option, text, range); };
  return NoteRange(AddParsed(app, names, target, parse, help)->type_name("NUMBER")->default_str(fmt::format("{}", target)), range);
}

CLI::Option* AddRepeated(CLI::App& app, const std::string& names, std::vector<std::string>& target, const std::string& help) {
  return app.add_option(names, target, help + "; may be repeated")->expected(1)->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
}

}  // namespace slabstream
