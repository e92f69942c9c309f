// Runs a test body once for every instruction set that this machine has.
#pragma once

#include <gtest/gtest.h>

#include <hwy/highway.h>

namespace slabstream {

template <class Body>
void ForEachTarget(Body&& body) {
  for (auto target : hwy::SupportedAndGeneratedTargets()) {
    SCOPED_TRACE(hwy::TargetName(target));
    hwy::SetSupportedTargetsForTest(target);
    hwy::GetChosenTarget().Update(target);
    body();
  }
  hwy::SetSupportedTargetsForTest(0);
  hwy::GetChosenTarget().DeInit();
}

}  // namespace slabstream
