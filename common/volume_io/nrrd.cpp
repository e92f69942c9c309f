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

// From this space to left, posterior, superior; spaces without a patient stay unchanged.
Vec3 LpsFrom(const std::string& space) {
  if (space == "right-anterior-superior" || space == "ras") return {-1, -1, 1};
  if (space == "left-anterior-superior" || space == "las") return {1, -1, 1};
  return {1, 1, 1};
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

  const Vec3 lps = LpsFrom(ToLower(text.Find("space").value_or("")));
  RawHeader header{.size = *size, .spacing = Triple(*spacings), .origin = lps * Triple(*origin), .type = *type};
  for (std::size_t i = 0; i < directions->size() / 3; ++i) {
    const Vec3 step = lps * Triple(*directions, 3 * i);
    header.spacing[int(i)] = Length(step);
    if (Length(step) > 0) header.directions[i] = Normalized(step);
  }
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

Result<RawVolume> ReadNrrd(const std::string& path) {
  return ReadTextVolume(path, {.name = "NRRD",
                               .first_line = "NRRD000",
                               .separator = ':',
                               .ignores_case = true,
                               .required = {"type", "dimension", "sizes", "encoding"},
                               .read_header = ReadHeader,
                               .find_payload = FindPayload});
}

}  // namespace slabstream
