#include "common/cli/command.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <charconv>
#include <iostream>
#include <utility>

#include "common/base/check.h"
#include "common/cli/help_formatter.h"
#include "common/cli/man_page.h"

namespace slabstream {
namespace {

// CLI11 keeps nothing with an option but validators. A note is one that lets every value pass, and its name is the note.
constexpr std::string_view kChoice = "choice ", kMin = "min ", kMax = "max ", kAbove = "above ";

void Note(CLI::Option& option, const std::string& note) {
  option.check(CLI::Validator([](std::string&) { return std::string(); }, "", note));
}

double Number(std::string_view text) {
  double number = 0;
  std::from_chars(text.data(), text.data() + text.size(), number);
  return number;
}

// In order: CLI11 keeps them in order of their addresses.
std::set<std::string> NamesOf(const std::set<CLI::Option*>& options) {
  std::set<std::string> names;
  for (CLI::Option* option : options) names.insert(Option(option).name());
  return names;
}

void ThrowUnlessOk(const Status& status) {
  if (!status.ok()) throw CLI::ValidationError(status.message());
}

}  // namespace

Option Option::TypeName(const std::string& name) const { return Option(cli().type_name(name)); }
Option Option::Default(const std::string& text) const { return Option(cli().default_str(text)); }
Option Option::Group(const std::string& heading) const { return Option(cli().group(heading)); }
Option Option::Description(const std::string& text) const { return Option(cli().description(text)); }
Option Option::Required() const { return Option(cli().required()); }
Option Option::Excludes(Option other) const { return Option(cli().excludes(&other.cli())); }
Option Option::Needs(Option other) const { return Option(cli().needs(&other.cli())); }
Option Option::ValueBehindEquals() const { return Option(cli().expected(0)); }
Option Option::MaybeValue() const { return Option(cli().expected(0, 1)); }
Option Option::Repeatable() const { return Option(cli().expected(1)->multi_option_policy(CLI::MultiOptionPolicy::TakeAll)); }

Option Option::Choices(const std::vector<std::string_view>& names) const {
  for (const std::string_view name : names) Note(cli(), fmt::format("{}{}", kChoice, name));
  return *this;
}

Option Option::Range(const NumberRange& range) const {
  Note(cli(), fmt::format("{}{}", range.min_open ? kAbove : kMin, range.min));
  Note(cli(), fmt::format("{}{}", kMax, range.max));
  return *this;
}

OptionDomain Option::domain() const {
  OptionDomain domain;
  for (int i = 0;; ++i) {
    std::string note;
    try {
      note = cli().get_validator(i)->get_name();
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

std::string Option::name() const { return cli().get_lnames().empty() ? cli().get_name() : cli().get_lnames().front(); }
std::vector<std::string> Option::long_names() const { return cli().get_lnames(); }
std::string Option::argument_name() const { return cli().get_name(true); }
bool Option::Has(const std::string& typed) const { return cli().check_name(typed); }
std::string Option::group() const { return cli().get_group(); }
std::string Option::description() const { return cli().get_description(); }
std::string Option::type_name() const { return cli().get_type_name(); }
std::string Option::default_text() const { return cli().get_default_str(); }
int Option::most_values() const { return cli().get_items_expected_max(); }
bool Option::is_argument() const { return cli().get_positional(); }
bool Option::required() const { return cli().get_required(); }
bool Option::repeatable() const { return cli().get_multi_option_policy() == CLI::MultiOptionPolicy::TakeAll; }
std::set<std::string> Option::excluded() const { return NamesOf(cli().get_excludes()); }
std::set<std::string> Option::needed() const { return NamesOf(cli().get_needs()); }
bool Option::given() const { return cli().count() > 0; }
std::vector<std::string> Option::texts() const { return cli().results(); }

CLI::Option& Option::cli() const {
  CHECK(option_ != nullptr) << "there is no such option";
  return *option_;
}

Command Command::AddCommand(const std::string& name, const std::string& description) const {
  return Command(cli().add_subcommand(name, description));
}

Option Command::AddText(const std::string& names, std::string& target, const std::string& help) const {
  return Option(cli().add_option(names, target, help));
}

Option Command::AddTexts(const std::string& names, std::vector<std::string>& target, const std::string& help) const {
  return Option(cli().add_option(names, target, help));
}

Option Command::AddOption(const std::string& names, StoreTexts store, const std::string& help) const {
  const auto call = [store = std::move(store), shown = names.substr(0, names.find(','))](const CLI::results_t& texts) {
    ThrowUnlessOk(store(shown, texts));
    return true;
  };
  return Option(cli().add_option(names, CLI::callback_t(call), help));
}

Option Command::AddFlag(const std::string& names, bool& target, const std::string& help) const {
  return Option(cli().add_flag(names, target, help));
}

Option Command::AddFlag(const std::string& names, const std::string& help) const { return Option(cli().add_flag(names, help)); }

Option Command::AddFlag(const std::string& names, std::function<void()> on, const std::string& help) const {
  return Option(cli().add_flag_callback(names, std::move(on), help));
}

Option Command::AddSwitch(const std::string& names, std::function<Status(bool on)> set, const std::string& help) const {
  return Option(cli().add_flag_function(
      names, [set = std::move(set)](std::int64_t count) { ThrowUnlessOk(set(count > 0)); }, help));
}

void Command::GroupOptions(const std::string& heading) const { cli().option_defaults()->group(heading); }
void Command::Group(const std::string& heading) const { cli().group(heading); }
void Command::TakeCommand(bool required) const { cli().require_subcommand(required ? 1 : 0, 1); }

void Command::AfterParse(std::function<Status()> check) const {
  cli().parse_complete_callback([check = std::move(check)] { ThrowUnlessOk(check()); });
}

void Command::OnTyped(std::function<void()> act) const { cli().callback(std::move(act)); }

std::string Command::name() const { return cli().get_name(); }
std::string Command::full_name() const { return is_program() ? name() : Command(cli().get_parent()).full_name() + " " + name(); }
std::string Command::description() const { return cli().get_description(); }
std::string Command::group() const { return cli().get_group(); }
bool Command::is_program() const { return cli().get_parent() == nullptr; }
bool Command::needs_command() const { return cli().get_require_subcommand_min() > 0; }
std::vector<std::string> Command::option_groups() const { return cli().get_groups(); }

std::vector<Command> Command::commands() const {
  std::vector<Command> commands;
  for (CLI::App* command : cli().get_subcommands(nullptr)) commands.emplace_back(command);
  return commands;
}

std::vector<Option> Command::options() const {
  std::vector<Option> options;
  for (CLI::Option* option : cli().get_options()) options.emplace_back(option);
  return options;
}

Command Command::FindCommand(std::string_view name) const {
  const std::vector<Command> all = commands();
  const auto found = std::ranges::find_if(all, [&](const Command& command) { return command.name() == name; });
  return found == all.end() ? Command() : *found;
}

Option Command::FindOption(const std::string& name) const { return Option(cli().get_option_no_throw(name)); }

bool Command::IsHelp(Option option) const { return &option.cli() == cli().get_help_ptr() || &option.cli() == cli().get_help_all_ptr(); }

std::string Command::HelpText() const { return cli().get_formatter()->make_help(&cli(), full_name(), CLI::AppFormatMode::Normal); }

std::vector<Command> Command::typed() const {
  std::vector<Command> commands;
  for (CLI::App* command : cli().get_subcommands()) commands.emplace_back(command);
  return commands;
}

std::vector<std::string> Command::not_taken() const { return cli().remaining(true); }

CLI::App& Command::cli() const {
  CHECK(command_ != nullptr) << "there is no such command";
  return *command_;
}

Program::Program(std::unique_ptr<CLI::App> app) : Command(app.get()), app_(std::move(app)) { app_->set_help_flag(); }

Program::Program() : Program(std::make_unique<CLI::App>()) {}

Program::Program(const std::string& description, const std::string& name, const std::string& version)
    : Program(std::make_unique<CLI::App>(description, name)) {
  app_->formatter(MakeHelpFormatter());
  app_->set_help_flag("-h,--help", "Print this text");
  app_->set_version_flag("--version", version, "Print the version");
  const auto print_page = [this] {
    std::cout << ManPage(*this, this->name());
    throw CLI::Success();
  };
  app_->add_flag_callback("--man", print_page, "Print the manual page")->group("");
}

Program::~Program() = default;

void Program::AddHelpAll() const { app_->set_help_all_flag("--help-all", "Print all options"); }

ParseEnd Program::Parse(std::vector<std::string> arguments) const {
  std::ranges::reverse(arguments);  // as CLI11 wants them
  try {
    app_->parse(std::move(arguments));
  } catch (const CLI::Success& asked) {
    app_->exit(asked);
    return {.kind = ParseEnd::Kind::kAnswered};
  } catch (const CLI::ExtrasError& error) {
    return {.kind = ParseEnd::Kind::kNotTaken, .message = error.what()};
  } catch (const CLI::RequiredError& error) {
    return {.kind = ParseEnd::Kind::kMissing, .message = error.what()};
  } catch (const CLI::Error& error) {
    return {.kind = ParseEnd::Kind::kWrong, .message = error.what()};
  }
  return {};
}

}  // namespace slabstream
