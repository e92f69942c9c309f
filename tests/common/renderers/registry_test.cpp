// Every renderer of the registry keeps what the planner, the wire and the command line rely on.
#include "common/renderers/registry.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <string>

#include "tests/common/planning/support.h"

namespace slabstream {
namespace {

TEST(Renderers, HaveNamesOfTheirOwn) {
  ASSERT_FALSE(Renderers().empty());
  std::set<std::string_view> names;
  for (const RendererKind* kind : Renderers()) {
    EXPECT_TRUE(names.insert(kind->name()).second) << kind->name();
    EXPECT_EQ(FindRenderer(kind->name()), kind);
    EXPECT_EQ(*RequireRenderer(kind->name()), kind);
    EXPECT_FALSE(kind->purpose().empty());
    EXPECT_FALSE(kind->stages().empty());
    EXPECT_GE(kind->reach(), 0);
    EXPECT_LE(kind->reach(), kHalo);
    EXPECT_GT(kind->footprint(), 0);
    EXPECT_NE(kind->format(), PixelFormat::kRgbaDepth) << "finished pictures do not combine";
  }
}

TEST(Renderers, OneDrawsVolumesAndOneDrawsGridsUnlessARequestNamesOne) {
  EXPECT_EQ(&DefaultRenderer(false), Renderers().front());
  EXPECT_FALSE(DefaultRenderer(false).Can(Ability::kCells));
  EXPECT_TRUE(DefaultRenderer(true).Can(Ability::kCells));
  EXPECT_EQ(FindRenderer(kAutomatic), nullptr) << "no renderer has this name";
}

TEST(Renderers, NameEachAbilityOnce) {
  std::set<std::string_view> all;
  for (const RendererKind* kind : Renderers()) {
    const std::vector<std::string_view> names = kind->AbilityNames();
    EXPECT_TRUE(std::ranges::is_sorted(kind->abilities())) << kind->name();
    EXPECT_EQ(std::set(names.begin(), names.end()).size(), names.size()) << kind->name();
    EXPECT_EQ(kind->projections().size(), kind->Can(Ability::kPerspective) ? 2U : 1U) << kind->name();
    EXPECT_TRUE(!kind->Can(Ability::kDepthShading) || kind->format() == PixelFormat::kDepth) << kind->name();
    all.insert(names.begin(), names.end());
  }
  EXPECT_EQ(all, std::set(kAbilityNames.begin(), kAbilityNames.end()));
}

TEST(Renderers, AnUnknownNameIsAnErrorThatListsAll) {
  const auto unknown = RequireRenderer("teapot");
  ASSERT_FALSE(unknown.ok());
  EXPECT_EQ(unknown.status().code(), StatusCode::kInvalidArgument);
  for (const std::string_view name : RendererNames()) {
    EXPECT_NE(unknown.status().message().find(name), std::string::npos) << unknown.status().message();
  }
}

TEST(Renderers, ParametersHaveDefaultsWithinTheirLimits) {
  for (const RendererKind* kind : Renderers()) {
    const auto values = ParseParameters(*kind, {});
    ASSERT_TRUE(values.ok()) << values.status().message();
    ASSERT_EQ(values->size(), kind->parameters().size());
    for (std::size_t i = 0; i < values->size(); ++i) {
      const RendererParameter& parameter = kind->parameters()[i];
      const double most = parameter.choices.empty() ? parameter.most : double(parameter.choices.size() - 1);
      EXPECT_EQ((*values)[i], parameter.standard);
      EXPECT_GE(parameter.standard, parameter.least) << parameter.name;
      EXPECT_LE(parameter.standard, most) << parameter.name;
    }
  }
}

TEST(Renderers, RefuseParametersWithTheirNameValueAndLimits) {
  for (const RendererKind* kind : Renderers()) {
    EXPECT_EQ(ParseParameters(*kind, {{"fineness", "1"}}).status().message(),
              "fineness is '1', but the renderer '" + std::string(kind->name()) + "' has no such parameter");
    for (const RendererParameter& parameter : kind->parameters()) {
      const std::string name(parameter.name);
      for (const char* text : {"", "teapot", "nan", "-1e9", "1e9"}) {
        const auto values = ParseParameters(*kind, {{name, text}});
        ASSERT_FALSE(values.ok()) << name << " " << text;
        EXPECT_EQ(values.status().message().find(name + " is '" + text + "', but must be "), 0U) << values.status().message();
      }
      for (std::size_t i = 0; i < parameter.choices.size(); ++i) {
        const auto values = ParseParameters(*kind, {{name, std::string(parameter.choices[i])}});
        ASSERT_TRUE(values.ok());
        EXPECT_EQ((*values)[std::size_t(&parameter - kind->parameters().data())], double(i));
      }
    }
  }
}

// A frame of any renderer, whatever the view, has pixels, and no box reaches beyond it.
TEST(Renderers, MakeFrames) {
  for (const RendererKind* kind : Renderers()) {
    for (const Projection projection : kind->projections()) {
      FrameRequest request = SomeRequest();
      request.renderer = kind->name();
      request.view.projection = projection;
      request.view.azimuth_degrees = 33;
      const VolumeSummary summary = FullGridSummary({40, 41, 42});
      const FrameSetup setup = SetupOf(request, summary);
      EXPECT_EQ(setup.renderer, kind);
      EXPECT_EQ(setup.format, kind->format());
      EXPECT_EQ(setup.halo, kind->reach());
      EXPECT_EQ(setup.sheets.empty(), !kind->along_slices());
      const PixelBounds frame = FrameBounds(setup);
      EXPECT_GT(frame.pixel_count(), 0);
      EXPECT_TRUE(frame.Contains(ReachOf(summary.description.geometry.bounds(), setup)));
      EXPECT_EQ(FrameBytes(setup), frame.pixel_count() * std::int64_t(BytesPerPixel(kind->format())));
    }
  }
}

}  // namespace
}  // namespace slabstream
