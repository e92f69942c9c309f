#include "laboratory/measure/plan_renderings.h"

#include <gtest/gtest.h>

#include "simulator/model/processors.h"
#include "tests/support/random.h"

namespace slabstream {
namespace {

// Two tasks on two simulated cores that slow each other down by so much are done when the slowdown is read off correctly.
TEST(Slowdown, IsWhatTwoSimulatedRenderingsHad) {
  Random random(41);
  SCOPED_TRACE(random.trace());
  for (int i = 0; i < 100; ++i) {
    const double slowdown = random.Real(0, 0.9), first = random.Real(0.1, 1), second = random.Real(0.1, 1);
    Processors processors(2, slowdown);
    processors.Start(0, 0, first, 0);
    processors.Start(0, 1, second, 0);
    processors.Finish();
    EXPECT_NEAR(SlowdownOf(first, second, processors.Finish().time), slowdown, 1e-9) << first << ", " << second;
  }
}

TEST(Slowdown, LessThanNothingIsSaidAsSuch) { EXPECT_NEAR(SlowdownOf(1, 2, 1.9), -0.1, 1e-12); }

}  // namespace
}  // namespace slabstream
