// Trials: the single measurements of an experiment, run in random order with their repeats interleaved, so that drift of the machine
// (clock, heat, neighbours) affects all of them alike.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "laboratory/experiments/failure.h"
#include "laboratory/experiments/trial_log.h"
#include "laboratory/measure/statistics.h"

namespace slabstream {

struct Trial {
  Json key;                   // its parameters, an object; holds all that decides its numbers
  std::function<Json()> run;  // numbers by name, an object; must not depend on what ran before; may throw Failure
  double effort = 1;          // expected time relative to other trials, for the time left
  Json inputs;                // all that `run` is given, however the key tells it; null: the key says it all
};

struct TrialSchedule {
  std::uint64_t seed = 1;
  int repeats = 1;
  bool progress = false;              // on stderr, with the time left: a bar, or a line now and then without a terminal
  std::function<bool()> interrupted;  // asked between trials
};

// Each trial once, however many sections ask for it, in the order of their first mention. Throws Failure: Internal if trials of one key
// have different inputs, since one of them would get the numbers of the other.
std::vector<Trial> Distinct(std::vector<Trial> trials);

// Runs the trials that the log does not hold yet. Their keys differ. Throws Failure: Cancelled if interrupted; the error of the first trial
// that failed, which ends the run, with its key.
void RunTrials(const std::vector<Trial>& trials, const TrialSchedule& schedule, TrialLog& log);

// All repeats of a number, given by its name, or by names that each follow a slash. CHECKs that the trial was run and has the number.
// `factor`: into another unit.
std::vector<double> ValuesOf(const TrialLog& log, const Json& key, const std::string& number, double factor = 1);
inline Estimate EstimateOf(const TrialLog& log, const Json& key, const std::string& number) { return MedianOf(ValuesOf(log, key, number)); }
// The medians of a list of numbers, entry by entry, over `repeats`, which hold lists of one length.
std::vector<double> MediansOf(const std::vector<const Json*>& repeats, const std::string& list);

}  // namespace slabstream
