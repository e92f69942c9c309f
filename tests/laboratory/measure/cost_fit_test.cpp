#include "laboratory/measure/cost_fit.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

#include "tests/support/random.h"
#include "tests/support/renderers.h"

namespace slabstream {
namespace {

using ::testing::HasSubstr;

const StageModel kStage{Stage::kSplat, {WorkUnit::kBox, WorkUnit::kDrawn, WorkUnit::kSheetPixel}};

// Seconds of each unit.
WorkUnits Truth() {
  WorkUnits seconds{};
  seconds[std::size_t(WorkUnit::kBox)] = 2e-4;
  seconds[std::size_t(WorkUnit::kDrawn)] = 3e-9;
  seconds[std::size_t(WorkUnit::kSheetPixel)] = 5e-11;
  return seconds;
}

// Boxes of all sizes; times are off by about `noise` of themselves.
std::vector<CostSample> MakeSamples(Random& random, int count, double noise) {
  std::vector<CostSample> samples;
  for (int i = 0; i < count; ++i) {
    CostSample sample;
    sample.work = {1, random.Real(0, 500), 0, std::exp(random.Real(9, 15)), std::exp(random.Real(13, 19)), random.Real(0, 1e5)};
    sample.work[std::size_t(WorkUnit::kOccupied)] = sample.work[std::size_t(WorkUnit::kDrawn)] * random.Real(1, 2);
    const double off = noise * (random.Real(-1, 1) + random.Real(-1, 1) + random.Real(-1, 1));  // variance 1
    const double seconds = std::inner_product(sample.work.begin(), sample.work.end(), Truth().begin(), 0.0);
    sample.stage_ns[std::size_t(kStage.stage)] = std::llround(1e9 * seconds * (1 + off));
    samples.push_back(sample);
  }
  return samples;
}

TEST(CostFit, ExactTimesGiveTheirConstants) {
  Random random(1);
  SCOPED_TRACE(random.trace());
  const StageFit fit = FitStage(kStage, MakeSamples(random, 40, 0)).value();
  for (const TermFit& term : fit.terms) {
    const double truth = Truth()[std::size_t(term.unit)];
    EXPECT_NEAR(term.seconds, truth, 1e-3 * truth) << ToString(term.unit);
  }
  EXPECT_LT(fit.residual, 1e-3);
  EXPECT_LT(fit.prediction_error, 1e-3);
}

TEST(CostFit, IntervalsCoverTheTruthAsOftenAsTheySay) {
  Random random(2);
  SCOPED_TRACE(random.trace());
  constexpr int kFits = 300;
  int covered = 0, terms = 0;
  for (int i = 0; i < kFits; ++i) {
    const StageFit fit = FitStage(kStage, MakeSamples(random, 30, 0.1)).value();
    for (const TermFit& term : fit.terms) {
      const double truth = Truth()[std::size_t(term.unit)];
      EXPECT_LE(term.low, term.seconds);
      EXPECT_GE(term.high, term.seconds);
      covered += term.low <= truth && truth <= term.high ? 1 : 0;
      ++terms;
    }
    EXPECT_NEAR(fit.residual, 0.1, 0.06);
  }
  // 95 % of 900, with four standard deviations to either side; dividing by noisy times biases the fit a little.
  EXPECT_GE(double(covered) / terms, 0.90);
  EXPECT_LE(double(covered) / terms, 0.98);
}

TEST(CostFit, NoConstantIsBelowZeroAndUselessOnesAreZero) {
  Random random(3);
  SCOPED_TRACE(random.trace());
  for (int i = 0; i < 50; ++i) {
    StageModel with_more = kStage;
    with_more.units.push_back(WorkUnit::kOccupied);
    with_more.units.push_back(WorkUnit::kPixel);
    with_more.units.push_back(WorkUnit::kBrickTest);
    const StageFit fit = FitStage(with_more, MakeSamples(random, 40, 0.2)).value();
    for (const TermFit& term : fit.terms) {
      EXPECT_GE(term.seconds, 0);
      EXPECT_GE(term.high, term.seconds);
    }
    EXPECT_LT(fit.prediction_error, 0.3);
  }
}

TEST(CostFit, UnitsThatNeverOccurDoNotMatter) {
  Random random(4);
  SCOPED_TRACE(random.trace());
  std::vector<CostSample> samples = MakeSamples(random, 20, 0);
  for (CostSample& sample : samples) sample.work[std::size_t(WorkUnit::kPixel)] = 0;
  StageModel stage = kStage;
  stage.units.push_back(WorkUnit::kPixel);
  const StageFit fit = FitStage(stage, samples).value();
  EXPECT_EQ(fit.terms.back().seconds, 0);
  EXPECT_NEAR(fit.terms[1].seconds, 3e-9, 1e-11);
}

TEST(CostFit, TooFewSamplesAreToldOf) {
  Random random(5);
  SCOPED_TRACE(random.trace());
  const Result<StageFit> fit = FitStage(kStage, MakeSamples(random, 8, 0));
  ASSERT_FALSE(fit.ok());
  EXPECT_THAT(fit.status().message(), HasSubstr("splat"));
  EXPECT_THAT(fit.status().message(), HasSubstr("9"));
}

TEST(CostFit, FitsEveryStageOfTheModel) {
  Random random(6);
  SCOPED_TRACE(random.trace());
  for (const RendererKind* renderer : {Splatting(), ZBuffer()}) {  // the paper's
    for (StageModel stage : CostModelOf(renderer->name())) {
      std::vector<CostSample> samples = MakeSamples(random, 60, 0.02);
      stage.stage = kStage.stage;  // whose time the samples hold
      for (CostSample& sample : samples) {
        double seconds = 0;
        for (const WorkUnit unit : stage.units) seconds += 1e-9 * sample.work[std::size_t(unit)];
        sample.stage_ns[std::size_t(stage.stage)] = std::llround(1e9 * seconds * random.Real(0.95, 1.05));
      }
      EXPECT_LT(FitStage(stage, samples).value().prediction_error, 0.05) << ToString(stage.stage);
    }
  }
  EXPECT_TRUE(CostModelOf("another").empty());
}

}  // namespace
}  // namespace slabstream
