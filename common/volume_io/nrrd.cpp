// NRRD with its samples in the same file or in one other (.nrrd, .nhdr), raw or gzip.
#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <string_view>
#include <utility>
#include <vector>

#include "common/volume_io/raw_volume.h"
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

Result<RawHeader> ReadHeader(const TextHeader& text, const std::string& path) {
  const auto wrong = [&](const std::string& why) { return Status::InvalidArgument(path + ": not a NRRD volume: " + why); };
  if (!text.first_line.starts_with("NRRD000")) return wrong("the first line is not NRRD000 and a digit");
  for (const char* key : {"type", "dimension", "sizes", "encoding"}) {
    if (text.Find(key).value_or("").empty()) return wrong(std::string(key) + " is missing");
  }
  const std::optional<SampleType> type = ToSampleType(*text.Find("type"));
  if (!type) return wrong("type '" + *text.Find("type") + "' is not supported");
  const std::int64_t dimensions = ToInteger(*text.Find("dimension")).value_or(0);
  if (dimensions < 1 || dimensions > 16) return wrong("dimension is '" + *text.Find("dimension") + "', must be 3");
  auto count = std::size_t(dimensions);
  const auto sizes = text.Numbers({"sizes"}, count, {});
  if (!sizes) return wrong("sizes is '" + *text.Find("sizes") + "', must be " + std::to_string(count) + " numbers");
  const std::string kinds = ToLower(text.Find("kinds").value_or("domain"));
  if (!kinds.starts_with("domain") && !kinds.starts_with("space") && !kinds.starts_with("?")) {
    return Status::InvalidArgument(path + ": has " + fmt::format("{}", sizes->front()) + " components a voxel, must have 1");
  }
  while (count > 3 && (*sizes)[count - 1] == 1) --count;
  if (count != 3) return Status::InvalidArgument(path + ": has " + std::to_string(count) + " dimensions, must have 3");
  const Result<Index3> size = ToSize(path, *sizes);
  if (!size.ok()) return size.status();

  RawHeader header;
  header.type = *type;
  header.size = *size;
  const auto spacings = text.Numbers({"spacings"}, sizes->size(), {1, 1, 1});
  const auto origin = text.Numbers({"space origin"}, 3, {0, 0, 0});
  const auto directions = text.Numbers({"space directions"}, 9, {});
  if (!spacings) return wrong("spacings must be " + std::to_string(sizes->size()) + " numbers");
  if (!origin) return wrong("space origin must be 3 numbers");
  if (!directions) return wrong("space directions must be 3 vectors of 3 numbers");
  const Vec3 lps = LpsFrom(ToLower(text.Find("space").value_or("")));
  header.spacing = {(*spacings)[0], (*spacings)[1], (*spacings)[2]};
  header.origin = lps * Vec3{(*origin)[0], (*origin)[1], (*origin)[2]};
  for (std::size_t i = 0; i < directions->size() / 3; ++i) {
    const Vec3 step = lps * Vec3{(*directions)[3 * i], (*directions)[3 * i + 1], (*directions)[3 * i + 2]};
    header.spacing[int(i)] = Length(step);
    if (Length(step) > 0) header.directions[i] = Normalized(step);
  }
  return header;
}

Result<Payload> FindPayload(const TextHeader& text, const std::string& path, std::int64_t sample_bytes) {
  const auto unsupported = [&](const std::string& what) { return Status::InvalidArgument(path + ": " + what); };
  Payload payload{.file = path, .offset = text.end};
  if (const auto file = text.Find({"data file", "datafile"})) {
    if (file->starts_with("LIST") || file->find('%') != std::string::npos) {
      return unsupported("data file '" + *file + "': samples in several files are not supported");
    }
    payload.file = std::filesystem::path(path).parent_path() / *file;  // an absolute name stays as it is
    payload.offset = 0;
  }

  const std::string encoding = ToLower(text.Find("encoding").value_or(""));
  payload.compressed = encoding == "gzip" || encoding == "gz";
  if (!payload.compressed && encoding != "raw") return unsupported("encoding '" + encoding + "' is not supported, raw and gzip are");
  payload.big_endian = ToLower(text.Find("endian").value_or("little")) == "big";

  if (text.Find({"line skip", "lineskip"}).value_or("0") != "0") return unsupported("line skip is not supported");
  const std::string skip_text = text.Find({"byte skip", "byteskip"}).value_or("0");
  const std::optional<std::int64_t> skip = ToInteger(skip_text);
  if (!skip || *skip < -1 || (*skip == -1 && payload.compressed)) {
    return unsupported("byte skip '" + skip_text + "' must be at least 0, or -1 with raw samples");
  }
  if (*skip == -1) return FromTheEnd(payload, path, sample_bytes);
  (payload.compressed ? payload.skip : payload.offset) += *skip;
  return payload;
}

}  // namespace

Result<RawVolume> ReadNrrd(const std::string& path) {
  const Result<TextHeader> text = ReadTextHeader(path, ':', KeyCase::kLower, "");
  if (!text.ok()) return text.status();
  const Result<RawHeader> header = ReadHeader(*text, path);
  if (!header.ok()) return header.status();
  const Result<Payload> payload = FindPayload(*text, path, header->sample_bytes());
  if (!payload.ok()) return payload.status();
  return ReadSamples(path, *header, *payload);
}

}  // namespace slabstream
