#include "client/cli/completion.h"

#include <algorithm>
#include <chrono>
#include <iostream>
#include <memory>

#include "client/client.h"
#include "client/request/option_description.h"
#include "client/service/service_state.h"
#include "common/json/json.h"

namespace slabstream {
namespace {

struct Shell {
  std::string_view name, script;
};
constexpr Shell kShells[] = {
    {"bash", R"script(# bash completion of slabstream
_slabstream() {
  # Bash also cuts at = and :, so the words are put together again, and the part before the cut is taken off the candidates.
  local words=() word last="" line
  for word in "${COMP_WORDS[@]:1:COMP_CWORD}"; do
    if [[ ${#words[@]} -gt 0 && ( $word == [=:]* || $last == *[=:] ) ]]; then
      words[-1]+="$word"
    else
      words+=("$word")
    fi
    last="$word"
  done
  local cut="${words[-1]%"${last#[=:]}"}"
  COMPREPLY=()
  while IFS= read -r line; do
    line="${line%%$'\t'*}"
    COMPREPLY+=("${line#"$cut"}")
  done < <("${COMP_WORDS[0]}" complete "${words[@]}" 2> /dev/null)
}
complete -o bashdefault -o default -F _slabstream slabstream
)script"},
    {"zsh", R"script(#compdef slabstream
# zsh completion of slabstream
_slabstream() {
  local -a candidates
  local line
  while IFS= read -r line; do
    candidates+=("${${line%%$'\t'*}//:/\\:}:${line#*$'\t'}")
  done < <("${words[1]}" complete "${(@Q)words[2,CURRENT]}" 2> /dev/null)
  if (( ${#candidates} )); then
    _describe -V slabstream candidates
  else
    _files
  fi
}
if [[ $funcstack[1] == _slabstream ]]; then
  _slabstream "$@"
else
  compdef _slabstream slabstream
fi
)script"},
    {"fish", R"script(# fish completion of slabstream
function __slabstream_complete
  set -l words (commandline -opc)
  set -l candidates ($words[1] complete $words[2..-1] (commandline -ct) 2> /dev/null)
  if test (count $candidates) -gt 0
    printf '%s\n' $candidates
  else
    __fish_complete_path (commandline -ct)
  end
end
complete -c slabstream -f -a '(__slabstream_complete)'
)script"},
};

// Where the last word stands: what the words before it say.
struct Place {
  CLI::App* command = nullptr;
  CLI::Option* option = nullptr;         // whose value it is
  std::vector<std::string> positionals;  // before it, of the command
  ServiceChoice service;
};

void TakeValue(Place& place, const CLI::Option& option, const std::string& value) {
  if (option.check_name("--endpoint")) place.service.endpoint = value;
  if (option.check_name("--service")) place.service.file = value;
}

CLI::App* CommandNamed(CLI::App& app, std::string_view name) {
  const auto found = app.get_subcommands([&](const CLI::App* command) { return command->get_name() == name; });
  return found.empty() ? nullptr : found.front();
}

Place PlaceAfter(CLI::App& program, std::span<const std::string> words) {
  Place place{.command = &program};
  for (const std::string& word : words) {
    if (place.option != nullptr) {
      TakeValue(place, *place.option, word);
      place.option = nullptr;
    } else if (word.starts_with('-') && word.size() > 1) {
      const std::size_t equals = word.find('=');
      CLI::Option* const option = place.command->get_option_no_throw(word.substr(0, equals));
      if (option == nullptr) continue;
      if (equals != std::string::npos) {
        TakeValue(place, *option, word.substr(equals + 1));
      } else if (option->get_items_expected_max() > 0) {
        place.option = option;
      }
    } else if (CLI::App* const command = CommandNamed(*place.command, word); command != nullptr && place.positionals.empty()) {
      place.command = command;
    } else {
      place.positionals.push_back(word);
    }
  }
  return place;
}

std::string FirstLine(const std::string& text) { return text.substr(0, text.find('\n')); }

std::vector<Candidate> Commands(const CLI::App& app) {
  std::vector<Candidate> commands;
  for (const CLI::App* command : app.get_subcommands(nullptr)) {
    if (!command->get_group().empty()) commands.push_back({command->get_name(), FirstLine(command->get_description())});
  }
  return commands;
}

std::vector<Candidate> OptionNames(CLI::App& app) {
  std::vector<Candidate> names;
  for (const CLI::Option* option : app.get_options()) {
    if (option->get_group().empty()) continue;
    for (const std::string& name : option->get_lnames()) names.push_back({"--" + name, FirstLine(option->get_description())});
  }
  return names;
}

std::vector<Candidate> Values(CLI::App& command, const CLI::Option& option) {
  std::vector<Candidate> values;
  const std::string name = option.get_lnames().empty() ? option.get_name() : option.get_lnames().front();
  for (const Json& described : DescribeOptions(command)) {
    if (described["name"] != name) continue;
    for (const char* list : {"choices", "presets"}) {
      for (const auto& value : described.value(list, Json::array())) values.push_back({value.text(), ""});
    }
    if (described.contains("renderers")) values = {{"auto", ""}};  // and those below, with their purposes
    for (const auto& renderer : described.value("renderers", Json::array())) {
      values.push_back({renderer["name"].text(), renderer["purpose"].text()});
    }
    for (const auto& window : described.value("windows", Json::array())) values.push_back({window["name"].text(), ""});
  }
  return values;
}

// The argument that comes after `count` others.
const CLI::Option* PositionalAfter(const CLI::App& app, std::size_t count) {
  const auto positionals = app.get_options([](const CLI::Option* option) { return option->get_positional(); });
  if (positionals.empty()) return nullptr;
  if (count < positionals.size()) return positionals[count];
  return positionals.back()->get_items_expected_max() > 1 ? positionals.back() : nullptr;
}

std::vector<Candidate> Datasets(const Place& place, std::string_view typed, const DatasetNames& datasets) {
  std::vector<Candidate> names;
  const std::size_t colon = typed.rfind(':');
  const CLI::Option* const transfer = place.command->get_option_no_throw("--transfer");
  if (colon != std::string_view::npos && transfer != nullptr) {  // NAME:TRANSFER
    for (const Candidate& preset : Values(*place.command, *transfer)) {
      names.push_back({std::string(typed.substr(0, colon + 1)) + preset.word, ""});
    }
    return names;
  }
  for (const std::string& name : datasets(place.service)) names.push_back({name, "dataset"});
  return names;
}

std::vector<Candidate> Arguments(CLI::App& program, const Place& place, std::string_view typed, const DatasetNames& datasets) {
  if (place.positionals.empty() && !Commands(*place.command).empty()) return Commands(*place.command);
  const CLI::Option* const argument = PositionalAfter(*place.command, place.positionals.size());
  if (argument == nullptr) return {};
  const std::string name = argument->get_name(true);
  if (name == "COMMAND") {
    CLI::App* about = &program;
    for (const std::string& word : place.positionals) {
      about = CommandNamed(*about, word);
      if (about == nullptr) return {};
    }
    return Commands(*about);
  }
  const bool of_service = place.command->get_option_no_throw("--endpoint") != nullptr;
  if (of_service && (name == "SOURCE" || name == "NAME")) return Datasets(place, typed, datasets);
  return Values(*place.command, *argument);
}

std::vector<std::string> DatasetsAt(const ServiceChoice& choice) {
  constexpr Duration kPatience = std::chrono::milliseconds(500);
  const Result<ServiceAddress> service = ResolveService(choice);
  if (!service.ok()) return {};
  Context context;
  Result<Client> client = Client::Connect(context, *service, kPatience);
  if (!client.ok()) return {};
  const Result<std::vector<DatasetStatus>> datasets = client->OrderData({}, kPatience);
  std::vector<std::string> names;
  if (datasets.ok()) {
    for (const DatasetStatus& dataset : *datasets) names.push_back(dataset.name);
  }
  return names;
}

}  // namespace

std::vector<Candidate> Complete(CLI::App& program, std::span<const std::string> words, const DatasetNames& datasets) {
  if (words.empty()) return {};
  const Place place = PlaceAfter(program, words.first(words.size() - 1));
  std::string typed = words.back(), before;  // of --NAME=VALUE the value, and what stands before it
  std::vector<Candidate> all;
  if (place.option != nullptr) {
    all = Values(*place.command, *place.option);
  } else if (typed.starts_with('-')) {
    const std::size_t equals = typed.find('=');
    const CLI::Option* const option = equals == std::string::npos ? nullptr : place.command->get_option_no_throw(typed.substr(0, equals));
    if (option != nullptr) {
      before = typed.substr(0, equals + 1);
      typed.erase(0, equals + 1);
      all = Values(*place.command, *option);
    } else {
      all = OptionNames(*place.command);
    }
  } else {
    all = Arguments(program, place, typed, datasets);
  }
  std::erase_if(all, [&](const Candidate& candidate) { return !candidate.word.starts_with(typed); });
  for (Candidate& candidate : all) candidate.word.insert(0, before);
  return all;
}

Status RunComplete(CLI::App& program, std::span<const std::string> words) {
  for (const Candidate& candidate : Complete(program, words, DatasetsAt)) std::cout << candidate.word << '\t' << candidate.purpose << '\n';
  return Status::Ok();
}

void DeclareCompletion(const CommandLine& line) {
  CLI::App* sub = line.app.add_subcommand("completion", "Print a script that lets a shell complete commands, options and their values");
  std::array<std::string_view, std::size(kShells)> names, scripts;
  for (std::size_t i = 0; i < std::size(kShells); ++i) {
    names[i] = kShells[i].name;
    scripts[i] = kShells[i].script;
  }
  auto script = std::make_shared<std::string_view>();
  AddChoice(*sub, "SHELL", *script, names, scripts, "bash, zsh or fish; for bash: eval \"$(slabstream completion bash)\"")->required();
  sub->callback([&run = line.run, script] {
    run = [script] {
      std::cout << *script;
      return Status::Ok();
    };
  });
}

}  // namespace slabstream
