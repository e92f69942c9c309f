// Options that several subcommands share, declared with CLI11. An invalid value ends the parse with a CLI::ValidationError whose text is
// the line for the user.
#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <string>
#include <utility>

#include "client/cli/options.h"

namespace slabstream {

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

CLI::Option* AddNumber(CLI::App& app, const std::string& names, double& target, NumberRange range, const std::string& help);
CLI::Option* AddInteger(CLI::App& app, const std::string& names, int& target, int min, int max, const std::string& help);

CLI::Option* AddEndpoint(CLI::App& app, std::string& endpoint);

// Headings of the help text. Options under kHidden are not shown: old spellings that still work, and options that cannot be used yet.
inline constexpr char kOutputGroup[] = "Output", kHidden[] = "";

// --threads, [1, kMaxThreads]; 0 stays if it is not given.
CLI::Option* AddThreads(CLI::App& app, int& threads, const std::string& help);

// --transfer and --opacity-distance.
void AddTransferOptions(CLI::App& app, TransferChoice& transfer);

// After the parse, splits a `source` of the form VOLUME:TRANSFER into its parts (volume_argument.h). Calls `is_file` only then.
void ResolveSource(CLI::App& app, const CLI::Option* source, std::string& volume, TransferChoice& transfer, std::function<bool()> is_file);

// All options that `render` and `turntable` share: SOURCE, connection, view, look, policy, and the files written beside pictures.
void AddFrameOptions(CLI::App& app, FrameOptions& options);

}  // namespace slabstream
