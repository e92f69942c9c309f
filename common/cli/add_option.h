// Options in the style of all programs, declared with CLI11. An invalid value ends the parse with a CLI::ValidationError whose text is the
// line for the user.
#pragma once

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "common/base/status.h"
#include "common/cli/parse.h"

namespace slabstream {

// What an option takes, for `slabstream options`, which describes options to other programs. The option's own parser does the checking.
struct OptionDomain {
  std::vector<std::string> choices;  // empty: not a choice
  std::optional<NumberRange> range;
};
CLI::Option* NoteChoices(CLI::Option* option, const std::vector<std::string_view>& names);
CLI::Option* NoteRange(CLI::Option* option, const NumberRange& range);
OptionDomain DomainOf(CLI::Option& option);

// An option `names` ("-o,--output") whose text `parse` turns into a value: parse(option, text) -> Result<T>.
template <class T, class Parse>
CLI::Option* AddParsed(CLI::App& app, const std::string& names, T& target, Parse parse, const std::string& help) {
  const std::string shown = names.substr(0, names.find(','));
  const auto store = [&target, parse = std::move(parse), shown](const CLI::results_t& texts) {
    auto value = parse(shown, texts.back());
    if (!value.ok()) throw CLI::ValidationError(value.status().message());
    target = *std::move(value);
    return true;
  };
  return app.add_option(names, CLI::callback_t(store), help);
}

// An option whose values are separated by commas, or given one by one by repeating it; `parse` turns each into a T. Each value counts once.
template <class T, class Parse>
CLI::Option* AddParsedList(CLI::App& app, const std::string& name, std::vector<T>& target, Parse parse, const std::string& help) {
  const auto store = [&target, parse = std::move(parse), name](const CLI::results_t& texts) {
    target.clear();
    for (const std::string& text : texts) {
      for (std::size_t begin = 0; begin <= text.size();) {
        const std::size_t end = std::min(text.find(',', begin), text.size());
        auto value = parse(name, text.substr(begin, end - begin));
        if (!value.ok()) throw CLI::ValidationError(value.status().message());
        if (std::find(target.begin(), target.end(), *value) == target.end()) target.push_back(*std::move(value));
        begin = end + 1;
      }
    }
    return true;
  };
  return app.add_option(name, CLI::callback_t(store), help)
      ->expected(1)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll)
      ->type_name("LIST");
}

// An option whose value is given with `=` or omitted: --local=4, --local. `bare` stands for an omitted value. The next argument is never
// taken for its value.
template <class T, class Parse>
CLI::Option* AddOptionalValue(CLI::App& app, const std::string& name, T& target, const std::string& bare, Parse parse,
                              const std::string& help) {
  const auto given = [bare, parse = std::move(parse)](const std::string& option, const std::string& text) {
    return parse(option, text == "true" ? bare : text);  // CLI11 passes "true" for the bare form
  };
  return AddParsed(app, name, target, given, help)->expected(0);
}

// For AddParsed: takes one of `names`.
using ParseText = std::function<Result<std::string>(const std::string& option, const std::string& text)>;
ParseText OneOf(std::vector<std::string_view> names);

// For other parsers that keep the text: the text if `checked` is ok.
inline Result<std::string> TextIf(const Status& checked, const std::string& text) {
  return checked.ok() ? Result<std::string>(text) : Result<std::string>(checked);
}

// An option that takes one of `names`; each stands for one of `values`.
template <class T, std::size_t count>
CLI::Option* AddChoice(CLI::App& app, const std::string& name, T& target, const std::array<std::string_view, count>& names,
                       const std::array<T, count>& values, const std::string& help) {
  const auto parse = [names, values](const std::string& option, const std::string& text) -> Result<T> {
    const Result<std::size_t> index = ParseChoice(option, text, names);
    if (!index.ok()) return index.status();
    return values[*index];
  };
  return NoteChoices(AddParsed(app, name, target, parse, help)->type_name("NAME"), {names.begin(), names.end()});
}

CLI::Option* AddNumber(CLI::App& app, const std::string& names, double& target, NumberRange range, const std::string& help);

template <class T>
CLI::Option* AddInteger(CLI::App& app, const std::string& names, T& target, int min, int max, const std::string& help) {
  const auto parse = [min, max](const std::string& option, const std::string& text) { return ParseInteger(option, text, min, max); };
  CLI::Option* option = AddParsed(app, names, target, parse, help)->type_name("N")->default_str(std::to_string(target));
  return NoteRange(option, {double(min), double(max)});
}

// The lines of a help text that explain the entries of a list, each with a name and a purpose.
template <class Entries>
std::string Explained(const Entries& entries) {
  std::string lines;
  for (const auto& entry : entries) lines.append("\n  ").append(entry.name).append(": ").append(entry.purpose);
  return lines;
}

// An option that may be repeated: each time it adds a value.
CLI::Option* AddRepeated(CLI::App& app, const std::string& names, std::vector<std::string>& target, const std::string& help);

}  // namespace slabstream
