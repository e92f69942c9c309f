// NRRD with its samples in the same file or in one other (.nrrd, .nhdr), raw or gzip.
#include <fmt/format.h>

#include <algorithm>
#include <string_view>
#include <utility>
#include <vector>

#include "common/volume_io/text_header.h"

namespace slabstream {
namespace {

std::optional<SampleType> ToSampleType(const std::string& name) {
  static const std::pair<SampleType, std::vector<std::string_view>> kNames[] = {
      {SampleType::kInt8, {"signed char", "int8", "int8_t"}},
      {SampleType::kUint8, {"uchar", "unsigned char", "uint8", "uint8_t"}},
      {SampleType::kInt16, {"short", "short int", "signed short", "signed short int", "int16", "int16_t"}},
      {SampleType::kUint16, {"ushort", "unsigned short", "unsigned short int", "uint16", "uint16_t"}},
      {SampleType::kInt32, {"int", "signed int", "int32", "int32_t"}},
      {SampleType::kUint32, {"uint", "unsigned int", "uint32", "uint32_t"}},
      {SampleType::kInt64, {"longlong", "long long", "long long int", "signed long long", "signed long long int", "int64", "int64_t"}},
      {SampleType::kUint64, {"ulonglong", "unsigned long long", "unsigned long long int", "uint64", "uint64_t"}},
      {SampleType::kFloat32, {"float"}},
      {SampleType::kFloat64, {"double"}},
  };
  for (const auto& [type, names] : kNames) {
    if (std::find(names.begin(), names.end(), ToLower(name)) != names.end()) return type;
  }
  return std::nullopt;
}

// What a space is, and the signs that turn its axes into those of World. A left-handed space is mirrored, so that objects are not.
struct Space {
  World world = World::kVoxels;
  Vec3 signs = {1, 1, 1};
};

// `name`: in lower case, of the definition's list (with time or without); empty: the file names none.
Space SpaceNamed(std::string name) {
  if (const std::size_t time = name.find("-time"); time != std::string::npos) name.resize(time);
  if (name == "right-anterior-superior" || name.starts_with("ras")) return {World::kPatient, {1, 1, 1}};
  if (name == "left-anterior-superior" || name.starts_with("las")) return {World::kPatient, {-1, 1, 1}};
  if (name == "left-posterior-superior" || name.starts_with("lps")) return {World::kPatient, {-1, -1, 1}};
  if (name == "3d-left-handed") return {World::kScene, {-1, 1, 1}};
  return {World::kScene, {1, 1, 1}};
}

Result<RawHeader> ReadHeader(const TextHeader& text) {
  const std::optional<SampleType> type = ToSampleType(*text.Find("type"));
  if (!type) return text.NotAVolume("type '" + *text.Find("type") + "' is not supported");
  const auto sizes = text.Sizes("dimension", "sizes");
  if (!sizes.ok()) return sizes.status();
  const std::string kinds = ToLower(text.Find("kinds").value_or("domain"));
  if (!kinds.starts_with("domain") && !kinds.starts_with("space") && !kinds.starts_with("?")) {
    return text.Refused(fmt::format("has {} components a voxel, must have 1", sizes->front()));
  }
  const Result<Index3> size = ToSize(text.path, *sizes);
  if (!size.ok()) return size.status();
  const auto spacings = text.Numbers({"spacings"}, sizes->size(), {1, 1, 1});
  const auto origin = text.Numbers({"space origin"}, 3, {0, 0, 0});
  const auto directions = text.Numbers({"space directions"}, 9, {});
  for (const auto* numbers : {&spacings, &origin, &directions}) {
    if (!numbers->ok()) return numbers->status();
  }

  RawHeader header{.size = *size, .steps = StepsOf(Triple(*spacings)), .type = *type};
  const std::string name = ToLower(text.Find("space").value_or(""));
  if (directions->empty() && name.empty()) return header;
  const Space space = SpaceNamed(name);
  header.world = space.world;
  header.matrix = directions->empty() ? "spacings" : "space directions";
  for (std::size_t i = 0; i < 3; ++i) {
    header.steps[i] = space.signs * (directions->empty() ? header.steps[i] : Triple(*directions, 3 * i));
  }
  header.origin = space.signs * Triple(*origin);
  return header;
}

Result<Payload> FindPayload(const TextHeader& text, std::int64_t sample_bytes) {
  Result<Payload> payload = text.PayloadIn(text.Find({"data file", "datafile"}));
  if (!payload.ok()) return payload;
  const std::string encoding = ToLower(*text.Find("encoding"));
  payload->compressed = encoding == "gzip" || encoding == "gz";
  if (!payload->compressed && encoding != "raw") return text.Refused("encoding '" + encoding + "' is not supported, raw and gzip are");
  payload->big_endian = ToLower(text.Find("endian").value_or("little")) == "big";

  if (text.Find({"line skip", "lineskip"}).value_or("0") != "0") return text.Refused("line skip is not supported");
  const std::string skip_text = text.Find({"byte skip", "byteskip"}).value_or("0");
  if (payload->compressed && skip_text == "-1") return text.Refused("byte skip is -1, must be at least 0 for compressed samples");
  const Result<std::int64_t> skip = text.BytesToSkip("byte skip", skip_text, *payload, sample_bytes);
  if (!skip.ok()) return skip.status();
  (payload->compressed ? payload->skip : payload->offset) += *skip;
  return payload;
}

}  // namespace

Result<RawVolume> ReadNrrd(const std::string& path, const ReadOptions& options) {
  return ReadTextVolume(path,
                        {.name = "NRRD",
                         .first_line = "NRRD000",
                         .separator = ':',
                         .ignores_case = true,
                         .required = {"type", "dimension", "sizes", "encoding"},
                         .read_header = ReadHeader,
                         .find_payload = FindPayload},
                        options);
}

}  // namespace slabstream
