// Options in the style of all programs. An invalid value ends the parse with a line for the user.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <functional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "common/base/status.h"
#include "common/cli/command.h"
#include "common/cli/parse.h"
#include "common/text/split.h"

namespace slabstream {

// An option `names` ("-o,--output") whose text `parse` turns into a value: parse(option, text) -> Result<T>.
template <class T, class Parse>
Option AddParsed(const Command& app, const std::string& names, T& target, Parse parse, const std::string& help) {
  const auto store = [&target, parse = std::move(parse)](const std::string& option, const std::vector<std::string>& texts) {
    auto value = parse(option, texts.back());
    if (!value.ok()) return value.status();
    target = *std::move(value);
    return Status::Ok();
  };
  return app.AddOption(names, store, help);
}

// An option whose values are separated by `separator`, or given one by one by repeating it; `parse` turns each into a T. Each value counts
// once.
template <class T, class Parse>
Option AddParsedList(const Command& app, const std::string& name, std::vector<T>& target, Parse parse, const std::string& help,
                     char separator = ',') {
  const auto store = [&target, parse = std::move(parse), separator](const std::string& option, const std::vector<std::string>& texts) {
    target.clear();
    for (const std::string& text : texts) {
      for (const std::string_view part : Split(text, separator)) {
        auto value = parse(option, std::string(part));
        if (!value.ok()) return value.status();
        if (std::find(target.begin(), target.end(), *value) == target.end()) target.push_back(*std::move(value));
      }
    }
    return Status::Ok();
  };
  return app.AddOption(name, store, help).Repeatable().TypeName("LIST");
}

// An option whose value is given with `=` or omitted: --local=4, --local. `bare` stands for an omitted value. The next argument is never
// taken for its value.
template <class T, class Parse>
Option AddOptionalValue(const Command& app, const std::string& name, T& target, const std::string& bare, Parse parse,
                        const std::string& help) {
  const auto given = [bare, parse = std::move(parse)](const std::string& option, const std::string& text) {
    return parse(option, text == "true" ? bare : text);
  };
  return AddParsed(app, name, target, given, help).ValueBehindEquals();
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
Option AddChoice(const Command& app, const std::string& name, T& target, const std::array<std::string_view, count>& names,
                 const std::array<T, count>& values, const std::string& help) {
  const auto parse = [names, values](const std::string& option, const std::string& text) -> Result<T> {
    const Result<std::size_t> index = ParseChoice(option, text, names);
    if (!index.ok()) return index.status();
    return values[*index];
  };
  return AddParsed(app, name, target, parse, help).TypeName("NAME").Choices({names.begin(), names.end()});
}

Option AddNumber(const Command& app, const std::string& names, double& target, NumberRange range, const std::string& help);

template <class T>
Option AddInteger(const Command& app, const std::string& names, T& target, int min, int max, const std::string& help) {
  const auto parse = [min, max](const std::string& option, const std::string& text) { return ParseInteger(option, text, min, max); };
  return AddParsed(app, names, target, parse, help).TypeName("N").Default(std::to_string(target)).Range({double(min), double(max)});
}

// The lines of a help text that explain the entries of a list, each with a name and a purpose.
template <class Entries>
std::string Explained(const Entries& entries) {
  std::string lines;
  for (const auto& entry : entries) lines.append("\n  ").append(entry.name).append(": ").append(entry.purpose);
  return lines;
}

// An option that may be repeated: each time it adds a value.
Option AddRepeated(const Command& app, const std::string& names, std::vector<std::string>& target, const std::string& help);

}  // namespace slabstream
