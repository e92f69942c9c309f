// TrialLog: what was measured, kept on disk trial by trial, so that a run that was interrupted continues where it stopped.
//
// A folder holds `experiment.json` (whose run it is: RunIdentity) and `trials.jsonl`: one line a finished trial,
//   {"key": {...}, "repeat": 0, "numbers": {...}}
// A line is written at once when its trial ends. A line that a crash has cut short is dropped when the folder is opened again; any other
// line that cannot be read is an error that names it.
#pragma once

#include <cstdint>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/base/status.h"

namespace slabstream {

using Json = nlohmann::ordered_json;

// What must agree before trials of two runs may be mixed.
struct RunIdentity {
  std::string experiment;
  Json parameters;              // everything that decides which trials there are: seed, repeats, quick, volumes, the sweep's text
  std::string commit, machine;  // who measured
};

enum class Resume {
  kSame,      // continue only a run of the same identity
  kAnyBuild,  // another commit or machine is accepted too: --resume
  kNever,     // forget what the folder holds: --fresh
};

class TrialLog {
 public:
  // Makes the folder if need be. InvalidArgument in one line if it holds another run (saying what differs), or something else that would be
  // overwritten. Unavailable: it cannot be written.
  static Result<TrialLog> Open(const std::string& folder, const RunIdentity& identity, Resume resume);
  TrialLog(TrialLog&&) = default;

  // The numbers of a finished repeat; null if there are none yet.
  const Json* Find(const Json& key, int repeat) const;
  // By ascending repeat.
  std::vector<const Json*> All(const Json& key) const;
  std::size_t size() const { return trials_.size(); }

  Status Append(const Json& key, int repeat, Json numbers);

 private:
  TrialLog() = default;
  Status Load(const std::string& path);

  std::string path_;
  std::ofstream file_;
  std::map<std::pair<std::string, int>, Json> trials_;  // by dumped key and repeat
};

}  // namespace slabstream
