// NRRD with its samples in the same file or in one other (.nrrd, .nhdr), raw or gzip.
#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include "data/volume_io/formats.h"
#include "data/volume_io/length_names.h"
#include "data/volume_io/output.h"
#include "data/volume_io/text_header.h"

namespace slabstream {
namespace {

// The first name is the one that is written.
const std::vector<std::pair<SampleType, std::vector<std::string_view>>>& TypeNames() {
  static const std::vector<std::pair<SampleType, std::vector<std::string_view>>> kNames = {
      {SampleType::kInt8, {"int8", "signed char", "int8_t"}},
      {SampleType::kUint8, {"uint8", "uchar", "unsigned char", "uint8_t"}},
      {SampleType::kInt16, {"int16", "short", "short int", "signed short", "signed short int", "int16_t"}},
      {SampleType::kUint16, {"uint16", "ushort", "unsigned short", "unsigned short int", "uint16_t"}},
      {SampleType::kInt32, {"int32", "int", "signed int", "int32_t"}},
      {SampleType::kUint32, {"uint32", "uint", "unsigned int", "uint32_t"}},
      {SampleType::kInt64, {"int64", "longlong", "long long", "long long int", "signed long long", "signed long long int", "int64_t"}},
      {SampleType::kUint64, {"uint64", "ulonglong", "unsigned long long", "unsigned long long int", "uint64_t"}},
      {SampleType::kFloat32, {"float"}},
      {SampleType::kFloat64, {"double"}},
  };
  return kNames;
}

std::optional<SampleType> ToSampleType(const std::string& name) {
  for (const auto& [type, names] : TypeNames()) {
    if (std::find(names.begin(), names.end(), ToLower(name)) != names.end()) return type;
  }
  return std::nullopt;
}

std::string_view NameOf(SampleType wanted) {
  const auto found = std::ranges::find(TypeNames(), wanted, [](const auto& entry) { return entry.first; });
  return found->second.front();
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

// The unit of three axes from number `first` on, of "mm" "mm" "mm": a name in quotes for each axis. None unless it is the same for all.
std::optional<LengthUnit> UnitOf(std::string_view text, std::size_t first) {
  std::vector<std::string_view> names;
  for (std::size_t open = text.find('"'); open != std::string_view::npos; open = text.find('"')) {
    const std::size_t close = text.find('"', open + 1);
    if (close == std::string_view::npos) break;
    names.push_back(text.substr(open + 1, close - open - 1));
    text.remove_prefix(close + 1);
  }
  if (names.size() < first + 3 || names[first + 1] != names[first] || names[first + 2] != names[first]) return std::nullopt;
  return LengthUnitNamed(names[first]);
}

Result<RawHeader> ReadHeader(const TextHeader& text, const ReadOptions& options) {
  const std::optional<SampleType> type = ToSampleType(*text.Find("type"));
  if (!type) return text.NotAVolume("type '" + *text.Find("type") + "' is not supported");
  const auto sizes = text.Sizes("dimension", "sizes");
  if (!sizes.ok()) return sizes.status();
  RawHeader header{.type = *type};
  // Components lie along the first axis: as its kind says, or if there is none, where it is as short as a colour.
  const std::string kinds =
      ToLower(text.Find("kinds").value_or(sizes->size() == 4 && (sizes->front() == 3 || sizes->front() == 4) ? "color" : "domain"));
  const bool components = !kinds.starts_with("domain") && !kinds.starts_with("space") && !kinds.starts_with("?");
  const std::size_t first = components ? 1 : 0;
  if (components) {
    if (!(sizes->front() >= 1 && sizes->front() <= kMaxComponents)) {
      return text.NotAVolume(fmt::format("sizes begin with {} components, must be in [1, {}]", sizes->front(), kMaxComponents));
    }
    header.components = int(sizes->front());
  }
  if (Status status = SetSize(header, text.path, {sizes->begin() + std::ptrdiff_t(first), sizes->end()}, options); !status.ok())
    return status;
  header.labels = text.Find("segment0_id").has_value();  // as 3D Slicer writes segmentations
  const auto spacings = text.Numbers({"spacings"}, sizes->size(), std::vector<double>(sizes->size(), 1));
  const auto origin = text.Numbers({"space origin"}, 3, {0, 0, 0});
  const auto directions = text.Numbers({"space directions"}, 9, {});
  for (const auto* numbers : {&spacings, &origin, &directions}) {
    if (!numbers->ok()) return numbers->status();
  }

  header.steps = StepsOf(Triple(*spacings, first));
  const auto of_space = text.Find("space units");
  header.unit = of_space ? UnitOf(*of_space, 0) : UnitOf(text.Find("units").value_or(""), first);
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
  if (!payload->compressed && encoding != "raw")
    return text.Refused("encoding '" + encoding + "' is not supported; supported: raw and gzip");
  payload->big_endian = ToLower(text.Find("endian").value_or("little")) == "big";

  if (text.Find({"line skip", "lineskip"}).value_or("0") != "0") return text.Refused("line skip is not supported");
  const std::string skip_text = text.Find({"byte skip", "byteskip"}).value_or("0");
  if (payload->compressed && skip_text == "-1") return text.Refused("byte skip is -1, must be at least 0 for compressed samples");
  const Result<std::int64_t> skip = text.BytesToSkip("byte skip", skip_text, *payload, sample_bytes);
  if (!skip.ok()) return skip.status();
  (payload->compressed ? payload->skip : payload->offset) += *skip;
  return payload;
}

Result<LocatedSamples> Locate(const std::string& path, const ReadOptions& options) {
  return LocateInTextVolume(path,
                            {.name = "NRRD",
                             .first_line = "NRRD000",
                             .separator = ':',
                             .ignores_case = true,
                             .required = {"type", "dimension", "sizes", "encoding"},
                             .read_header = ReadHeader,
                             .find_payload = FindPayload},
                            options);
}

// The header's lines about the spacing and, if it is known, the orientation.
std::string SpaceLines(const VolumeGeometry& geometry) {
  const Orientation& orientation = geometry.orientation;
  const std::string units = orientation.unit ? fmt::format("units: \"{0}\" \"{0}\" \"{0}\"\n", FileNameOf(*orientation.unit)) : "";
  if (orientation.world == World::kVoxels) return fmt::format("spacings: {}\n{}", Numbers(geometry.spacing), units);
  const auto step = [&](int i) { return Numbers(geometry.spacing[i] * orientation.axes[std::size_t(i)], ","); };
  return fmt::format("space: {}\n{}{}space directions: ({}) ({}) ({})\nspace origin: ({})\n",
                     orientation.world == World::kPatient ? "right-anterior-superior" : "3D-right-handed", units.empty() ? "" : "space ",
                     units, step(0), step(1), step(2), Numbers(orientation.origin, ","));
}

Status Write(const FileSamples& samples, const std::string& path) {
  const VolumeGeometry& geometry = samples.geometry();
  const std::string header =
      fmt::format("NRRD0004\ntype: {}\ndimension: 3\n{}sizes: {} {} {}\nkinds: domain domain domain\nendian: little\nencoding: gzip\n\n",
                  NameOf(samples.type()), SpaceLines(geometry), geometry.size.x, geometry.size.y, geometry.size.z);
  return WriteHeaderAndSamples(path, header, samples, Gzipped::kSamples);
}

}  // namespace

VolumeFormat Nrrd() {
  return {.name = "NRRD",
          .endings = {".nrrd", ".nhdr"},
          .options = {"time", "channel"},
          .locate = Locate,
          .written_endings = {".nrrd"},
          .write = Write};
}

}  // namespace slabstream
