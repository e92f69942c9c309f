// Trials: the single measurements of an experiment, run in random order with their repeats interleaved, so that whatever drifts on the
// machine meanwhile (clock, heat, neighbours) meets all of them alike.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "laboratory/experiments/trial_log.h"
#include "laboratory/measure/statistics.h"

namespace slabstream {

struct Trial {
  Json key;                           // its parameters, an object; says all that decides its numbers, and no two are alike
  std::function<Result<Json>()> run;  // numbers by name, an object; must not depend on what ran before
  double effort = 1;                  // expected time beside that of other trials: for the time left
  bool repeat = true;                 // false: its numbers are computed, once is enough
};

struct TrialSchedule {
  std::uint64_t seed = 1;
  int repeats = 1;
  bool progress = false;              // a bar with the time left, on stderr
  std::function<bool()> interrupted;  // asked between trials
};

// Runs what the log does not hold yet. Cancelled once interrupted; the first trial that fails ends it, naming the trial's key.
Status RunTrials(const std::vector<Trial>& trials, const TrialSchedule& schedule, TrialLog& log);

// All repeats of a number, which is named or, with a slash in front, found by its JSON pointer. CHECKs that the trial was run and has it.
std::vector<double> ValuesOf(const TrialLog& log, const Json& key, const std::string& number);
inline Estimate EstimateOf(const TrialLog& log, const Json& key, const std::string& number) { return MedianOf(ValuesOf(log, key, number)); }
// The same where the number is a list, entry by entry, over `repeats`, which hold lists of one length.
std::vector<Estimate> EstimatesOf(const std::vector<const Json*>& repeats, const std::string& list);
std::vector<double> MediansOf(const std::vector<const Json*>& repeats, const std::string& list);

}  // namespace slabstream
