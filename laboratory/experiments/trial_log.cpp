#include "laboratory/experiments/trial_log.h"

#include <fmt/format.h>

#include <cerrno>
#include <cstring>
#include <filesystem>

#include "common/files/files.h"

namespace slabstream {
namespace {

constexpr std::size_t kMaxIdentityBytes = std::size_t{4} << 20;  // a sweep file is part of it

std::string IdentityPath(const std::string& folder) { return folder + "/experiment.json"; }
std::string LogPath(const std::string& folder) { return folder + "/trials.jsonl"; }

Json IdentityJson(const RunIdentity& identity) {
  return {
      {"experiment", identity.experiment}, {"parameters", identity.parameters}, {"commit", identity.commit}, {"machine", identity.machine}};
}

// The reason why the trials of `held` cannot be continued; empty: they can.
std::string WhyNot(const Json& held, const Json& wanted, Resume resume) {
  if (!held.is_object()) return "something else";
  if (held.value("experiment", "") != wanted["experiment"]) return fmt::format("experiment '{}'", held.value("experiment", ""));
  if (!held.contains("parameters") || !held["parameters"].is_object()) return "something else";
  for (const auto& [name, value] : wanted["parameters"].items()) {
    const Json before = held["parameters"].value(name, Json());
    if (before != value) return fmt::format("a run with {} {}, not {}", name, before.dump(), value.dump());
  }
  if (resume == Resume::kAnyBuild) return "";
  for (const char* who : {"commit", "machine"}) {
    const std::string before = held.value(who, "");
    if (before != wanted[who])
      return fmt::format("a run of {} '{}', not '{}' (--resume continues it anyway)", who, before, wanted[who].text());
  }
  return "";
}

}  // namespace

Result<TrialLog> TrialLog::Open(const std::string& folder, const RunIdentity& identity, Resume resume) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) return Status::InvalidArgument(fmt::format("--output '{}' cannot be made: {}", folder, error.message()));
  const Json wanted = IdentityJson(identity);
  TrialLog log;
  const bool known = std::filesystem::exists(IdentityPath(folder), error);
  if (known && resume != Resume::kNever) {
    const Result<std::string> text = ReadTextFile(IdentityPath(folder), kMaxIdentityBytes);
    if (!text.ok()) return text.status();
    const Result<Json> held = Json::Parse(*text);
    if (const std::string why = WhyNot(held.ok() ? *held : Json(), wanted, resume); !why.empty()) {
      return Status::InvalidArgument(fmt::format("--output '{}' holds {}; --fresh deletes it", folder, why));
    }
    if (Status status = log.Load(LogPath(folder)); !status.ok()) return status;
  } else {
    std::filesystem::remove(LogPath(folder), error);
  }
  if (Status status = WriteTextFile(IdentityPath(folder), wanted.dump(1) + "\n"); !status.ok()) return status;
  log.path_ = LogPath(folder);
  log.file_.open(log.path_, std::ios::binary | std::ios::app);
  if (!log.file_) return Status::Unavailable(fmt::format("cannot write '{}': {}", log.path_, std::strerror(errno)));
  return log;
}

Status TrialLog::Load(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::uintmax_t whole_lines = 0;  // bytes
  int number = 1;
  for (std::string line; std::getline(file, line); ++number) {
    if (file.eof()) {  // no end of line: cut short while it was written
      std::error_code error;
      std::filesystem::resize_file(path, whole_lines, error);
      return error ? Status::Unavailable(fmt::format("cannot write '{}': {}", path, error.message())) : Status::Ok();
    }
    const Result<Json> read = Json::Parse(line);
    const Json trial = read.ok() ? *read : Json();
    if (!trial.contains("key") || !trial.value("repeat", Json()).is_number_integer() || !trial.contains("numbers")) {
      return Status::InvalidArgument(fmt::format("'{}' line {} is not a trial; --fresh starts over", path, number));
    }
    if (const Json load = trial.value("other_load", Json()); load.is_number()) other_loads_.push_back(load.get<double>());
    trials_[{trial["key"].dump(), trial["repeat"].get<int>()}] = trial["numbers"];
    whole_lines += line.size() + 1;
  }
  return Status::Ok();
}

const Json* TrialLog::Find(const Json& key, int repeat) const {
  const auto found = trials_.find({key.dump(), repeat});
  return found == trials_.end() ? nullptr : &found->second;
}

std::vector<const Json*> TrialLog::All(const Json& key) const {
  std::vector<const Json*> all;
  const std::string text = key.dump();
  for (auto trial = trials_.lower_bound({text, 0}); trial != trials_.end() && trial->first.first == text; ++trial)
    all.push_back(&trial->second);
  return all;
}

Status TrialLog::Append(const Json& key, int repeat, Json numbers, std::optional<double> other_load) {
  Json line = {{"key", key}, {"repeat", repeat}, {"numbers", numbers}};
  if (other_load) {
    line["other_load"] = *other_load;
    other_loads_.push_back(*other_load);
  }
  file_ << line.dump() + "\n" << std::flush;
  if (!file_) return Status::Unavailable(fmt::format("cannot write '{}': {}", path_, std::strerror(errno)));
  trials_[{key.dump(), repeat}] = std::move(numbers);
  return Status::Ok();
}

}  // namespace slabstream
