// How the help texts look: an option's description ends with its default or "required" in words, in no notation of the parser's.
#pragma once

#include <CLI/CLI.hpp>
#include <string>

namespace slabstream {

class HelpFormatter : public CLI::Formatter {
 public:
  HelpFormatter();
  std::string make_option_name(const CLI::Option* option, bool is_positional) const override;
  std::string make_option_opts(const CLI::Option* option) const override;
  std::string make_option_desc(const CLI::Option* option) const override;
};

}  // namespace slabstream
