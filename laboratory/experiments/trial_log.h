// TrialLog: keeps measurements on disk trial by trial, so that an interrupted run continues where it stopped.
//
// A folder holds `experiment.json` (the identity of the run: RunIdentity) and `trials.jsonl`: one line a finished trial,
//   {"key": {...}, "repeat": 0, "numbers": {...}, "other_load": 0.01}
// "other_load" is missing if the trial was too short for it (laboratory/measure/other_load.h).
// A line is written as soon as its trial ends. A line cut short by a crash is dropped when the folder is opened again; any other unreadable
// line is an error that names it.
#pragma once

#include <fstream>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/base/status.h"
#include "common/json/json.h"

namespace slabstream {

// Trials of two runs may be mixed only if these agree.
struct RunIdentity {
  std::string experiment;
  // All that decides which trials there are: the seed, the repeats, whether the run is quick, the volumes and what they hold, the sweep.
  Json parameters;
  std::string commit, machine;  // who measured
};

enum class Resume {
  kSame,      // continue only a run of the same identity
  kAnyBuild,  // another commit or machine is accepted too: --resume
  kNever,     // forget what the folder holds: --fresh
};

class TrialLog {
 public:
  // Creates the folder if need be. InvalidArgument in one line: it holds another run (the line says what differs), or something else that
  // would be overwritten. Unavailable: it cannot be written.
  static Result<TrialLog> Open(const std::string& folder, const RunIdentity& identity, Resume resume);
  TrialLog(TrialLog&&) = default;

  // The numbers of a finished repeat; null if there are none yet.
  const Json* Find(const Json& key, int repeat) const;
  // By ascending repeat.
  std::vector<const Json*> All(const Json& key) const;
  std::size_t size() const { return trials_.size(); }

  Status Append(const Json& key, int repeat, Json numbers, std::optional<double> other_load = std::nullopt);
  // The other loads of all trials that have one.
  const std::vector<double>& other_loads() const { return other_loads_; }

 private:
  TrialLog() = default;
  Status Load(const std::string& path);

  std::string path_;
  std::ofstream file_;
  std::map<std::pair<std::string, int>, Json> trials_;  // by dumped key and repeat
  std::vector<double> other_loads_;
};

}  // namespace slabstream
