// MetaImage with its samples in the same file or in one other (.mha, .mhd), raw or zlib-compressed, by the fields that MetaIO documents.
#include <filesystem>
#include <optional>
#include <utility>
#include <vector>

#include "common/volume_io/raw_volume.h"
#include "common/volume_io/text_header.h"

namespace slabstream {
namespace {

constexpr std::size_t kDimensions = 3;

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

Result<RawHeader> ReadHeader(const TextHeader& text, const std::string& path) {
  const auto wrong = [&](const std::string& why) { return Status::InvalidArgument(path + ": not a MetaImage volume: " + why); };
  for (const char* key : {"NDims", "DimSize", "ElementType", "ElementDataFile"}) {
    if (text.Find(key).value_or("").empty()) return wrong(std::string(key) + " is missing");
  }
  // Read a fourth dimension, to report it unless its size is 1.
  const std::int64_t dimensions = ToInteger(*text.Find("NDims")).value_or(0);
  if (dimensions < 1 || dimensions > 4) return wrong("NDims is '" + *text.Find("NDims") + "', must be 3");
  const auto count = std::size_t(dimensions);
  const auto sizes = text.Numbers({"DimSize"}, count, {});
  if (!sizes) return wrong("DimSize is '" + *text.Find("DimSize") + "', must be " + std::to_string(count) + " numbers");
  if (count < kDimensions || (count > kDimensions && (*sizes)[kDimensions] != 1)) {
    return Status::InvalidArgument(path + ": has " + std::to_string(count) + " dimensions, must have 3");
  }
  const std::string channels = text.Find("ElementNumberOfChannels").value_or("1");
  if (channels != "1") return Status::InvalidArgument(path + ": has " + channels + " components a voxel, must have 1");
  const std::optional<SampleType> type = ToSampleType(*text.Find("ElementType"));
  if (!type) return wrong("ElementType '" + *text.Find("ElementType") + "' is not supported");

  const Result<Index3> size = ToSize(path, *sizes);
  if (!size.ok()) return size.status();
  const auto spacing = text.Numbers({"ElementSpacing", "ElementSize"}, count, std::vector<double>(count, 1));
  const auto origin = text.Numbers({"Offset", "Origin", "Position"}, count, std::vector<double>(count, 0));
  std::vector<double> identity(count * count);
  for (std::size_t i = 0; i < count; ++i) identity[i * count + i] = 1;
  const auto directions = text.Numbers({"TransformMatrix", "Rotation", "Orientation"}, count * count, identity);
  if (!spacing) return wrong("ElementSpacing must be " + std::to_string(count) + " numbers");
  if (!origin) return wrong("Offset must be " + std::to_string(count) + " numbers");
  if (!directions) return wrong("TransformMatrix must be " + std::to_string(count * count) + " numbers");

  RawHeader header;
  header.type = *type;
  header.size = *size;
  for (std::size_t i = 0; i < kDimensions; ++i) {
    header.spacing[int(i)] = (*spacing)[i];
    header.origin[int(i)] = (*origin)[i];
    for (std::size_t j = 0; j < kDimensions; ++j) header.directions[i][int(j)] = (*directions)[i * count + j];
  }
  return header;
}

Result<Payload> FindPayload(const TextHeader& text, const std::string& path, std::int64_t sample_bytes) {
  Payload payload{.file = path, .offset = text.end};
  payload.compressed = IsTrue(text, "CompressedData");
  payload.big_endian = IsTrue(text, "BinaryDataByteOrderMSB") || IsTrue(text, "ElementByteOrderMSB");
  if (text.Find("BinaryData") && !IsTrue(text, "BinaryData")) {
    return Status::InvalidArgument(path + ": samples as text (BinaryData = False) are not supported");
  }

  const std::string file = *text.Find("ElementDataFile");
  if (ToLower(file) == "local") return payload;
  if (file.starts_with("LIST") || file.find('%') != std::string::npos) {
    return Status::InvalidArgument(path + ": ElementDataFile '" + file + "': samples in several files are not supported");
  }
  payload.file = std::filesystem::path(path).parent_path() / file;  // an absolute name stays as it is
  const std::string skip = text.Find("HeaderSize").value_or("0");
  const std::optional<std::int64_t> offset = ToInteger(skip);
  if (!offset || *offset < -1) return Status::InvalidArgument(path + ": HeaderSize is '" + skip + "', must be at least -1");
  if (*offset == -1) return FromTheEnd(payload, path, sample_bytes);
  payload.offset = *offset;
  return payload;
}

}  // namespace

Result<RawVolume> ReadMetaImage(const std::string& path) {
  const Result<TextHeader> text = ReadTextHeader(path, '=', KeyCase::kAsWritten, "ElementDataFile");
  if (!text.ok()) return text.status();
  const Result<RawHeader> header = ReadHeader(*text, path);
  if (!header.ok()) return header.status();
  const Result<Payload> payload = FindPayload(*text, path, header->sample_bytes());
  if (!payload.ok()) return payload.status();
  return ReadSamples(path, *header, *payload);
}

}  // namespace slabstream
