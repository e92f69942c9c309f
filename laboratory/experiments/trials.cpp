#include "laboratory/experiments/trials.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <map>
#include <random>
#include <set>
#include <utility>

#include "client/cli/progress.h"
#include "common/base/check.h"
#include "common/base/time.h"
#include "laboratory/measure/other_load.h"

namespace slabstream {
namespace {

constexpr std::chrono::seconds kBetweenLines{10};  // of progress, where there is no terminal

struct Run {
  const Trial* trial = nullptr;
  int repeat = 0;
};

// Round after round of repeats, each in its own random order. The order depends on the seed, not on the contents of the log.
std::vector<Run> InRandomOrder(const std::vector<Trial>& trials, const TrialSchedule& schedule) {
  std::mt19937_64 random(schedule.seed);
  std::vector<Run> runs;
  for (int repeat = 0; repeat < schedule.repeats; ++repeat) {
    const std::size_t begin = runs.size();
    for (const Trial& trial : trials) runs.push_back({&trial, repeat});
    // Fisher and Yates; std::shuffle may differ from library to library.
    for (std::size_t left = runs.size() - begin; left > 1; --left) {
      const auto first = runs.begin() + std::ptrdiff_t(begin);
      std::iter_swap(first + std::ptrdiff_t(left - 1), first + std::ptrdiff_t(random() % left));
    }
  }
  return runs;
}

std::string TimeLeft(double seconds) {
  if (seconds < 90) return fmt::format("about {:.0f} s left", seconds);
  return fmt::format("about {:.0f} min left", seconds / 60);
}

Json NumbersOf(const Trial& trial) {
  try {
    return trial.run();
  } catch (const Failure& failure) {
    throw Failure(Status(failure.status().code(), fmt::format("trial {}: {}", trial.key.dump(), failure.status().message())));
  }
}

const Json& Field(const Json& numbers, std::string_view name) {
  if (!name.starts_with('/')) return numbers.at(name);
  const std::size_t end = std::min(name.find('/', 1), name.size());
  const Json& member = numbers.at(name.substr(1, end - 1));
  return end == name.size() ? member : Field(member, name.substr(end));
}

}  // namespace

std::vector<Trial> Distinct(std::vector<Trial> trials) {
  std::map<std::string, Json> inputs;  // by key
  std::erase_if(trials, [&](const Trial& trial) {
    const auto [found, is_new] = inputs.emplace(trial.key.dump(), trial.inputs);
    if (!is_new && found->second != trial.inputs) {
      throw Failure(Status::Internal(fmt::format("two different trials have the key {}: one of {}, one of {}", found->first,
                                                 found->second.dump(), trial.inputs.dump())));
    }
    return !is_new;
  });
  return trials;
}

void RunTrials(const std::vector<Trial>& trials, const TrialSchedule& schedule, TrialLog& log) {
  std::set<std::string> keys;
  for (const Trial& trial : trials) CHECK(keys.insert(trial.key.dump()).second) << "two trials have the key " << trial.key.dump();

  std::vector<Run> runs = InRandomOrder(trials, schedule);
  std::erase_if(runs, [&](const Run& run) { return log.Find(run.trial->key, run.repeat) != nullptr; });
  double effort = 0, effort_done = 0;
  for (const Run& run : runs) effort += run.trial->effort;

  ProgressBar bar(schedule.progress, effort);
  const bool terminal = ::isatty(STDERR_FILENO) == 1;
  const Time begin = MonotonicNow();
  Time told = begin;
  for (std::size_t i = 0; i < runs.size(); ++i) {
    if (schedule.interrupted && schedule.interrupted()) {
      throw Failure(Status::Cancelled(fmt::format("interrupted after {} of {} trials; the same command continues", i, runs.size())));
    }
    const Trial& trial = *runs[i].trial;
    const double passed = std::chrono::duration<double>(MonotonicNow() - begin).count();
    const std::string left = effort_done > 0 ? ", " + TimeLeft(passed / effort_done * (effort - effort_done)) : "";
    if (terminal || MonotonicNow() - told >= kBetweenLines) {
      bar.Show(effort_done, fmt::format("trial {} of {}{}", i + 1, runs.size(), left));
      told = MonotonicNow();
    }
    const OtherLoad others;
    Json numbers = NumbersOf(trial);
    OrThrow(log.Append(trial.key, runs[i].repeat, std::move(numbers), others.Share()));
    effort_done += trial.effort;
  }
}

std::vector<double> ValuesOf(const TrialLog& log, const Json& key, const std::string& number, double factor) {
  const std::vector<const Json*> repeats = log.All(key);
  CHECK(!repeats.empty()) << key.dump();
  return EachOf(repeats, [&](const Json* numbers) { return Field(*numbers, number).get<double>() * factor; });
}

std::vector<double> MediansOf(const std::vector<const Json*>& repeats, const std::string& list) {
  CHECK(!repeats.empty()) << list;
  std::vector<double> medians;
  for (std::size_t i = 0; i < Field(*repeats.front(), list).size(); ++i) {
    const auto entry = [&](const Json* numbers) { return Field(*numbers, list).at(i).get<double>(); };
    medians.push_back(MedianOf(EachOf(repeats, entry)).median);
  }
  return medians;
}

}  // namespace slabstream
