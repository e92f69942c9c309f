// MetaImage with its samples in the same file or in others (.mha, .mhd), raw or zlib-compressed, by the fields that MetaIO documents.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include "common/text/parse_number.h"
#include "data/volume_io/formats.h"
#include "data/volume_io/length_names.h"
#include "data/volume_io/output.h"
#include "data/volume_io/stated_field.h"
#include "data/volume_io/text_header.h"

namespace slabstream {
namespace {

// The first name of a type is the one that is written.
constexpr std::array<std::pair<std::string_view, SampleType>, 12> kTypeNames = {{
    {"MET_CHAR", SampleType::kInt8},
    {"MET_UCHAR", SampleType::kUint8},
    {"MET_SHORT", SampleType::kInt16},
    {"MET_USHORT", SampleType::kUint16},
    {"MET_INT", SampleType::kInt32},
    {"MET_UINT", SampleType::kUint32},
    {"MET_LONG", SampleType::kInt32},  // four bytes in files, on every machine
    {"MET_ULONG", SampleType::kUint32},
    {"MET_LONG_LONG", SampleType::kInt64},
    {"MET_ULONG_LONG", SampleType::kUint64},
    {"MET_FLOAT", SampleType::kFloat32},
    {"MET_DOUBLE", SampleType::kFloat64},
}};

std::optional<SampleType> ToSampleType(std::string_view name) {
  const auto* const found = std::ranges::find(kTypeNames, name, [](const auto& entry) { return entry.first; });
  return found == kTypeNames.end() ? std::nullopt : std::optional(found->second);
}

std::string_view NameOf(SampleType type) {
  return std::ranges::find(kTypeNames, type, [](const auto& entry) { return entry.second; })->first;
}

bool IsTrue(const TextHeader& text, const char* key) {
  const std::string value = ToLower(text.Find(key).value_or("false"));
  return value.starts_with('t') || value == "1";
}

Result<RawHeader> ReadHeader(const TextHeader& text, const ReadOptions& options) {
  const auto sizes = text.Sizes("NDims", "DimSize");
  if (!sizes.ok()) return sizes.status();
  RawHeader header;
  if (Status status = SetSize(header, text.path, *sizes, options); !status.ok()) return status;
  const std::string channels = text.Find("ElementNumberOfChannels").value_or("1");
  header.components = ParseNumber<int>(channels).value_or(0);
  if (header.components < 1 || header.components > kMaxComponents) {
    return text.NotAVolume(fmt::format("ElementNumberOfChannels is '{}', must be in [1, {}]", channels, kMaxComponents));
  }
  const std::optional<SampleType> type = ToSampleType(*text.Find("ElementType"));
  if (!type) return text.NotAVolume("ElementType '" + *text.Find("ElementType") + "' is not supported");

  // Of synonyms the one that MetaIO prefers comes first.
  const std::size_t count = sizes->size();
  auto spacing = text.Numbers({"ElementSpacing", "ElementSize"}, count, std::vector<double>(count, 1));
  auto origin = text.Numbers({"Origin", "Offset", "Position"}, count, {0, 0, 0});
  auto directions = text.Numbers({"TransformMatrix", "Rotation", "Orientation"}, count * count, {});
  for (const auto* numbers : {&spacing, &origin, &directions}) {
    if (!numbers->ok()) return numbers->status();
  }
  header.type = *type;
  if (count == 2) {  // a slice, as thick as its pixels are wide
    spacing->push_back(spacing->front());
    origin->push_back(0);
  }
  header.steps = StepsOf(Triple(*spacing));
  if (count == 4) header.times = StatedTimes(header.times.count, (*spacing)[3], "");
  header.unit = LengthUnitNamed(text.Find("DistanceUnits").value_or(""));
  std::array<Vec3, 3> axes = StepsOf({1, 1, 1});
  for (std::size_t i = 0; i < std::min<std::size_t>(count, 3) && !directions->empty(); ++i) {
    axes[i] = count == 2 ? Vec3{(*directions)[2 * i], (*directions)[2 * i + 1], 0} : Triple(*directions, i * count);
  }
  // Without a matrix and an origin there is no orientation, unless letters name one.
  const std::string letters = text.Find("AnatomicalOrientation").value_or("");
  if (letters.find_first_not_of('?') == std::string::npos && directions->empty() && Triple(*origin) == Vec3{}) return header;
  // ITK writes all of its images in a patient's space: left, posterior, superior. It knows the letters of three axes only. VTK, whose
  // volumes have three axes, writes its own space, and question marks.
  const bool patient = letters != "???" || count != 3;
  if (!patient) {
    header.notes.emplace_back("AnatomicalOrientation is ???: taken for a scene, as VTK writes it, and not for a patient");
  } else if (letters.find_first_not_of('?') == std::string::npos) {
    header.notes.push_back(fmt::format("AnatomicalOrientation is {}: taken for a patient's space (left, posterior, superior), as ITK does",
                                       letters.empty() ? "not stated" : letters));
  }
  header.world = patient ? World::kPatient : World::kScene;
  header.matrix = "TransformMatrix";
  const Vec3 signs = patient ? kRasFromLps : Vec3{1, 1, 1};
  for (std::size_t i = 0; i < 3; ++i) header.steps[i] = (*spacing)[i] * (signs * axes[i]);
  header.origin = signs * Triple(*origin);
  return header;
}

Result<TextPayload> ReadPayload(const TextHeader& text) {
  if (text.Find("BinaryData") && !IsTrue(text, "BinaryData")) {
    return text.Refused("samples as text (BinaryData = False) are not supported");
  }
  const std::string file = *text.Find("ElementDataFile"), skipped = text.Find("HeaderSize").value_or("0");
  const std::string sizes = *text.Find("DimSize");
  const std::int64_t last = ParseNumber<std::int64_t>(sizes.substr(sizes.find_last_of(" \t") + 1)).value_or(1);
  TextPayload payload{.file = file,
                      .slices = text.Find("NDims") == "2" ? 1 : last,
                      .compression = IsTrue(text, "CompressedData") ? Compression::kDeflate : Compression::kNone,
                      .big_endian = IsTrue(text, "BinaryDataByteOrderMSB") || IsTrue(text, "ElementByteOrderMSB"),
                      .bytes_key = "HeaderSize",
                      .bytes = skipped};
  if (ToLower(file) != "local") return payload;
  // Bytes of this file, too, if there is such a field.
  payload.file = skipped == "0" ? std::nullopt : std::optional(std::filesystem::path(text.path).filename().string());
  return payload;
}

Result<LocatedSamples> Locate(const std::string& path, const ReadOptions& options) {
  return LocateInTextVolume(path,
                            {.name = "MetaImage",
                             .separators = "=:",
                             .data_keys = {"ElementDataFile"},
                             .data_ends_header = true,
                             .required = {"NDims", "DimSize", "ElementType", "ElementDataFile"},
                             .read_header = ReadHeader,
                             .read_payload = ReadPayload},
                            options);
}

// A patient's space is left, posterior, superior in MetaImage. Its letters say where each axis begins: left, posterior, inferior, since
// axes lie near those of World. A scene has question marks, as VTK's.
std::string SpaceLines(const VolumeGeometry& geometry) {
  const Orientation& orientation = geometry.orientation;
  const std::string unit = orientation.unit ? fmt::format("DistanceUnits = {}\n", FileNameOf(*orientation.unit)) : "";
  if (orientation.world == World::kVoxels) return unit;
  const bool patient = orientation.world == World::kPatient;
  const Vec3 signs = patient ? kRasFromLps : Vec3{1, 1, 1};
  const auto axis = [&](std::size_t i) { return Numbers(signs * orientation.axes[i]); };
  return fmt::format("TransformMatrix = {} {} {}\nOffset = {}\nAnatomicalOrientation = {}\n{}", axis(0), axis(1), axis(2),
                     Numbers(signs * orientation.origin), patient ? "LPI" : "???", unit);
}

std::string HeaderOf(const FileSamples& samples, const std::string& data_file) {
  const VolumeGeometry& geometry = samples.geometry();
  return fmt::format(
      "ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = False\nCompressedData = False\n"
      "{}ElementSpacing = {}\nDimSize = {} {} {}\nElementType = {}\nElementDataFile = {}\n",
      SpaceLines(geometry), Numbers(geometry.spacing), geometry.size.x, geometry.size.y, geometry.size.z, NameOf(samples.type()),
      data_file);
}

// .mhd has its samples in a .raw beside it.
std::string SecondFile(const std::string& path) {
  return ToLower(path).ends_with(".mhd") ? std::filesystem::path(path).replace_extension(".raw").string() : "";
}

Status Write(const FileSamples& samples, const std::string& path) {
  const std::string data_path = SecondFile(path);
  if (data_path.empty()) return WriteHeaderAndSamples(path, HeaderOf(samples, "LOCAL"), samples);
  Result<OutputFile> header = OutputFile::Create(path);
  if (!header.ok()) return header.status();
  Result<OutputFile> data = OutputFile::Create(data_path);
  if (!data.ok()) return data.status();
  AppendSamples(*data, samples);
  header->Append(HeaderOf(samples, std::filesystem::path(data_path).filename().string()));
  // Store both files before either takes its place.
  if (Status status = header->Close(); !status.ok()) return status;
  if (Status status = data->Close(); !status.ok()) return status;
  // The header of a volume that was there does not stand beside the voxels of this one, not even if the program ends in between.
  std::error_code ignored;
  if (std::filesystem::is_regular_file(std::filesystem::symlink_status(path, ignored))) std::filesystem::remove(path, ignored);
  if (Status status = data->Finish(); !status.ok()) return status;
  return header->Finish();
}

}  // namespace

VolumeFormat MetaImage() {
  return {.name = "MetaImage",
          .endings = {".mhd", ".mha"},
          .options = {"time", "channel"},
          .locate = Locate,
          .written_endings = {".mha", ".mhd"},
          .write = Write,
          .second_file = SecondFile};
}

}  // namespace slabstream
