// Formats the help texts: an option's description ends with its default or "required" in words, not in the parser's notation. The help of
// a command with many options shows those that most users want, and examples; --help-all shows all of them.
#pragma once

#include <CLI/CLI.hpp>
#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace slabstream {

// The description of an option with its default or "required"; not wrapped.
std::string OptionText(const CLI::Option& option);

struct HelpExample {
  std::string_view command, purpose;  // as it is typed; what it does
};

struct HelpPage {
  std::vector<std::string_view> options = {};  // names without dashes, of those that --help shows; empty: it shows all
  std::vector<HelpExample> examples;
};

class HelpFormatter : public CLI::Formatter {
 public:
  HelpFormatter();
  // What the help of this command shows beside its arguments. Its options exist already.
  void SetPage(const CLI::App& command, HelpPage page);
  // Of a program that SetUp has set up. Null: the command has no page, and its help shows all of its options.
  static const HelpPage* PageOf(const CLI::App& command);

  std::string make_help(const CLI::App* app, std::string name, CLI::AppFormatMode mode) const override;
  std::string make_footer(const CLI::App* app) const override;
  std::string make_option_name(const CLI::Option* option, bool is_positional) const override;
  std::string make_option_opts(const CLI::Option* option) const override;
  std::string make_option_desc(const CLI::Option* option) const override;

 private:
  std::string FirstOptions(const CLI::App& app, const std::string& name) const;

  std::map<const CLI::App*, HelpPage> pages_;
};

}  // namespace slabstream
