// Options that several subcommands share, declared with CLI11. A value that cannot be used ends the parse with a CLI::ValidationError whose
// text is the line for the user.
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <utility>
#include <variant>

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

CLI::Option* AddNumber(CLI::App& app, const std::string& names, double& target, NumberRange range, const std::string& help);
CLI::Option* AddInteger(CLI::App& app, const std::string& names, int& target, int min, int max, const std::string& help);

CLI::Option* AddEndpoint(CLI::App& app, std::string& endpoint);

// What --transfer takes: a ParaView colour map if the text names a file, else the name of a preset.
Result<std::variant<std::string, TransferFunction>> ParseTransfer(const std::string& option, const std::string& text);

// --threads, [1, kMaxThreads]; 0 is left where it is not given.
CLI::Option* AddThreads(CLI::App& app, int& threads, const std::string& help);

// --transfer and --opacity-distance.
void AddTransferOptions(CLI::App& app, TransferChoice& transfer);

// Everything that `render` and `turntable` share: SOURCE, connection, view, look, policy, and what is written beside pictures.
void AddFrameOptions(CLI::App& app, FrameOptions& options);

}  // namespace slabstream
