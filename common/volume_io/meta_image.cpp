// MetaImage with its samples in the same file or in one other (.mha, .mhd), raw or zlib-compressed, by the fields that MetaIO documents.
#include <optional>
#include <utility>

#include "common/volume_io/text_header.h"

namespace slabstream {
namespace {

std::optional<SampleType> ToSampleType(const std::string& name) {
  static constexpr std::pair<const char*, SampleType> kNames[] = {
      {"MET_CHAR", SampleType::kInt8},       {"MET_UCHAR", SampleType::kUint8},       {"MET_SHORT", SampleType::kInt16},
      {"MET_USHORT", SampleType::kUint16},   {"MET_INT", SampleType::kInt32},         {"MET_UINT", SampleType::kUint32},
      {"MET_LONG", SampleType::kInt32},      {"MET_ULONG", SampleType::kUint32},  // four bytes in files, on every machine
      {"MET_LONG_LONG", SampleType::kInt64}, {"MET_ULONG_LONG", SampleType::kUint64}, {"MET_FLOAT", SampleType::kFloat32},
      {"MET_DOUBLE", SampleType::kFloat64},
  };
  for (const auto& [known, type] : kNames) {
    if (name == known) return type;
  }
  return std::nullopt;
}

bool IsTrue(const TextHeader& text, const char* key) {
  const std::string value = ToLower(text.Find(key).value_or("false"));
  return value.starts_with('t') || value == "1";
}

Result<RawHeader> ReadHeader(const TextHeader& text) {
  const auto sizes = text.Sizes("NDims", "DimSize");
  if (!sizes.ok()) return sizes.status();
  const Result<Index3> size = ToSize(text.path, *sizes);
  if (!size.ok()) return size.status();
  const std::string channels = text.Find("ElementNumberOfChannels").value_or("1");
  if (channels != "1") return text.Refused("has " + channels + " components a voxel, must have 1");
  const std::optional<SampleType> type = ToSampleType(*text.Find("ElementType"));
  if (!type) return text.NotAVolume("ElementType '" + *text.Find("ElementType") + "' is not supported");

  const std::size_t count = sizes->size();
  const auto spacing = text.Numbers({"ElementSpacing", "ElementSize"}, count, {1, 1, 1});
  const auto origin = text.Numbers({"Offset", "Origin", "Position"}, count, {0, 0, 0});
  const auto directions = text.Numbers({"TransformMatrix", "Rotation", "Orientation"}, count * count, {});
  for (const auto* numbers : {&spacing, &origin, &directions}) {
    if (!numbers->ok()) return numbers->status();
  }
  RawHeader header{.size = *size, .steps = StepsOf(Triple(*spacing)), .type = *type};
  std::array<Vec3, 3> axes = StepsOf({1, 1, 1});
  for (std::size_t i = 0; i < 3 && !directions->empty(); ++i) axes[i] = Triple(*directions, i * count);
  // Only files about a patient name the directions of the axes; their space is left, posterior, superior. Others have no orientation
  // unless their matrix turns something.
  const bool patient = text.Find("AnatomicalOrientation").value_or("???").find('?') == std::string::npos;
  if (!patient && axes == StepsOf({1, 1, 1})) return header;
  header.world = patient ? World::kPatient : World::kScene;
  header.matrix = "TransformMatrix";
  const Vec3 signs = patient ? kRasFromLps : Vec3{1, 1, 1};
  for (std::size_t i = 0; i < 3; ++i) header.steps[i] = (*spacing)[i] * (signs * axes[i]);
  header.origin = signs * Triple(*origin);
  return header;
}

Result<Payload> FindPayload(const TextHeader& text, std::int64_t sample_bytes) {
  if (text.Find("BinaryData") && !IsTrue(text, "BinaryData")) {
    return text.Refused("samples as text (BinaryData = False) are not supported");
  }
  const std::string file = *text.Find("ElementDataFile");
  const bool local = ToLower(file) == "local";
  Result<Payload> payload = text.PayloadIn(local ? std::nullopt : std::optional(file));
  if (!payload.ok()) return payload;
  payload->compressed = IsTrue(text, "CompressedData");
  payload->big_endian = IsTrue(text, "BinaryDataByteOrderMSB") || IsTrue(text, "ElementByteOrderMSB");
  if (local) return payload;
  const Result<std::int64_t> skip = text.BytesToSkip("HeaderSize", text.Find("HeaderSize").value_or("0"), *payload, sample_bytes);
  if (!skip.ok()) return skip.status();
  payload->offset = *skip;
  return payload;
}

}  // namespace

Result<RawVolume> ReadMetaImage(const std::string& path, const ReadOptions& options) {
  return ReadTextVolume(path,
                        {.name = "MetaImage",
                         .separator = '=',
                         .last_key = "ElementDataFile",
                         .required = {"NDims", "DimSize", "ElementType", "ElementDataFile"},
                         .read_header = ReadHeader,
                         .find_payload = FindPayload},
                        options);
}

}  // namespace slabstream
