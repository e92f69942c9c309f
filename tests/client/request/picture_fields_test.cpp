// A picture asked for by named texts is the one that the command line asks for with the same options.
#include "client/request/picture_fields.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "client/cli/option_groups.h"

namespace slabstream {
namespace {

using testing::HasSubstr;

FrameOptions Typed(const PictureFields& fields) {
  FrameOptions options;
  const Program app;
  AddFrameOptions(app, options);
  std::vector<std::string> arguments = {"head"};
  for (const auto& [name, text] : fields) arguments.push_back(text.empty() ? "--" + name : fmt::format("--{}={}", name, text));
  EXPECT_EQ(app.Parse(std::move(arguments)).message, "");
  options.request.dataset = "head";
  return options;
}

PictureFields WithDataset(PictureFields fields) {
  fields.push_back({"dataset", "head"});
  return fields;
}

const std::vector<PictureFields> kFields = {
    {},
    {{"size", "300x200"}, {"azimuth", "-30.1"}, {"elevation", "20"}, {"zoom", "1e-3"}},
    {{"view", "anterior"}, {"fit", ""}},
    {{"azimuth", "0"}, {"no-fit", ""}},
    {{"eye", "-1,2,3"}, {"up", "0,1,0"}, {"projection", "perspective"}},
    {{"renderer", "raycast"}, {"isovalue", "300:red:0.5,10"}, {"gradient-opacity", "0:0,5:1"}},
    {{"renderer", "raycast"}, {"isovalue", "300"}, {"transfer", "auto"}, {"sampling-rate", "2"}},
    {{"clip-box", "0:1,:,-3:v"}, {"clip-plane", "1,0,0,5"}, {"clip-plane", "0,-1,0,5"}, {"clip-mode", "cut-away"}},
    {{"light", "-1,0,0"}, {"light", "0,1,0"}, {"shading", "none"}, {"termination", "0"}},
    {{"background", "#102030"}, {"depth", "16"}, {"title", "A & B = \"C\" --size=1"}, {"scale-bar", ""}, {"axes", "box"}},
    {{"color-bar", "K"}, {"legend", "true"}, {"orientation-marker", ""}},
    {{"color-bar", ""}, {"legend", ""}},
    {{"dpi", "300"}, {"font-size", "9.5"}, {"quality", "40"}, {"title", "x"}},
    {{"renderer", "raycast"}, {"label-mode", "surface"}, {"labels-shown", "1,5-9"}, {"overlay-transfer", "gray-ramp"}},
    {{"decomposition", "kd-tree"}, {"groups", "auto"}, {"combine", "radix-k:2x2"}, {"pixel-error", "1e-4"}},
};

TEST(PictureFieldsTest, AskForWhatTheCommandLineAsksFor) {
  for (const PictureFields& fields : kFields) {
    const FrameOptions typed = Typed(fields);
    const Result<RenderRequest> render = ParseRenderFields(WithDataset(fields));
    ASSERT_TRUE(render.ok()) << render.status().message();
    EXPECT_EQ(render->frame, typed.request);
    EXPECT_EQ(render->format.background, typed.format.background);
    EXPECT_EQ(render->format.png_bits, typed.format.png_bits);
    EXPECT_EQ(render->format.quality, typed.format.quality);
    EXPECT_EQ(render->format.dots_per_inch, typed.format.dots_per_inch);
    EXPECT_EQ(render->format.annotations, typed.format.annotations);
  }
}

TEST(PictureFieldsTest, EveryFieldIsAnOptionOfTheCommandLine) {
  const Program render, slice;
  FrameOptions render_options;
  SliceOptions slice_options;
  AddFrameOptions(render, render_options);
  AddSliceOptions(slice, slice_options);
  for (const auto& [fields, app] : {std::pair(RenderFields(), &render), std::pair(SliceFields(), &slice)}) {
    EXPECT_GT(fields.size(), 10U);
    for (const Json& field : fields) {
      const std::string name = field["name"].text();
      if (name == "dataset") continue;
      EXPECT_TRUE(app->FindOption("--" + name)) << name;
    }
  }
}

TEST(PictureFieldsTest, NoFieldNamesAFile) {
  const std::vector<PictureFields> refused = {{{"camera", "a.json"}},
                                              {{"labels", "a.nii"}},
                                              {{"overlay", "a.nii"}},
                                              {{"stats", "a.json"}},
                                              {{"transfer", "/etc/passwd"}},
                                              {{"transfer", "a.json"}},
                                              {{"overlay-transfer", "a.json"}},
                                              {{"local", "1"}},
                                              {{"help", ""}},
                                              {{"", "x"}},
                                              {{"-zoom", "2"}},
                                              {{"zoom=2", ""}},
                                              {{"zoom", ""}},
                                              {{"fit", "maybe"}},
                                              {{"legend", "maybe"}},
                                              {{"color-bar", "a\nb"}},
                                              {{"zoom", "x"}},
                                              {{"view", "top"}, {"azimuth", "3"}},
                                              {{"up", "0,0,1"}},
                                              {{"zoom", "1"}, {"zoom", "2"}}};
  for (const PictureFields& fields : refused) {
    const Result<RenderRequest> render = ParseRenderFields(WithDataset(fields));
    ASSERT_FALSE(render.ok()) << fields[0].name;
    EXPECT_EQ(render.status().code(), StatusCode::kInvalidArgument);
    EXPECT_THAT(render.status().message(), testing::Not(HasSubstr("\n")));
  }
  EXPECT_THAT(ParseRenderFields({}).status().message(), HasSubstr("dataset is missing"));
  EXPECT_THAT(ParseRenderFields(WithDataset({{"zoom", "x"}})).status().message(), HasSubstr("--zoom 'x' is not a number"));
}

TEST(PictureFieldsTest, AColorMapComesAsItsText) {
  const std::string map = R"([{"Name": "m", "RGBPoints": [0, 0, 0, 0, 100, 1, 1, 1]}])";
  const Result<RenderRequest> render = ParseRenderFields(WithDataset({{"transfer", map}}));
  ASSERT_TRUE(render.ok()) << render.status().message();
  EXPECT_TRUE(std::holds_alternative<TransferFunction>(render->frame.transfer.choice));
  const Result<PictureFields> fields = FieldsOfJson(Json::Parse(R"({"dataset": "head", "transfer": )" + map + "}").value());
  ASSERT_TRUE(fields.ok());
  const Result<RenderRequest> again = ParseRenderFields(*fields);
  ASSERT_TRUE(again.ok()) << again.status().message();
  EXPECT_EQ(again->frame, render->frame);
}

TEST(PictureFieldsTest, JsonHasNumbersBooleansAndLists) {
  const auto fields = FieldsOfJson(
      Json::Parse(
          R"({"dataset": "head", "azimuth": 30, "zoom": 0.1, "fit": true, "scale-bar": false, "light": ["1,0,0", "0,1,0"], "title": null})")
          .value());
  ASSERT_TRUE(fields.ok());
  const Result<RenderRequest> render = ParseRenderFields(*fields);
  ASSERT_TRUE(render.ok()) << render.status().message();
  EXPECT_EQ(render->frame.view.azimuth_degrees, 30);
  EXPECT_EQ(render->frame.view.zoom, 0.1);
  EXPECT_EQ(render->frame.view.fit, true);
  EXPECT_FALSE(render->format.annotations.scale_bar);
  EXPECT_EQ(render->frame.shading.lights.size(), 2U);
  for (const char* wrong : {"3", "[]", R"({"zoom": [[1]]})", R"({"light": [null]})"})
    EXPECT_FALSE(FieldsOfJson(Json::Parse(wrong).value()).ok()) << wrong;
}

TEST(PictureFieldsTest, AFieldOfJsonIsGivenOnce) {
  for (const char* text : {R"({"size": 30, "azimuth": 1, "size": 40})", R"({"transfer": {"RGBPoints": [], "RGBPoints": []}})"}) {
    EXPECT_THAT(ParseJson(text).status().message(), HasSubstr("' is given twice")) << text;
  }
  EXPECT_TRUE(ParseJson(R"({"a": {"x": 1}, "b": {"x": 1}, "c": [{"x": 1}, {"x": 2}]})").ok());
}

TEST(PictureFieldsTest, SlicesHaveAFrameForEachPlane) {
  const auto slice = ParseSliceFields({{"dataset", "head"}, {"plane", "anatomical"}, {"size", "64x32"}, {"window", "80"}});
  ASSERT_TRUE(slice.ok()) << slice.status().message();
  EXPECT_EQ(slice->size(), (ImageSize{192, 32}));
  const auto frames = FramesOf(*slice);
  ASSERT_TRUE(frames.ok());
  ASSERT_EQ(frames->size(), 3U);
  for (const FrameRequest& frame : *frames) EXPECT_EQ(frame.dataset, "head");
  EXPECT_FALSE(ParseSliceFields({{"dataset", "head"}, {"plane", "zyx"}, {"index", "3"}}).ok());
}

TEST(PictureFieldsTest, AFlagThatIsOnByItselfCanBeTurnedOff) {
  const auto fit = [](const PictureFields& fields) { return ParseRenderFields(WithDataset(fields)).value().frame.view.fit; };
  EXPECT_EQ(fit({}), std::nullopt) << "the service decides";
  EXPECT_EQ(fit({{"fit", "true"}}), true);
  EXPECT_EQ(fit({{"fit", "false"}}), false);
  EXPECT_EQ(fit({{"no-fit", "true"}}), false);
  EXPECT_EQ(fit({{"no-fit", "false"}}), std::nullopt);
}

}  // namespace
}  // namespace slabstream
