// Formats the help texts: an option's description ends with its default or "required" in words, not in the parser's notation.
#pragma once

#include <CLI/CLI.hpp>
#include <string>

namespace slabstream {

// The description of an option with its default or "required"; not wrapped.
std::string OptionText(const CLI::Option& option);

class HelpFormatter : public CLI::Formatter {
 public:
  HelpFormatter();
  std::string make_option_name(const CLI::Option* option, bool is_positional) const override;
  std::string make_option_opts(const CLI::Option* option) const override;
  std::string make_option_desc(const CLI::Option* option) const override;
};

}  // namespace slabstream
