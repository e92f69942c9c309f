// How labels show where a request does not say it, and where the dataset has nothing else.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "common/planning/resolved_request.h"
#include "common/planning/shown_fields.h"
#include "tests/common/planning/support.h"

namespace slabstream {
namespace {

Result<ResolvedRequest> Shown(const FrameRequest& request, bool alone) {
  VolumeSummary volume = FullSummary({32, 32, 32}), labels = volume;
  labels.description.type = ScalarType::kUint32;
  labels.labels = std::make_shared<const LabelTable>(LabelTable{{{3, {1, 0, 0}, "left"}}, true});
  auto dataset = std::make_shared<DatasetFields>();
  dataset->fields = {{}, {.name = std::string(kLabelsField), .channel = false, .labels = true, .shown = alone}};
  ShownAtTime shown = WhatShows(request, dataset).value();
  for (FieldVolume& other : shown.fields.others) {
    other.levels = {{2, std::make_shared<const VolumeSummary>(labels)}};
    other.of_volume = {0};
  }
  return ResolveRequest(request, 1, std::make_shared<const VolumeSummary>(volume), shown.fields);
}

FrameRequest In(LabelMode mode) {
  FrameRequest request{.dataset = "d", .size = {64, 64}};
  ShownLabels(request).mode = mode;
  return request;
}

LabelLook LookIn(LabelMode mode, bool alone) {
  const Result<ResolvedRequest> resolved = Shown(In(mode), alone);
  EXPECT_TRUE(resolved.ok()) << resolved.status().message();
  return resolved.ok() ? resolved->volume.fields().front().labels.value() : LabelLook();
}

TEST(LabelModeTest, AutoIsTintBesideValuesAndSurfaceWithoutThem) {
  EXPECT_EQ(LabelChoice().mode, LabelMode::kAuto);
  EXPECT_EQ(LookIn(LabelMode::kAuto, false), LookIn(LabelMode::kTint, false));
  EXPECT_TRUE(LookIn(LabelMode::kTint, false).hides);
  EXPECT_FALSE(LookIn(LabelMode::kHighlight, false).hides);
  EXPECT_EQ(LookIn(LabelMode::kAuto, true), LookIn(LabelMode::kSurface, true));
  EXPECT_EQ(LookIn(LabelMode::kSurface, true).mode, LabelMode::kSurface);
  EXPECT_FALSE(LookIn(LabelMode::kSurface, false).hides);
}

TEST(LabelModeTest, ThereIsNothingToTintBesideLabelsAlone) {
  for (const auto& [mode, name] : {std::pair(LabelMode::kTint, "tint"), {LabelMode::kHighlight, "highlight"}}) {
    const Status status = Shown(In(mode), true).status();
    EXPECT_EQ(status.code(), StatusCode::kInvalidArgument);
    EXPECT_EQ(status.message(), std::string("label-mode is '") + name +
                                    "', but dataset \"d\" has labels and no values to colour, so it must be auto or surface");
  }
}

}  // namespace
}  // namespace slabstream
