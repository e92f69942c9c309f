// A run that was interrupted, anywhere and in any way, ends with what one in one go has; no trial is run twice.
#include "laboratory/experiments/trials.h"

#include <gmock/gmock.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>

#include "tests/support/random.h"
#include "tests/support/temporary_directory.h"
#include "tests/support/whole_file.h"

namespace slabstream {
namespace {

using testing::HasSubstr;

constexpr int kTrials = 7, kRepeats = 3;

RunIdentity Identity() { return {"test", {{"seed", 4}, {"repeats", kRepeats}}, "c0ffee", "a machine"}; }

// Numbers depend on the key alone; every run is counted.
std::vector<Trial> Trials(std::map<std::string, int>& runs, std::vector<int>* order = nullptr) {
  std::vector<Trial> trials;
  for (int i = 0; i < kTrials; ++i) {
    Trial trial{{{"i", i}}, nullptr, 1.0 + i};
    trial.run = [&runs, order, i] {
      ++runs[std::to_string(i)];
      if (order != nullptr) order->push_back(i);
      return Json{{"value", i * 1.1}, {"list", {i, 2.0 * i}}, {"inner", {{"double", 2.0 * i}}}};
    };
    trials.push_back(std::move(trial));
  }
  return trials;
}

template <class Work>
Status StatusOf(Work&& work) {
  try {
    work();
  } catch (const Failure& failure) {
    return failure.status();
  }
  return Status::Ok();
}

Result<TrialLog> Open(const TemporaryDirectory& folder, const RunIdentity& identity = Identity(), Resume resume = Resume::kSame) {
  return TrialLog::Open(folder / "run", identity, resume);
}

TEST(Trials, RunsEveryRepeatInARandomOrderOfTheSeed) {
  std::vector<std::vector<int>> orders;
  for (const int seed : {4, 4, 5}) {
    const TemporaryDirectory folder;
    Result<TrialLog> log = Open(folder);
    ASSERT_TRUE(log.ok());
    std::map<std::string, int> runs;
    RunTrials(Trials(runs, &orders.emplace_back()), {std::uint64_t(seed), kRepeats, false, {}}, *log);
    for (int i = 0; i < kTrials; ++i) EXPECT_EQ(runs[std::to_string(i)], kRepeats);
    // Repeats are interleaved: the first round holds every trial once.
    std::vector<int> round(orders.back().begin(), orders.back().begin() + kTrials);
    std::ranges::sort(round);
    EXPECT_THAT(round, testing::ElementsAre(0, 1, 2, 3, 4, 5, 6));
    EXPECT_EQ(EstimateOf(*log, {{"i", 2}}, "value").count, kRepeats);
    EXPECT_EQ(ValuesOf(*log, {{"i", 2}}, "/inner/double").front(), 4.0);
    EXPECT_THAT(MediansOf(log->All({{"i", 5}}), "list"), testing::ElementsAre(5, 10));
  }
  EXPECT_EQ(orders[0], orders[1]);
  EXPECT_NE(orders[0], orders[2]);
}

TEST(Trials, InterruptedAnywhereItEndsLikeOneInOneGo) {
  Random random(9);
  SCOPED_TRACE(random.trace());
  const TemporaryDirectory whole;
  std::map<std::string, int> whole_runs;
  {
    Result<TrialLog> log = Open(whole);
    RunTrials(Trials(whole_runs), {4, kRepeats, false, {}}, *log);
  }
  for (int repeat = 0; repeat < 20; ++repeat) {
    const TemporaryDirectory folder;
    std::map<std::string, int> runs;
    bool done = false;
    for (int attempt = 0; attempt < 50 && !done; ++attempt) {
      Result<TrialLog> log = Open(folder);
      ASSERT_TRUE(log.ok()) << log.status().message();
      int left = random.Integer(0, 6);
      const Status status = StatusOf([&] { RunTrials(Trials(runs), {4, kRepeats, false, [&left] { return left-- == 0; }}, *log); });
      done = status.ok();
      if (!done) {
        EXPECT_EQ(status.code(), StatusCode::kCancelled);
      }
    }
    EXPECT_TRUE(done);
    EXPECT_EQ(runs, whole_runs) << "no trial twice";
    EXPECT_EQ(ReadFile(folder / "run/trials.jsonl"), ReadFile(whole / "run/trials.jsonl"));
  }
}

TEST(Trials, ALineThatACrashCutShortIsMeasuredAgain) {
  const TemporaryDirectory folder;
  std::map<std::string, int> runs;
  {
    Result<TrialLog> log = Open(folder);
    RunTrials(Trials(runs), {4, kRepeats, false, {}}, *log);
  }
  const std::string path = folder / "run/trials.jsonl", whole = ReadFile(path);
  for (std::size_t cut = whole.size() - 60; cut < whole.size(); ++cut) {
    std::ofstream(path, std::ios::trunc) << whole.substr(0, cut);
    Result<TrialLog> log = Open(folder);
    ASSERT_TRUE(log.ok()) << log.status().message();
    RunTrials(Trials(runs), {4, kRepeats, false, {}}, *log);
    EXPECT_EQ(ReadFile(path), whole);
  }
}

TEST(Trials, AFailureNamesItsTrialAndKeepsTheOthers) {
  const TemporaryDirectory folder;
  Result<TrialLog> log = Open(folder);
  std::map<std::string, int> runs;
  std::vector<Trial> trials = Trials(runs);
  trials[2].run = []() -> Json { throw Failure(Status::Unavailable("no worker")); };
  const Status status = StatusOf([&] { RunTrials(trials, {4, kRepeats, false, {}}, *log); });
  EXPECT_EQ(status, Status::Unavailable("trial {\"i\":2}: no worker"));
}

TEST(Trials, AskedForTwiceIsOneTrial) {
  const Json key = {{"what", "boxes"}}, inputs = {{"roll", 0}};
  const std::vector<Trial> trials =
      Distinct({{.key = key, .inputs = inputs}, {.key = {{"what", "picture"}}, .inputs = inputs}, {.key = key, .inputs = inputs}});
  ASSERT_EQ(trials.size(), 2U);
  EXPECT_EQ(trials[0].key, key);
}

TEST(Trials, OneKeyOfDifferentInputsIsAnErrorThatNamesThem) {
  const Json key = {{"what", "boxes"}};
  const Status status = StatusOf([&] { Distinct({{.key = key, .inputs = {{"roll", 0}}}, {.key = key, .inputs = {{"roll", 45}}}}); });
  EXPECT_EQ(status.code(), StatusCode::kInternal);
  for (const char* says : {R"({"what":"boxes"})", R"({"roll":0})", R"({"roll":45})"}) EXPECT_THAT(status.message(), HasSubstr(says));
}

TEST(TrialLog, RefusesAnotherRunInOneLine) {
  const TemporaryDirectory folder;
  ASSERT_TRUE(Open(folder).ok());
  struct Case {
    RunIdentity identity;
    const char* says;
    bool any_build_takes_it;
  };
  const std::vector<Case> cases = {
      {{"other", Identity().parameters, "c0ffee", "a machine"}, "holds experiment 'test'", false},
      {{"test", {{"seed", 5}, {"repeats", kRepeats}}, "c0ffee", "a machine"}, "holds a run with seed 4, not 5", false},
      {{"test", Identity().parameters, "decade", "a machine"}, "of commit 'c0ffee', not 'decade' (--resume", true},
      {{"test", Identity().parameters, "c0ffee", "a toaster"}, "of machine 'a machine', not 'a toaster'", true},
  };
  for (const Case& c : cases) {
    const Status same = Open(folder, c.identity).status();
    EXPECT_EQ(same.code(), StatusCode::kInvalidArgument);
    EXPECT_THAT(same.message(), HasSubstr(c.says));
    EXPECT_THAT(same.message(), HasSubstr("--fresh"));
    EXPECT_EQ(same.message().find('\n'), std::string::npos);
    const TemporaryDirectory copy;
    std::filesystem::copy(folder / "run", copy / "run");
    EXPECT_EQ(Open(copy, c.identity, Resume::kAnyBuild).ok(), c.any_build_takes_it);
    EXPECT_TRUE(Open(copy, c.identity, Resume::kNever).ok());
  }
}

TEST(TrialLog, DamageIsToldByItsLine) {
  const TemporaryDirectory folder;
  {
    Result<TrialLog> log = Open(folder);
    ASSERT_TRUE(log->Append({{"i", 1}}, 0, {{"value", 1}}).ok());
  }
  for (const char* line : {"{}", "[]", "not json", "{\"key\":1,\"repeat\":\"x\",\"numbers\":{}}"}) {
    const TemporaryDirectory copy;
    std::filesystem::copy(folder / "run", copy / "run");
    std::ofstream(copy / "run/trials.jsonl", std::ios::app) << line << "\n";
    const Status status = Open(copy).status();
    EXPECT_EQ(status.code(), StatusCode::kInvalidArgument);
    EXPECT_THAT(status.message(), HasSubstr("line 2 is not a trial"));
  }
}

}  // namespace
}  // namespace slabstream
