// A command line: a program, its commands, and their options. Handles that hide the library which parses (CLI11): its header costs a file
// seconds of compile time, so only sources of this folder include it.
//
// 1. A Program is declared: commands (AddCommand), and options (AddText, AddFlag, AddOption; add_option.h has more kinds).
// 2. Parse (program.h) takes the arguments, calls what each option stores its text with, then what AfterParse and OnTyped were given.
//
// Handles are copied freely; they mean the same command or option, for as long as its program lives. Not thread-safe.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/status.h"
#include "common/cli/parse.h"

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace slabstream {

// What an option takes, for `slabstream options`, which describes options to other programs. The option's own parser does the checking.
struct OptionDomain {
  std::vector<std::string> choices;  // empty: not a choice
  std::optional<NumberRange> range;
};

// An option, or an argument, which has no dashes. One that was not found is false, and has no use but that.
class Option {
 public:
  explicit Option(CLI::Option* option = nullptr) : option_(option) {}
  explicit operator bool() const { return option_ != nullptr; }

  // What help texts say. Each returns the option.
  Option TypeName(const std::string& name) const;  // of its value: "FILE"
  Option Default(const std::string& text) const;   // what happens without the option
  Option Group(const std::string& heading) const;  // empty: help texts do not show the option
  Option Description(const std::string& text) const;
  Option Choices(const std::vector<std::string_view>& names) const;
  Option Range(const NumberRange& range) const;
  // What the parse checks. Each returns the option.
  Option Required() const;
  Option Excludes(Option other) const;
  Option Needs(Option other) const;
  Option ValueBehindEquals() const;  // --local=4 or --local, whose text is "true"; the next argument is never taken for the value
  Option MaybeValue() const;         // the next argument is its value, if that is no option
  Option Repeatable() const;         // each time adds one value; without this, it is given once

  // What was declared.
  std::string name() const;                     // without dashes, the first long one; of an argument its own; empty: a hidden argument
  std::vector<std::string> long_names() const;  // without dashes
  std::string argument_name() const;            // empty: not an argument
  bool Has(const std::string& typed) const;     // whether this, such as "--no-record", is one of its names
  std::string group() const;
  std::string description() const;
  std::string type_name() const;
  std::string default_text() const;
  OptionDomain domain() const;
  int most_values() const;  // behind the option; 0: a flag, or an option whose value may be left out
  bool is_argument() const;
  bool required() const;
  bool repeatable() const;
  std::set<std::string> excluded() const;  // names of other options
  std::set<std::string> needed() const;

  // After the parse.
  bool given() const;
  std::vector<std::string> texts() const;

  CLI::Option& cli() const;  // for this folder

 private:
  CLI::Option* option_;
};

// Stores the texts that were given for an option, at least one. `option` is its name for errors: "--output". InvalidArgument: a line for
// the user, which ends the parse.
using StoreTexts = std::function<Status(const std::string& option, const std::vector<std::string>& texts)>;

// A program, or a command of it. One that was not found is false, and has no use but that.
class Command {
 public:
  explicit Command(CLI::App* command = nullptr) : command_(command) {}
  explicit operator bool() const { return command_ != nullptr; }

  // What it has. Targets live as long as the program. `names`: "-o,--output", or "SOURCE" for an argument.
  Command AddCommand(const std::string& name, const std::string& description) const;
  Option AddText(const std::string& names, std::string& target, const std::string& help = "") const;
  Option AddTexts(const std::string& names, std::vector<std::string>& target, const std::string& help) const;  // of arguments
  Option AddOption(const std::string& names, StoreTexts store, const std::string& help) const;
  // Flags. A name that begins with ! turns it off: "!--no-record". `on` is called if it is given; `set` also if it is turned off.
  Option AddFlag(const std::string& names, bool& target, const std::string& help = "") const;
  Option AddFlag(const std::string& names, const std::string& help) const;  // Option::given tells
  Option AddFlag(const std::string& names, std::function<void()> on, const std::string& help) const;
  Option AddSwitch(const std::string& names, std::function<Status(bool on)> set, const std::string& help) const;
  // The heading of options that are added from now on.
  void GroupOptions(const std::string& heading) const;
  void Group(const std::string& heading) const;  // of the command itself; empty: help texts do not show it
  void TakeCommand(bool required) const;         // one of its commands at most
  // Called in the parse, after the options of the command are stored. An error ends the parse.
  void AfterParse(std::function<Status()> check) const;
  // Called last, if the command was typed.
  void OnTyped(std::function<void()> act) const;

  // What was declared.
  std::string name() const;
  std::string full_name() const;  // behind those of the commands that it belongs to: "slabstream keys rotate"
  std::string description() const;
  std::string group() const;
  bool is_program() const;
  bool needs_command() const;
  std::vector<Command> commands() const;
  std::vector<Option> options() const;
  std::vector<std::string> option_groups() const;
  Command FindCommand(std::string_view name) const;
  Option FindOption(const std::string& name) const;  // with its dashes
  bool IsHelp(Option option) const;                  // --help or --help-all
  std::string HelpText() const;                      // of --help

  // After the parse.
  std::vector<Command> typed() const;          // of its commands
  std::vector<std::string> not_taken() const;  // arguments, of all commands

  CLI::App& cli() const;  // for this folder

 private:
  CLI::App* command_;
};

// How a parse ended.
struct ParseEnd {
  enum class Kind {
    kParsed,
    kAnswered,  // --help and the like: the answer is printed
    kNotTaken,  // nothing takes some of the arguments
    kMissing,   // a required option or command
    kWrong      // something else
  };
  Kind kind = Kind::kParsed;
  std::string message = {};  // of an error: one line for the user
};

// The handle that owns a program, with the options --help, --version and, for the build, --man, or with none of them.
class Program : public Command {
 public:
  Program();  // of options alone
  // `version`: what --version prints.
  Program(const std::string& description, const std::string& name, const std::string& version);
  ~Program();

  void AddHelpAll() const;                                   // --help-all, also of commands that are added later
  ParseEnd Parse(std::vector<std::string> arguments) const;  // without the program's name; once

 private:
  explicit Program(std::unique_ptr<CLI::App> app);
  std::unique_ptr<CLI::App> app_;
};

}  // namespace slabstream
