#include "client/cli/completion.h"

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
  Command command;
  Option option = Option();              // whose value it is; or none
  std::vector<std::string> positionals;  // before it, of the command
  ServiceChoice service;
};

void TakeValue(Place& place, const Option& option, const std::string& value) {
  if (option.Has("--endpoint")) place.service.endpoint = value;
  if (option.Has("--service")) place.service.file = value;
}

Place PlaceAfter(const Command& program, std::span<const std::string> words) {
  Place place{.command = program};
  for (const std::string& word : words) {
    if (place.option) {
      TakeValue(place, place.option, word);
      place.option = Option();
    } else if (word.starts_with('-') && word.size() > 1) {
      const std::size_t equals = word.find('=');
      const Option option = place.command.FindOption(word.substr(0, equals));
      if (!option) continue;
      if (equals != std::string::npos) {
        TakeValue(place, option, word.substr(equals + 1));
      } else if (option.most_values() > 0) {
        place.option = option;
      }
    } else if (const Command command = place.command.FindCommand(word); command && place.positionals.empty()) {
      place.command = command;
    } else {
      place.positionals.push_back(word);
    }
  }
  return place;
}

std::string FirstLine(const std::string& text) { return text.substr(0, text.find('\n')); }

std::vector<Candidate> Commands(const Command& app) {
  std::vector<Candidate> commands;
  for (const Command& command : app.commands()) {
    if (!command.group().empty()) commands.push_back({command.name(), FirstLine(command.description())});
  }
  return commands;
}

std::vector<Candidate> OptionNames(const Command& app) {
  std::vector<Candidate> names;
  for (const Option& option : app.options()) {
    if (option.group().empty()) continue;
    for (const std::string& name : option.long_names()) names.push_back({"--" + name, FirstLine(option.description())});
  }
  return names;
}

std::vector<Candidate> Values(const Command& command, const Option& option) {
  std::vector<Candidate> values;
  const std::string name = option.name();
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
Option ArgumentAfter(const Command& app, std::size_t count) {
  std::vector<Option> arguments = app.options();
  std::erase_if(arguments, [](const Option& option) { return !option.is_argument(); });
  if (count < arguments.size()) return arguments[count];
  return arguments.empty() || arguments.back().most_values() <= 1 ? Option() : arguments.back();
}

std::vector<Candidate> Datasets(const Place& place, std::string_view typed, const DatasetNames& datasets) {
  std::vector<Candidate> names;
  const std::size_t colon = typed.rfind(':');
  const Option transfer = place.command.FindOption("--transfer");
  if (colon != std::string_view::npos && transfer) {  // NAME:TRANSFER
    for (const Candidate& preset : Values(place.command, transfer)) {
      names.push_back({std::string(typed.substr(0, colon + 1)) + preset.word, ""});
    }
    return names;
  }
  for (const std::string& name : datasets(place.service)) names.push_back({name, "dataset"});
  return names;
}

std::vector<Candidate> Arguments(const Command& program, const Place& place, std::string_view typed, const DatasetNames& datasets) {
  if (place.positionals.empty() && !Commands(place.command).empty()) return Commands(place.command);
  const Option argument = ArgumentAfter(place.command, place.positionals.size());
  if (!argument) return {};
  const std::string name = argument.argument_name();
  if (name == "COMMAND") {
    Command about = program;
    for (const std::string& word : place.positionals) {
      about = about.FindCommand(word);
      if (!about) return {};
    }
    return Commands(about);
  }
  const bool of_service = bool(place.command.FindOption("--endpoint"));
  if (of_service && (name == "SOURCE" || name == "NAME")) return Datasets(place, typed, datasets);
  return Values(place.command, argument);
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

std::vector<Candidate> Complete(const Command& program, std::span<const std::string> words, const DatasetNames& datasets) {
  if (words.empty()) return {};
  const Place place = PlaceAfter(program, words.first(words.size() - 1));
  std::string typed = words.back(), before;  // of --NAME=VALUE the value, and what stands before it
  std::vector<Candidate> all;
  if (place.option) {
    all = Values(place.command, place.option);
  } else if (typed.starts_with('-')) {
    const std::size_t equals = typed.find('=');
    const Option option = equals == std::string::npos ? Option() : place.command.FindOption(typed.substr(0, equals));
    if (option) {
      before = typed.substr(0, equals + 1);
      typed.erase(0, equals + 1);
      all = Values(place.command, option);
    } else {
      all = OptionNames(place.command);
    }
  } else {
    all = Arguments(program, place, typed, datasets);
  }
  std::erase_if(all, [&](const Candidate& candidate) { return !candidate.word.starts_with(typed); });
  for (Candidate& candidate : all) candidate.word.insert(0, before);
  return all;
}

Status RunComplete(const Command& program, std::span<const std::string> words) {
  for (const Candidate& candidate : Complete(program, words, DatasetsAt)) std::cout << candidate.word << '\t' << candidate.purpose << '\n';
  return Status::Ok();
}

void DeclareCompletion(const CommandLine& line) {
  const Command sub = line.app.AddCommand("completion", "Print a script that lets a shell complete commands, options and their values");
  std::array<std::string_view, std::size(kShells)> names, scripts;
  for (std::size_t i = 0; i < std::size(kShells); ++i) {
    names[i] = kShells[i].name;
    scripts[i] = kShells[i].script;
  }
  auto script = std::make_shared<std::string_view>();
  AddChoice(sub, "SHELL", *script, names, scripts, "bash, zsh or fish; for bash: eval \"$(slabstream completion bash)\"").Required();
  sub.OnTyped([&run = line.run, script] {
    run = [script] {
      std::cout << *script;
      return Status::Ok();
    };
  });
}

}  // namespace slabstream
