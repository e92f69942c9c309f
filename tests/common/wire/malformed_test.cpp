// Hostile input: whatever is changed in a valid message, the answer is an error that names the field, or a message that is valid again.
#include <gmock/gmock.h>
#include <google/protobuf/descriptor.h>
#include <google/protobuf/message.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <limits>
#include <map>
#include <string>
#include <vector>

#include "common/volume/filled_box.h"
#include "common/wire/any_message.h"
#include "common/wire/limits.h"
#include "slabstream/v1/about.pb.h"
#include "slabstream/v1/envelope.pb.h"
#include "tests/common/wire/decode_any_input.h"
#include "tests/common/wire/error_of.h"
#include "tests/common/wire/samples.h"
#include "tests/support/random.h"

namespace slabstream {
namespace {

using google::protobuf::FieldDescriptor;
using google::protobuf::Message;
using google::protobuf::Reflection;
using testing::StartsWith;

v1::Envelope EnvelopeOf(const AnyMessage& message) {
  v1::Envelope envelope;
  const std::vector<std::byte> header = Encode(message);
  EXPECT_TRUE(envelope.ParseFromArray(header.data(), int(header.size())));
  return envelope;
}

// A field of a message inside an envelope, under the name that errors use: "Ping.cancelled". index: of an item of a repeated field, else
// -1.
struct Place {
  Message* message;
  const FieldDescriptor* field;
  int index;
  std::string path;
};

// Calls `visit` for every field that the message has, singular ones and items one by one, and for each repeated field as a whole (index
// -1).
void VisitFields(Message& message, const std::string& path, const std::function<void(const Place&)>& visit) {
  const Reflection& reflection = *message.GetReflection();
  for (int i = 0; i < message.GetDescriptor()->field_count(); ++i) {
    const FieldDescriptor* field = message.GetDescriptor()->field(i);
    const bool is_message = field->cpp_type() == FieldDescriptor::CPPTYPE_MESSAGE;
    const std::string name = path + "." + field->name();
    if (field->is_repeated()) {
      const int size = reflection.FieldSize(message, field);
      for (int k = 0; k < size; ++k) {
        const std::string item = name + "[" + std::to_string(k) + "]";
        if (is_message) {
          VisitFields(*reflection.MutableRepeatedMessage(&message, field, k), item, visit);
        } else {
          visit({&message, field, k, item});
        }
      }
      visit({&message, field, -1, name});
    } else if (is_message) {
      if (reflection.HasField(message, field)) VisitFields(*reflection.MutableMessage(&message, field), name, visit);
    } else if (!field->has_presence() || reflection.HasField(message, field)) {
      visit({&message, field, -1, name});
    }
  }
}

// For each sample and each of its fields: `alter` changes it (false: this field is none of its business), `expect` sees the error, the
// field is restored.
void AlterEachField(const std::function<bool(const Place&)>& alter, const std::function<void(const Place&, const std::string&)>& expect) {
  int altered = 0;
  for (const AnyMessage& sample : AllSamples()) {
    v1::Envelope envelope = EnvelopeOf(sample);
    const auto* member = envelope.GetReflection()->GetOneofFieldDescriptor(envelope, envelope.GetDescriptor()->oneof_decl(0));
    VisitFields(*envelope.GetReflection()->MutableMessage(&envelope, member), std::string(NameOf(sample)), [&](const Place& place) {
      const std::unique_ptr<Message> before(place.message->New());
      before->CopyFrom(*place.message);
      if (!alter(place)) return;
      ++altered;
      expect(place, ErrorOf(envelope));
      // Field by field: replacing the whole message would move the ones that are being visited.
      const Reflection& reflection = *place.message->GetReflection();
      if (!place.field->is_repeated()) {
        reflection.SwapFields(place.message, before.get(), {place.field});
      } else if (place.index < 0) {
        while (reflection.FieldSize(*place.message, place.field) > reflection.FieldSize(*before, place.field))
          reflection.RemoveLast(place.message, place.field);
      } else {
        reflection.SwapFields(place.message, before.get(), {place.field});
      }
    });
  }
  EXPECT_GT(altered, 0);
}

bool IsItem(const Place& place) { return !place.field->is_repeated() || place.index >= 0; }

TEST(Malformed, NoNumberMayBeNanOrInfinite) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  for (const double bad : {std::numeric_limits<double>::quiet_NaN(), kInfinity, -kInfinity}) {
    AlterEachField(
        [&](const Place& place) {
          const Reflection& reflection = *place.message->GetReflection();
          if (!IsItem(place)) return false;
          if (place.field->cpp_type() == FieldDescriptor::CPPTYPE_DOUBLE) {
            place.index < 0 ? reflection.SetDouble(place.message, place.field, bad)
                            : reflection.SetRepeatedDouble(place.message, place.field, place.index, bad);
            return true;
          }
          if (place.field->cpp_type() == FieldDescriptor::CPPTYPE_FLOAT) {
            reflection.SetFloat(place.message, place.field, float(bad));
            return true;
          }
          return false;
        },
        [](const Place& place, const std::string& error) { EXPECT_THAT(error, StartsWith(place.path + ": ")); });
  }
}

TEST(Malformed, NoEnumMayHaveAnUnknownValue) {
  for (const int bad : {0, -1, 99, std::numeric_limits<int>::max(), std::numeric_limits<int>::min()}) {
    AlterEachField(
        [&](const Place& place) {
          if (place.field->cpp_type() != FieldDescriptor::CPPTYPE_ENUM) return false;
          const auto* const order = dynamic_cast<const v1::KeysOrder*>(place.message);
          if (order != nullptr && place.field->name() == "role" && order->action() != v1::KEYS_ACTION_ROTATE) return false;  // ignored
          place.message->GetReflection()->SetEnumValue(place.message, place.field, bad);
          return true;
        },
        [&](const Place& place, const std::string& error) {
          // Replies and plans state everything.
          const bool of_request = place.path.find("FrameSetup") == std::string::npos && !place.path.starts_with("GroupAssignment") &&
                                  !place.path.starts_with("FrameReply") && !place.path.starts_with("ViewReply") &&
                                  !place.path.starts_with("ViewQuery.path");
          const bool has_standard = of_request && !place.field->options().GetExtension(v1::about).standard().empty();
          const bool of_world = place.field->containing_type() == v1::Orientation::descriptor() && place.field->name() == "unit";
          if (bad == 0 && (has_standard || of_world)) {
            EXPECT_EQ(error, "") << place.path << " has a standard value, or a file states none";
          } else {
            EXPECT_EQ(error, place.path + (bad == 0 ? ": not set" : ": unknown value " + std::to_string(bad)));
          }
        });
  }
}

TEST(Malformed, ARefusalIsOneLineWhateverItQuotes) {
  SubmitFrame message{.request = 1};
  message.frame.dataset = "brain";
  message.frame.renderer = "a\nb";
  const std::string error = Decode(Encode(message)).status().message();
  EXPECT_THAT(error, StartsWith("SubmitFrame.frame: renderer is 'a?b'"));
}

TEST(Malformed, EveryTextIsBounded) {
  constexpr std::size_t kTooLong = std::max({kMaxTextBytes, kMaxDataItemBytes, kMaxSourceBytes}) + 1;
  AlterEachField(
      [&](const Place& place) {
        if (place.field->cpp_type() != FieldDescriptor::CPPTYPE_STRING || !IsItem(place)) return false;
        const Reflection& reflection = *place.message->GetReflection();
        if (place.index >= 0) {
          reflection.SetRepeatedString(place.message, place.field, place.index, std::string(kTooLong, 'x'));
          return true;
        }
        // A dataset that has not failed has no error: there the field does not count, however long.
        if (place.path.find(".error") != std::string::npos && reflection.GetString(*place.message, place.field).empty()) return false;
        reflection.SetString(place.message, place.field, std::string(kTooLong, 'x'));
        return true;
      },
      [](const Place& place, const std::string& error) {
        EXPECT_THAT(error, StartsWith(place.path + ": a text of " + std::to_string(kTooLong) + " bytes, expected "));
      });
}

TEST(Malformed, EveryRepeatedFieldIsBounded) {
  // By the field's name: how many items are allowed. A new repeated field needs its line.
  const std::map<std::string, std::size_t> limits = {
      {"cancelled", kMaxCancelled},
      {"gone", kMaxPeers},
      {"colors", kMaxTransferPoints},
      {"opacities", kMaxTransferPoints},
      {"lights", kMaxLights},
      {"placements", kMaxRanks},
      {"filled", kMaxFilled},
      {"coarser", kMaxLevels - 1},
      {"levels", kMaxLevels},
      {"peers", kMaxPeers},
      {"boxes", 4096},
      {"used", 64},
      {"steered", 64},
      {"values", 64},
      {"reports", kMaxReports},
      {"spans", kMaxSpans},
      {"open", kMaxOpenRequests},
      {"known", kMaxOpenRequests},
      {"asked", kMaxOpenRequests},
      {"lost", kMaxOpenRequests},
      {"workers", kMaxListed},
      {"datasets", kMaxListed},
      {"keys", kMaxListed},
      {"items", kMaxDataItems},
      {"x_row", 4},
      {"y_row", 4},
      {"w_row", 4},
      {"depth_row", 4},
      {"from_picture", 9},
      {"stage_ns", kStageCount},
      {"planes", 3},
      {"labels", kMaxLabels},
      {"histogram", kHistogramBins},
      {"percentiles", kMaxPercentiles},
      {"points", kMaxSamplePoints},
      {"samples", kMaxSamplePoints},
      {"clip_planes", kMaxClipPlanes},
      {"isosurfaces", kMaxIsosurfaces},
      {"gradient_opacities", kMaxTransferPoints},
      {"regions", kMaxTransferRegions},
      {"corners", kMaxRegionCorners},
      {"counts", std::size_t{kJointValues} * kJointSlopes},
      {"sides", kMaxClipSides},
      {"FrameRequest.shapes", kMaxShownShapes},
      {"FrameRequest.planes", kMaxPlanes},
      {"FrameSetup.shapes", kMaxShownShapes + kMaxPlanes},
      {"map", kShapeMapColors},
      {"shown", kMaxLabelRanges},
      {"entries", 2 * kMaxLabels},
      {"parameters", kMaxParameters},
      {"renderers", 256},
      {"abilities", 64},
      {"channels", kMaxShownFields},
      {"fields", kMaxFields},
      {"of_volume", kMaxLevels},
      {"roots", kMaxShares},
      {"runs", kMaxRanks},
      {"shares", kMaxShares},
      {"web", kMaxWebServers},
      {"looks", kMaxFields},
      {"bars", kMaxShownFields},
      {"path", 1024},
      {"at", 1024},
      {"GroupAssignment.tiles", 1 << 20},
      {"others", kMaxPeers},
      {"TileOrder.tiles", 65536},
      {"ShapeTiles.tiles", 65536},
      {"bytes", 65536},
      {"x_places", kMaxVolumeSide},
      {"y_places", kMaxVolumeSide},
      {"z_places", kMaxVolumeSide},
  };
  // By message and name, where messages have fields of one name with different limits.
  const auto limit_of = [&](const FieldDescriptor& field) {
    const auto own = limits.find(field.containing_type()->name() + "." + field.name());
    return own != limits.end() ? own : limits.find(field.name());
  };
  std::map<std::string, bool> seen;
  AlterEachField(
      [&](const Place& place) {
        if (!place.field->is_repeated() || place.index >= 0) return false;
        // Only a dataset that is ready tells its levels.
        if (const auto* const dataset = dynamic_cast<const v1::DatasetStatus*>(place.message)) {
          if (dataset->state() != v1::DATASET_STATE_READY) return false;
        }
        if (seen[place.field->full_name()]) return false;  // once is enough: these messages are large
        seen[place.field->full_name()] = true;
        const auto limit = limit_of(*place.field);
        if (limit == limits.end()) {
          ADD_FAILURE() << place.path << " has no limit in this test";
          return false;
        }
        const Reflection& reflection = *place.message->GetReflection();
        while (std::size_t(reflection.FieldSize(*place.message, place.field)) <= limit->second) {
          switch (place.field->cpp_type()) {
            case FieldDescriptor::CPPTYPE_MESSAGE: reflection.AddMessage(place.message, place.field); break;
            case FieldDescriptor::CPPTYPE_DOUBLE: reflection.AddDouble(place.message, place.field, 1); break;
            case FieldDescriptor::CPPTYPE_INT64: reflection.AddInt64(place.message, place.field, 1); break;
            case FieldDescriptor::CPPTYPE_STRING: reflection.AddString(place.message, place.field, "a"); break;
            case FieldDescriptor::CPPTYPE_UINT32: reflection.AddUInt32(place.message, place.field, 1); break;
            default: reflection.AddUInt64(place.message, place.field, 1);
          }
        }
        return true;
      },
      [&](const Place& place, const std::string& error) {
        EXPECT_THAT(error, StartsWith(place.path + ": " + std::to_string(limit_of(*place.field)->second + 1)));
      });
  EXPECT_EQ(seen.size(), limits.size() + 26)
      << "fields are in five messages, reports and levels in four, parameters and labels in three; datasets, keys, isosurfaces, "
         "gradients, opacities, traffic, colors, entries, paths, channels, labels that show, and values that are steered in two";
}

TEST(Malformed, LimitsOfTheSchemaAreThoseOfTheCode) {
  const std::map<std::string, double> limits = {
      {"AddVolume.name", kMaxNameBytes},
      {"Chunk.raw_bytes", kChunkBytes},
      {"DataOrder.items", kMaxDataItemBytes},
      {"FrameStatistics.lowered", kMaxTextBytes},
      {"FrameStatistics.missing", kMaxTextBytes},
      {"GroupKey.group", kMaxGroups - 1},
      {"Index3.x", kMaxVolumeSide},
      {"Label.name", kMaxLabelNameBytes},
      {"PackedRuns.bytes", double(kMaxRunsBytes - 1)},
      {"PartialImage.interval_end", kMaxRanks},
      {"PartialImage.step", kMaxSteps},
      {"PicturesDoor.key", kKeyTextBytes},
      {"PixelRange.end", double(kMaxFramePixels)},
      {"Placement.level", kMaxLevels - 1},
      {"Register.images_endpoint", kMaxEndpointBytes},
      {"Register.threads", kMaxThreads},
      {"SentFile.bytes", double(kMaxSentFileBytes)},
      {"SentPicture.bytes", double(kMaxRunsBytes)},
      {"SharedBlock.offset", double(kArenaBytes)},
      {"SharedBlock.slot", kArenaSlots - 1},
      {"SharedImage.stride", kMaxFrameSide},
      {"SheetGrid.height", kMaxGridSide},
      {"StoredAt.source", kMaxSourceBytes},
      {"VolumePart.bytes", kMaxVolumePartBytes},
  };
  const auto* const schema = v1::Envelope::descriptor()->file()->pool();
  for (const auto& [name, limit] : limits) {
    const FieldDescriptor* const field = schema->FindFieldByName("slabstream.v1." + name);
    ASSERT_NE(field, nullptr) << name;
    const v1::Wire& wire = field->options().GetExtension(v1::wire);
    EXPECT_EQ(wire.has_most() ? wire.most() : 256, limit) << name;
  }
}

TEST(Malformed, MissingFieldsAreNoCrash) {
  AlterEachField(
      [&](const Place& place) {
        if (!IsItem(place) || place.index >= 0) return false;
        place.message->GetReflection()->ClearField(place.message, place.field);
        return true;
      },
      [](const Place&, const std::string&) {});
  for (int i = 0; i < v1::Envelope::descriptor()->oneof_decl(0)->field_count(); ++i) {
    v1::Envelope envelope;
    envelope.set_version(kWireVersion);
    envelope.GetReflection()->MutableMessage(&envelope, v1::Envelope::descriptor()->oneof_decl(0)->field(i));
    const std::string bytes = envelope.SerializeAsString();
    DecodeAnyInput({reinterpret_cast<const std::byte*>(bytes.data()), bytes.size()});
  }
}

TEST(Malformed, EveryTruncationIsAnErrorOrAMessage) {
  for (const AnyMessage& sample : AllSamples()) {
    const std::vector<std::byte> header = Encode(sample);
    for (std::size_t length = 0; length < header.size(); ++length) DecodeAnyInput(std::span(header).first(length));
  }
}

TEST(Malformed, FlippedBitsAreAnErrorOrAMessage) {
  Random random(20260728);
  SCOPED_TRACE(random.trace());
  std::cout << random.trace() << '\n';
  int messages = 0, errors = 0;
  for (const AnyMessage& sample : AllSamples()) {
    const std::vector<std::byte> header = Encode(sample);
    for (int round = 0; round < 400; ++round) {
      std::vector<std::byte> altered = header;
      for (int flips = random.Integer(1, 4); flips > 0; --flips) {
        altered[random.Integer<std::size_t>(0, altered.size() - 1)] ^= std::byte(1U << random.Integer(0U, 7U));
      }
      ++(DecodeAnyInput(altered) ? messages : errors);
    }
  }
  EXPECT_GT(messages, 1000);
  EXPECT_GT(errors, 1000);
}

TEST(Malformed, RandomBytesAreAnErrorOrAMessage) {
  Random random(42);
  SCOPED_TRACE(random.trace());
  std::cout << random.trace() << '\n';
  for (int round = 0; round < 5000; ++round) {
    // After a true beginning, so that the body is reached: the version, some member, some length.
    std::vector<std::byte> input = {std::byte{0x08}, std::byte{kWireVersion}};
    for (int bytes = random.Integer(0, 200); bytes > 0; --bytes) input.push_back(std::byte(random.Integer(0, 255)));
    DecodeAnyInput(input);
  }
}

}  // namespace
}  // namespace slabstream
