#include "common/wire/validate_request.h"

#include <gtest/gtest.h>

#include <functional>
#include <limits>
#include <string>

#include "tests/common/planning/support.h"

namespace slabstream {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

TEST(ValidateFrameRequest, AcceptsDefaultsAndLimits) {
  FrameRequest request;
  request.dataset = "x";
  EXPECT_TRUE(Validate(request).ok());
  EXPECT_TRUE(Validate(SomeRequest()).ok());
  request.dataset = std::string(kMaxNameBytes, 'x');
  request.termination = 0.5;
  request.policy.groups = kMaxGroups;
  request.transfer.opacity_distance = kMaxOpacityDistance;
  EXPECT_TRUE(Validate(request).ok());
}

TEST(ValidateFrameRequest, NamesFieldValueAndLimit) {
  struct Wrong {
    std::function<void(FrameRequest&)> change;
    std::string message;  // how it begins
  };
  const std::string long_name(kMaxNameBytes + 1, 'x');
  const Wrong cases[] = {
      {[](auto& r) { r.dataset = ""; }, "dataset has 0 bytes, but must have 1 to 256"},
      {[&](auto& r) { r.dataset = long_name; }, "dataset has 257 bytes"},
      {[](auto& r) { r.renderer = "teapot"; }, "renderer is 'teapot', but must be one of: auto, splat, raycast"},
      {[](auto& r) { r.parameters.emplace("fineness", "1"); }, "fineness is '1', but no renderer has such a parameter"},
      {[](auto& r) { r.parameters.emplace("sampling-rate", "17"); }, "sampling-rate is '17', but must be a number in [0.1, 16]"},
      {[](auto& r) { r.size.width = 0; }, "size.width is 0"},
      {[](auto& r) { r.view.zoom = kNan; }, "view.zoom is nan"},
      {[](auto& r) { r.transfer.choice = ""; }, "transfer.preset has 0 bytes"},
      {[](auto& r) { r.transfer.choice = TransferFunction{}; }, "transfer function: number of colour points is 0"},
      {[](auto& r) { r.transfer.opacity_distance = 0; }, "transfer.opacity_distance is 0, but must lie in (0, 1000000] voxel lengths"},
      {[](auto& r) { r.transfer.opacity_distance = kNan; }, "transfer.opacity_distance is nan"},
      {[](auto& r) { r.shading.ambient = 7; }, "shading.ambient is 7"},
      {[](auto& r) {
         r.renderer = "shear";
         r.view.projection = Projection::kPerspective;
       },
       "renderer is 'shear', but projection 'perspective' needs one of: splat, raycast, zbuffer, mip"},
      {[](auto& r) {
         ShownLabels(r) = {};
         r.parameters.emplace("footprint", "2");
       },
       "no renderer does all that is asked: labels needs one of: raycast, zbuffer; footprint needs one of: splat"},
      {[&](auto& r) {
         r.renderer = "raycast";
         ShownLabels(r) = {.shown = {{2, 5}, {.name = long_name}}};
       },
       "fields[0].labels.shown[1].name has 257 bytes, but must have 0 to 256"},
      {[](auto& r) {
         r.channels = {"a", ""};
       },
       "channels[1] has 0 bytes, but must have 1 to 256"},
      {[](auto& r) { r.channels.assign(17, "0"); }, "channels has 17 items, at most 16 are possible"},
      {[](auto& r) { r.fields = {{.field = "0", .gamma = 0}}; }, "fields[0].gamma is 0, but must lie in [0.01, 100]"},
      {[](auto& r) {
         r.fields = {{.field = "a"}, {.field = "a"}};
       },
       "fields names field 'a' twice"},
      {[](auto& r) { r.fields = {{.field = "a", .choice = "viridis", .gamma = 2}}; },
       "fields['a'] has both a transfer function and a gamma"},
      {[&](auto& r) { r.time = long_name; }, "time has 257 bytes"},
      {[](auto& r) { r.termination = 0.6; }, "termination is 0.6, but must lie in [0, 0.5]"},
      {[](auto& r) { r.termination = kNan; }, "termination is nan"},
      {[](auto& r) { r.policy.decomposition = ""; }, "policy.decomposition has 0 bytes"},
      {[](auto& r) { r.policy.balance_by = ""; }, "policy.balance_by has 0 bytes"},
      {[](auto& r) { r.policy.assignment = ""; }, "policy.assignment has 0 bytes"},
      {[&](auto& r) { r.policy.balance = long_name; }, "policy.balance has 257 bytes"},
      {[](auto& r) { r.policy.axis = AxisChoice{5}; }, "policy.axis is 6, but must be one of: x, y, z, auto, view"},
      {[](auto& r) { r.policy.groups = -1; }, "policy.groups is -1, but must lie in [0, 1024]"},
      {[&](auto& r) { r.policy.combine = long_name; }, "policy.combine has 257 bytes"},
  };
  for (const Wrong& c : cases) {
    FrameRequest request = SomeRequest();
    c.change(request);
    const Status status = Validate(request);
    EXPECT_EQ(status.code(), StatusCode::kInvalidArgument);
    EXPECT_EQ(status.message().substr(0, c.message.size()), c.message);
  }
}

}  // namespace
}  // namespace slabstream
