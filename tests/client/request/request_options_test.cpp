// The schema describes each field of a request once: whoever offers, reads or writes requests follows that description.
#include "client/request/request_options.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <google/protobuf/descriptor.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <map>
#include <set>

#include "client/cli/option_groups.h"
#include "client/request/picture_fields.h"
#include "client/request/picture_record.h"
#include "common/renderers/registry.h"
#include "common/renderers/renderer_choice.h"
#include "common/view/default_view.h"
#include "common/wire/checker.h"
#include "common/wire/codecs.h"
#include "common/wire/request_json.h"
#include "common/wire/validate_request.h"
#include "slabstream/v1/frame.pb.h"

namespace slabstream {
namespace {

using google::protobuf::Descriptor;
using google::protobuf::FieldDescriptor;
using google::protobuf::Message;
using testing::HasSubstr;

FrameRequest Standard() {
  FrameRequest request;
  request.dataset = "head";
  request.view = kUnstatedView;
  return request;
}

// A value of each option that is not its standard one, with the options that it needs. Numbers of a material count even if they are those
// of the standard material: they replace those of the transfer function's.
const std::map<std::string, std::pair<std::string, PictureFields>> kOthers = {
    {"size", {"30x20", {}}},
    {"projection", {"perspective", {}}},
    {"azimuth", {"-30.5", {}}},
    {"elevation", {"12", {}}},
    {"of-patient", {"true", {}}},
    {"look-at", {"1,-2,3", {}}},
    {"fit", {"true", {}}},
    {"eye", {"-100,5,7", {}}},
    {"up", {"0,1,0", {{"eye", "1,2,3"}}}},
    {"distance", {"90", {{"projection", "perspective"}}}},
    {"roll", {"5", {}}},
    {"zoom", {"2.5", {}}},
    {"fov", {"12", {}}},
    {"clip-box", {"0:1,:,-3:v", {}}},
    {"clip-plane", {"1,0,0,-5", {}}},
    {"clip-mode", {"cut-away", {}}},
    {"renderer", {"zbuffer", {}}},
    {"transfer", {"gray-ramp", {}}},
    {"scalar-range", {"2%:98%", {}}},
    {"opacity-distance", {"0.25", {}}},
    {"isovalue", {"300:1,0.5,0:0.25", {{"transfer", "auto"}}}},
    {"gradient-opacity", {"0:0.5,3:1", {}}},
    {"shading", {"none", {}}},
    {"light", {"0,0,1", {}}},
    {"ambient", {"0.2", {}}},
    {"diffuse", {"0.25", {}}},
    {"specular", {"0.75", {}}},
    {"shininess", {"3", {}}},
    {"shadows", {"0.75", {}}},
    {"ambient-occlusion", {"0.5", {}}},
    {"occlusion-radius", {"0.25", {}}},
    {"termination", {"0.25", {}}},
    {"shape", {"vessel\\,1,color=1,0.5,0,opacity=0.25,width=3px,map=plasma,range=1:5", {}}},
    {"plane", {"coronal:y=2,opacity=0.5,map=plasma,range=1:5", {}}},
    {"detail", {"2.5", {}}},
    {"level", {"3", {}}},
    {"brightness", {"1.5", {}}},
    {"label-mode", {"surface", {}}},
    {"label-tint", {"0.25", {}}},
    {"label-opacity", {"3=0.5", {}}},
    {"labels-shown", {"1,5-9", {}}},
    {"label-surface", {"smooth", {}}},
    {"channel", {"0,Actin", {}}},
    {"channel-transfer", {"0=viridis", {}}},
    {"channel-color", {"0=0,1,0,Actin=1,0,1", {}}},
    {"channel-range", {"0=100:4000,Actin=2%:99%", {}}},
    {"channel-gamma", {"0=0.7", {}}},
    {"channel-opacity", {"0=0.5", {}}},
    {"blend", {"over", {}}},
    {"missing", {"skip", {}}},
    {"time", {"last", {}}},
    {"decomposition", {"octree", {}}},
    {"axis", {"view", {}}},
    {"balance-by", {"voxels", {}}},
    {"assignment", {"greedy", {}}},
    {"balance", {"dynamic", {}}},
    {"groups", {"3", {}}},
    {"teams", {"2", {}}},
    {"combine", {"radix-k:2x2", {}}},
    {"pixel-error", {"0.01", {}}},
};

bool IsParameter(const RequestOption& option) { return option.path.starts_with("parameters."); }
bool IsOfLabels(const RequestOption& option) { return option.path.starts_with("fields.labels."); }
bool IsCompared(const RequestOption& option) { return option.name != "dataset" && option.name != "previews" && !IsParameter(option); }

FrameRequest Asked(const RequestOption& option, bool with_option = true) {
  auto [text, fields] = kOthers.at(option.name);
  if (with_option) fields.push_back({option.name, text});
  fields.push_back({"dataset", "head"});
  const Result<RenderRequest> request = ParseRenderFields(fields);
  EXPECT_TRUE(request.ok()) << request.status().message();
  return request.ok() ? request->frame : FrameRequest();
}

// Leaves without a name lie in a field that has one, or say what sets them.
void ExpectDescribed(const Descriptor& message, const std::string& place, bool inside, std::set<std::string>& names) {
  for (int i = 0; i < message.field_count(); ++i) {
    const FieldDescriptor& field = *message.field(i);
    const v1::About& about = field.options().GetExtension(v1::about);
    const std::string path = place + field.name();
    if (!about.name().empty()) {
      EXPECT_FALSE(about.help().empty()) << path;
      EXPECT_TRUE(names.insert(about.name()).second) << about.name() << " is the name of two fields";
    }
    const bool settled = inside || !about.name().empty() || !about.apart().empty();
    if (field.message_type() != nullptr && !settled) {
      ExpectDescribed(*field.message_type(), path + ".", settled, names);
    } else {
      EXPECT_TRUE(settled) << path << " has neither a name nor a reason to have none";
    }
  }
}

TEST(RequestOptionsTest, EveryFieldOfTheSchemaIsAnOptionOrSaysWhyNot) {
  std::set<std::string> names, found;
  ExpectDescribed(*v1::FrameRequest::descriptor(), "", false, names);
  for (const RequestOption& option : RequestOptions()) {
    if (!IsParameter(option)) found.insert(option.name);
  }
  EXPECT_EQ(found, names);
  for (const std::string& name : names) {
    if (name == "dataset" || name == "previews") continue;
    EXPECT_TRUE(kOthers.contains(name)) << "no other value of " << name << " is tried here";
  }
}

TEST(RequestOptionsTest, EveryOptionIsOneOfTheCommandLineAndAQuery) {
  const Program app;
  FrameOptions options;
  AddFrameOptions(app, options);
  const Json queries = RenderFields();
  for (const RequestOption& option : RequestOptions()) {
    SCOPED_TRACE(option.name);
    const auto query = std::ranges::find_if(queries, [&](const Json& field) { return field["name"] == option.name; });
    if (option.name == "previews") continue;  // of render alone
    ASSERT_NE(query, queries.end());
    EXPECT_EQ((*query)["path"], option.path);
    if (option.name == "dataset") continue;  // SOURCE on the command line
    const Option typed = app.FindOption("--" + option.name);
    ASSERT_TRUE(typed);
    EXPECT_EQ(typed.description(), option.help);
    EXPECT_EQ(typed.group(), option.group);
  }
}

TEST(RequestOptionsTest, EveryOptionReachesRequestRecordAndKey) {
  for (const RequestOption& option : RequestOptions()) {
    if (!IsCompared(option)) continue;
    SCOPED_TRACE(option.name);
    const FrameRequest with = Asked(option), without = Asked(option, false);
    EXPECT_NE(with, without);
    EXPECT_NE(RequestToJson(with), RequestToJson(without));
    // The record of the picture tells the line that asks for it.
    const Result<PictureRecord> record = ParseRecord(RecordText("head", with, {}, {.pixel_size = 1}));
    ASSERT_TRUE(record.ok()) << record.status().message();
    const std::vector<std::string> words = RenderArguments(*record, "a.png");
    EXPECT_THAT(words, testing::Contains(HasSubstr("--" + option.name)));
    // Texts are read back the same.
    FrameRequest again = without;
    const std::vector<std::string> texts = TextsOf(option, with);
    ASSERT_FALSE(texts.empty());
    EXPECT_TRUE(SetOption(option, option.name, texts, ColorMaps::kTexts, again).ok());
    EXPECT_EQ(again, with);
  }
}

// A renderer makes the picture of an option if it has the ability that the schema names, or the parameter; the service chooses by the same.
TEST(RequestOptionsTest, AbilitiesOfTheSchemaDecideWhichRenderersCanDoIt) {
  const std::map<std::string, std::string> by_value = {{"projection", "perspective"},
                                                       {"label-surface", "smooth-labels"}};  // the value that kOthers has needs it
  for (const RequestOption& option : RequestOptions()) {
    if (!IsCompared(option) || option.path == "renderer") continue;
    const std::string ability = by_value.contains(option.name) ? by_value.at(option.name) : IsOfLabels(option) ? "labels" : option.ability;
    FrameRequest request = Standard();
    ASSERT_TRUE(SetOption(option, option.name, std::vector{kOthers.at(option.name).first}, ColorMaps::kTexts, request).ok());
    for (const RendererKind* kind : Renderers()) {
      request.renderer = kind->name();
      const bool able = ability.empty() || std::ranges::count(kind->AbilityNames(), ability) != 0;
      EXPECT_EQ(RenderersFor(request).ok(), able) << option.name << " by " << kind->name();
    }
  }
}

TEST(RequestOptionsTest, LimitsHoldForTextsAndForRequests) {
  for (const RequestOption& option : RequestOptions()) {
    if (!IsCompared(option) || !option.range) continue;
    SCOPED_TRACE(option.name);
    const auto refused = [&](double value) {
      FrameRequest request = Asked(option, false);
      const Status status = SetOption(option, "--" + option.name, std::vector{fmt::format("{}", value)}, ColorMaps::kTexts, request);
      return !status.ok() && status.message().starts_with("--" + option.name);
    };
    const auto& [least, most, above] = *option.range;
    EXPECT_EQ(refused(least), above);
    EXPECT_FALSE(refused(most));
    // The next number may be the same one, far from 0.
    EXPECT_TRUE(refused(std::nextafter(least - 1, -HUGE_VAL)));
    EXPECT_TRUE(refused(std::nextafter(most + 1, HUGE_VAL)));
  }
}

TEST(RequestOptionsTest, NumbersWithAutoMayBeLeftToTheService) {
  const auto set = [](const char* name, const std::string& text, FrameRequest& request) {
    return SetOption(*FindRequestOption(name), name, std::vector{text}, ColorMaps::kTexts, request);
  };
  FrameRequest request;
  EXPECT_TRUE(set("detail", "auto", request).ok());
  EXPECT_EQ(request.detail, 0);
  EXPECT_TRUE(set("detail", "2.5", request).ok());
  EXPECT_EQ(request.detail, 2.5);
  request.policy.groups = 3;
  EXPECT_TRUE(set("groups", "auto", request).ok());
  EXPECT_EQ(request.policy.groups, 0);
  EXPECT_FALSE(set("zoom", "auto", request).ok());
  EXPECT_FALSE(set("teams", "auto", request).ok());
}

// The message of the field at `path`, and the field.
std::pair<Message*, const FieldDescriptor*> FieldAt(Message& whole, const std::string& path) {
  Message* message = &whole;
  std::size_t begin = 0;
  for (std::size_t dot = path.find('.'); dot != std::string::npos; begin = dot + 1, dot = path.find('.', begin)) {
    message = message->GetReflection()->MutableMessage(message, message->GetDescriptor()->FindFieldByName(path.substr(begin, dot - begin)));
  }
  return {message, message->GetDescriptor()->FindFieldByName(path.substr(begin))};
}

FrameRequest Received(const v1::FrameRequest& message) {
  FrameRequest request;
  Checker check("FrameRequest");
  Read(message, request, check);
  EXPECT_TRUE(check.ok()) << check.status().message();
  return request;
}

TEST(RequestOptionsTest, WhatIsLeftOutHasItsStandardValue) {
  v1::FrameRequest bare;
  bare.set_dataset("head");
  EXPECT_EQ(Received(bare), Standard());
  v1::FieldChoice& labels = *bare.add_fields();
  labels.set_field("labels");
  labels.mutable_labels();
  bare.set_renderer("raycast");
  FrameRequest shown = Received(bare);
  EXPECT_EQ(ShownLabels(shown), LabelChoice());
  for (const RequestOption& option : RequestOptions()) {
    if (!IsCompared(option)) continue;
    SCOPED_TRACE(option.name);
    const bool of_fields = option.path.starts_with("fields.");
    if (of_fields && !IsOfLabels(option)) continue;  // of each channel
    v1::FrameRequest message;
    Write(Asked(option), message);
    const auto [holder, field] =
        of_fields ? FieldAt(*message.mutable_fields(0), option.path.substr(option.path.find('.') + 1)) : FieldAt(message, option.path);
    ASSERT_NE(field, nullptr);
    holder->GetReflection()->ClearField(holder, field);
    FrameRequest expected = Asked(option, false);
    if (IsOfLabels(option)) (void)ShownLabels(expected);
    EXPECT_EQ(Received(message), expected);
  }
}

TEST(RequestOptionsTest, StandardTextsOfTheSchemaAreThoseOfTheStruct) {
  for (const RequestOption& option : RequestOptions()) {
    if (!IsCompared(option) || option.standard.empty()) continue;
    SCOPED_TRACE(option.name);
    FrameRequest request = Asked(option, false), unchanged = request;
    if (IsOfLabels(option)) (void)ShownLabels(unchanged);
    EXPECT_TRUE(SetOption(option, option.name, std::vector{option.standard}, ColorMaps::kTexts, request).ok());
    EXPECT_EQ(request, unchanged);
  }
}

TEST(RequestOptionsTest, LooksOfChannelsAreMergedByName) {
  const Result<RenderRequest> asked =
      ParseRenderFields({{"dataset", "head"},
                         {"channel", "0,Actin"},
                         {"channel", "4"},
                         {"channel-color", "0=green,Actin=#f0f,2=1,0.5,0"},
                         {"channel-range", "Actin=2%:99%"},
                         {"channel-range", "0=100:4000"},
                         {"channel-gamma", "0=0.5"},
                         {"channel-opacity", "Actin=0.25"},
                         {"channel-transfer", R"(4={"RGBPoints": [0, 1, 1, 1, 9, 1, 0, 0], "Name": "a,b=]"},5=viridis)"}});
  ASSERT_TRUE(asked.ok()) << asked.status().message();
  EXPECT_THAT(asked->frame.channels, testing::ElementsAre("0", "Actin", "4"));
  std::map<std::string, FieldChoice> looks;
  for (const FieldChoice& look : asked->frame.fields) looks[look.field] = look;
  ASSERT_EQ(looks.size(), 5U);
  EXPECT_EQ(looks["0"],
            (FieldChoice{.field = "0", .color = Rgb{0, 128 / 255.0F, 0}, .scalar_range = ScalarRange{100, 4000}, .gamma = 0.5}));
  EXPECT_EQ(looks["Actin"],
            (FieldChoice{.field = "Actin", .color = Rgb{1, 0, 1}, .scalar_range = ScalarRange{2, 99, true}, .weight = 0.25}));
  EXPECT_EQ(looks["2"].color, (Rgb{1, 0.5F, 0}));
  EXPECT_EQ(std::get<TransferFunction>(looks["4"].choice).colors.size(), 2U);
  EXPECT_EQ(std::get<std::string>(looks["5"].choice), "viridis");
  EXPECT_THAT(TextsOf(*FindRequestOption("channel-transfer"), asked->frame), testing::ElementsAre("4=channel-map-1.json,5=viridis"));
}

TEST(RequestOptionsTest, TextsOfChannelsHoldWhatTheyShow) {
  FrameRequest request = Standard();
  request.channels = {"a,b", "c=d\\e"};
  request.fields = {{.field = "a,b", .shown = false}, {.field = "c=d\\e", .gamma = 2}, {.field = "CT"}};
  const auto texts = [&](const char* name) { return TextsOf(*FindRequestOption(name), request); };
  EXPECT_THAT(texts("channel"), testing::ElementsAre("a\\,b,c\\=d\\\\e"));
  EXPECT_THAT(texts("channel-opacity"), testing::ElementsAre("a\\,b=0,CT=1"))
      << "what is not shown has no opacity; to name a field may show it";
  EXPECT_THAT(texts("channel-gamma"), testing::ElementsAre("c\\=d\\\\e=2"));
  FrameRequest again = Standard();
  for (const char* name : {"channel", "channel-opacity", "channel-gamma"}) {
    EXPECT_TRUE(SetOption(*FindRequestOption(name), name, texts(name), ColorMaps::kTexts, again).ok());
  }
  EXPECT_EQ(again.channels, request.channels);
  EXPECT_EQ(again.fields.size(), 3U);
}

TEST(RequestOptionsTest, ShortFormsSayHowTheOverlayLooks) {
  const std::vector<std::array<std::string, 3>> forms = {
      {"overlay-transfer", "channel-transfer", "hot"},
      {"overlay-range", "channel-range", "2%:98%"},
      {"overlay-weight", "channel-opacity", "0.25"},
      {"overlay-transfer", "channel-transfer", R"({"RGBPoints": [0, 1, 1, 1, 9, 1, 0, 0]})"}};
  for (const auto& [name, whole, text] : forms) {
    SCOPED_TRACE(name);
    const PictureField of_dataset = {"dataset", "head"}, by_short = {name, text}, by_whole = {whole, "overlay=" + text};
    const Result<RenderRequest> one = ParseRenderFields({of_dataset, by_short}), other = ParseRenderFields({of_dataset, by_whole});
    ASSERT_TRUE(one.ok()) << one.status().message();
    ASSERT_TRUE(other.ok()) << other.status().message();
    EXPECT_EQ(one->frame, other->frame);
    EXPECT_EQ(one->frame.fields.size(), 1U);
    EXPECT_THAT(ParseRenderFields({of_dataset, by_short, by_whole}).status().message(), HasSubstr("names 'overlay' twice"));
    EXPECT_THAT(ParseSliceFields({of_dataset, {"plane", "z"}, by_short}).value().frame.fields, one->frame.fields);
  }
  EXPECT_THAT(ParseRenderFields({{"dataset", "head"}, {"overlay-weight", "7"}}).status().message(),
              HasSubstr("--overlay-weight overlay: 7 is out of range [0, 1]"));
}

TEST(RequestOptionsTest, EachOwnFunctionHasAFile) {
  const std::string map = R"({"RGBPoints": [0, 1, 1, 1, 9, 1, 0, 0]})";
  const Result<RenderRequest> asked =
      ParseRenderFields({{"dataset", "head"}, {"channel-transfer", "a=hot,b=" + map + ",c=" + map}, {"transfer", map}});
  ASSERT_TRUE(asked.ok()) << asked.status().message();
  const std::map<std::string, std::string> files = MapFilesOf(asked->frame);
  EXPECT_THAT(files, testing::UnorderedElementsAre(testing::Key("color-map.json"), testing::Key("channel-map-2.json"),
                                                   testing::Key("channel-map-3.json")));
  EXPECT_THAT(TextsOf(*FindRequestOption("channel-transfer"), asked->frame),
              testing::ElementsAre("a=hot,b=channel-map-2.json,c=channel-map-3.json"));
  const Result<TransferFunction> read = ParseParaViewColorMap(files.at("channel-map-3.json"), "map");
  ASSERT_TRUE(read.ok()) << read.status().message();
  EXPECT_EQ(std::get<TransferFunction>(asked->frame.fields[2].choice), *read);
}

TEST(RequestOptionsTest, WrongTextsOfChannelsAreRefusedInOneLine) {
  const std::string many = "0,1,2,3,4,5,6,7,8,9,10,11,12,13,14,15,16", long_name(300, 'x');
  const std::vector<std::array<std::string, 3>> cases = {
      {"channel", "0,,1", "--channel '0,,1' has an empty name"},
      {"channel", many, "--channel has 17 names, at most 16 are possible"},
      {"channel", long_name, "--channel has a name of 300 bytes, at most 256 are possible"},
      {"channel-color", "green", "--channel-color 'green' is not NAME=VALUE,..."},
      {"channel-color", "=green", "--channel-color '=green' has an empty name"},
      {"channel-color", "0=", "--channel-color '0=' has no value for '0'"},
      {"channel-color", "0=grean", "--channel-color 0: 'grean' is neither R,G,B[,A] nor #rrggbb nor the name of a colour"},
      {"channel-color", "0=#ff000080", "--channel-color 0: '#ff000080' has an opacity of 0.501961, but must be opaque"},
      {"channel-color", "0=red,0=blue", "--channel-color names '0' twice"},
      {"channel-range", "0=9:1", "--channel-range 0: '9:1' must rise"},
      {"channel-range", "0=1:101%", "--channel-range 0: '1:101%' is neither LOW:HIGH nor LOW%:HIGH%"},
      {"channel-gamma", "0=1,Actin=0.001", "--channel-gamma Actin: 0.001 is out of range [0.01, 100]"},
      {"channel-opacity", "0=2", "--channel-opacity 0: 2 is out of range [0, 1]"},
      {"channel-transfer", "0=nothing", "--channel-transfer 0: 'nothing' is not one of auto"},
      {"channel-transfer", "0={}x", "--channel-transfer '0={}x' has 'x' behind a value"},
      {"blend", "multiply", "--blend 'multiply' is not one of auto, add, over, max"},
  };
  for (const auto& [name, text, message] : cases) {
    const Status status = ParseRenderFields({{"dataset", "head"}, {name, text}}).status();
    EXPECT_THAT(status.message(), HasSubstr(message)) << text;
    EXPECT_EQ(status.message().find('\n'), std::string::npos);
  }
  const Status both = ParseRenderFields({{"dataset", "head"}, {"channel-transfer", "0=viridis"}, {"channel-gamma", "0=2"}}).status();
  EXPECT_THAT(both.message(), HasSubstr("fields['0'] has both a transfer function and a gamma"));
}

TEST(RequestOptionsTest, ValuesOfFilesMayBeNumbersListsAndTexts) {
  FrameRequest request = Standard();
  std::optional<std::string> mistake;
  const Json json = Json::Parse(R"({"look_at": [1, 2.5, -3], "zoom": 0.1, "projection": "perspective"})").value();
  JsonValue(json, "view", mistake).Fields(OptionFields(request, {"view."}));
  EXPECT_EQ(mistake, std::nullopt);
  EXPECT_EQ(request.view.look_at, (Vec3{1, 2.5, -3}));
  EXPECT_EQ(request.view.zoom, 0.1);
  EXPECT_EQ(OptionsJson(request, "view.").dump(), R"({"projection":"perspective","look-at":"1,2.5,-3","zoom":0.1})");
  const Json bad = Json::Parse(R"({"zoom": 0})").value();
  JsonValue(bad, "view", mistake).Fields(OptionFields(request, {"view."}));
  EXPECT_EQ(mistake, "view.zoom: zoom 0 is out of range [0.001, 10000]");
}

}  // namespace
}  // namespace slabstream
