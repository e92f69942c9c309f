// "auto" means a renderer that can do what is asked, whenever there is one.
#include "common/renderers/renderer_choice.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "common/planning/resolved_request.h"
#include "common/renderers/registry.h"
#include "common/wire/validate_request.h"
#include "tests/common/planning/support.h"

namespace slabstream {
namespace {

using testing::HasSubstr;

struct Wish {
  std::string what;
  std::function<void(FrameRequest&)> ask;
};

// Every ability that a request can ask for, and every parameter of every renderer.
std::vector<Wish> Wishes() {
  std::vector<Wish> wishes = {
      {"nothing", [](auto&) {}},
      {"projection", [](auto& r) { r.view.projection = Projection::kPerspective; }},
      {"isovalue", [](auto& r) { r.transfer.isosurfaces = {{.value = 50}}; }},
      {"gradient-opacity",
       [](auto& r) {
         r.transfer.gradient_opacities = {{1, 0.5}};
       }},
      {"two-dimensional preset", [](auto& r) { r.transfer.choice = "ct-bone-2d"; }},
      {"regions",
       [](auto& r) {
         const TransferRegion box = {{{10, 0}, {90, 0}, {90, 20}, {10, 20}}, {1, 0, 0}, 0.5, 0.1};
         r.transfer.choice = WithCurvesOfRegions({.colors = {}, .opacities = {}, .regions = {box}});
       }},
      {"brightness", [](auto& r) { r.brightness = 2; }},
      {"shading", [](auto& r) { r.shading.model = ShadingModel::kDepthGradient; }},
      {"shadows", [](auto& r) { r.shading.shadows = 0.5; }},
      {"ambient-occlusion", [](auto& r) { r.shading.ambient_occlusion = 0.5; }},
      {"labels", [](auto& r) { ShownLabels(r) = {}; }},
      {"smooth labels", [](auto& r) { ShownLabels(r) = {.mode = LabelMode::kSurface, .surface = LabelSurface::kSmooth}; }},
  };
  for (const RendererKind* kind : Renderers()) {
    for (const RendererParameter& parameter : kind->parameters()) {
      wishes.push_back({std::string(parameter.name),
                        [&parameter](auto& r) { r.parameters[std::string(parameter.name)] = TextOf(parameter, parameter.greatest()); }});
    }
  }
  return wishes;
}

TEST(RenderersFor, AutoIsResolvedWheneverARendererCanDoIt) {
  const std::vector<Wish> wishes = Wishes();
  for (const bool grid : {false, true}) {
    const auto summary = std::make_shared<const VolumeSummary>(grid ? FullGridSummary({20, 20, 20}) : FullSummary({20, 20, 20}));
    for (const Wish& one : wishes) {
      for (const Wish& other : wishes) {
        SCOPED_TRACE(one.what + " and " + other.what + (grid ? " of a grid" : ""));
        FrameRequest request = SomeRequest();
        one.ask(request);
        other.ask(request);
        std::vector<std::string> able;
        for (const RendererKind* kind : Renderers()) {
          request.renderer = kind->name();
          if (Validate(request).ok() && ResolveRequest(request, 1, summary).ok()) able.push_back(request.renderer);
        }
        request.renderer = kAutomatic;
        const Status valid = Validate(request);
        EXPECT_EQ(valid.ok(), !able.empty()) << valid.message();
        const Result<ResolvedRequest> resolved = ResolveRequest(request, 1, summary);
        ASSERT_EQ(resolved.ok(), !able.empty()) << resolved.status().message();
        if (resolved.ok()) {
          EXPECT_THAT(able, testing::Contains(resolved->frame.renderer));
        } else {
          EXPECT_THAT(valid.message(), testing::StartsWith("no renderer does all that is asked: "));
          EXPECT_THAT(valid.message(), HasSubstr(" needs one of: "));
        }
      }
    }
  }
}

TEST(RenderersFor, TheOneThatIsPreferredComesFirst) {
  const auto chosen = [](const std::function<void(FrameRequest&)>& ask, bool grid = false) {
    FrameRequest request = SomeRequest();
    ask(request);
    return std::string(PreferredRenderer(RenderersFor(request).value(), grid).name());
  };
  EXPECT_EQ(chosen([](auto&) {}), DefaultRenderer(false).name());
  EXPECT_EQ(chosen([](auto&) {}, true), DefaultRenderer(true).name());
  EXPECT_EQ(chosen([](auto& r) { ShownLabels(r) = {}; }), "raycast");
  EXPECT_EQ(chosen([](auto& r) { r.transfer.isosurfaces = {{.value = 1}}; }), "raycast");
  EXPECT_EQ(chosen([](auto& r) { r.transfer.isosurfaces = {{.value = 1}}; }, true), "raycast") << "on the grid's lattice";
  EXPECT_EQ(chosen([](auto& r) { r.shading.model = ShadingModel::kDepthGradient; }), "zbuffer");
  EXPECT_EQ(chosen([](auto& r) { r.parameters["energy"] = "60"; }), "xray");
  EXPECT_EQ(chosen([](auto& r) { r.parameters["projection-mode"] = "mean"; }), "mip");
}

// What could be left out of the list is: the error names what stands against each other, not everything that was asked for.
TEST(RenderersFor, SaysWhatCannotBeHadTogether) {
  FrameRequest request = SomeRequest();
  request.view.projection = Projection::kPerspective;
  ShownLabels(request) = {};
  request.parameters["energy"] = "60";
  EXPECT_EQ(RenderersFor(request).status().message(),
            "no renderer does all that is asked: labels needs one of: raycast, zbuffer; energy needs one of: xray");
  request.renderer = "splat";
  request.parameters.clear();
  EXPECT_EQ(RenderersFor(request).status().message(), "renderer is 'splat', but labels needs one of: raycast, zbuffer");
  request.renderer = "teapot";
  EXPECT_THAT(RenderersFor(request).status().message(), testing::StartsWith("renderer is 'teapot', but must be one of: auto, "));
}

}  // namespace
}  // namespace slabstream
