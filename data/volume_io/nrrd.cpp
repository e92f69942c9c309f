// NRRD with its samples in the same file or in others (.nrrd, .nhdr), raw, gzip or bzip2.
#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include "common/text/parse_number.h"
#include "data/volume_io/formats.h"
#include "data/volume_io/length_names.h"
#include "data/volume_io/nrrd_axes.h"
#include "data/volume_io/output.h"
#include "data/volume_io/stated_field.h"
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

// Of "mm" "mm" "s".
std::vector<std::string_view> NamesIn(std::string_view text) {
  std::vector<std::string_view> names;
  for (std::size_t open = text.find('"'); open != std::string_view::npos; open = text.find('"')) {
    const std::size_t close = text.find('"', open + 1);
    if (close == std::string_view::npos) break;
    names.push_back(text.substr(open + 1, close - open - 1));
    text.remove_prefix(close + 1);
  }
  return names;
}

// The unit of three axes from number `first` on. None unless it is the same for all.
std::optional<LengthUnit> UnitOf(const std::vector<std::string_view>& names, std::size_t first) {
  if (names.size() < first + 3 || names[first + 1] != names[first] || names[first + 2] != names[first]) return std::nullopt;
  return LengthUnitNamed(names[first]);
}

Result<RawHeader> ReadHeader(const TextHeader& text, const ReadOptions& options) {
  const std::optional<SampleType> type = ToSampleType(*text.Find("type"));
  if (!type) return text.NotAVolume("type '" + *text.Find("type") + "' is not supported");
  Result<NrrdAxes> axes = ReadNrrdAxes(text);
  if (!axes.ok()) return axes.status();
  if (!(axes->components >= 1 && axes->components <= kMaxComponents)) {
    return text.NotAVolume(fmt::format("sizes begin with {} components, must be in [1, {}]", axes->components, kMaxComponents));
  }
  RawHeader header{.components = int(axes->components), .type = *type, .notes = std::move(axes->notes)};
  if (Status status = SetSize(header, text.path, axes->sizes, options, axes->channels); !status.ok()) return status;
  header.labels = text.Find("segment0_id:=").has_value();  // as 3D Slicer writes segmentations
  const auto count = std::size_t(ParseNumber<int>(*text.Find("dimension")).value_or(0));
  auto spacings = text.Numbers({"spacings"}, count, std::vector<double>(count, 1));
  auto origin = text.Numbers({"space origin"}, axes->space_numbers, std::vector<double>(axes->space_numbers, 0));
  for (const auto* numbers : {&spacings, &origin}) {
    if (!numbers->ok()) return numbers->status();
  }

  if (spacings->size() == axes->first + 2) spacings->push_back((*spacings)[axes->first]);  // a slice, as thick as its pixels are wide
  if (origin->size() == 2) origin->push_back(0);
  header.steps = StepsOf(Triple(*spacings, axes->first));
  const auto of_space = text.Find("space units");
  const std::string of_axes = text.Find("units").value_or("");
  const std::vector<std::string_view> units = NamesIn(of_space ? *of_space : of_axes);
  header.unit = UnitOf(units, of_space ? 0 : axes->first);
  if (axes->time) {
    const std::size_t unit = of_space ? 3 : *axes->time;
    const double step = text.Find("spacings") ? (*spacings)[*axes->time] : std::numeric_limits<double>::quiet_NaN();
    header.times = StatedTimes(header.times.count, axes->time_step.value_or(step), unit < units.size() ? units[unit] : "");
  }
  const std::string name = ToLower(text.Find("space").value_or(""));
  if (!axes->directions && name.empty()) return header;
  Space space = SpaceNamed(name);
  if (name.empty() && axes->space_numbers == 4) {
    space = {World::kPatient, kRasFromLps};
    header.notes.emplace_back("a space of four dimensions without a name: taken for left, posterior, superior and time, as ITK writes it");
  }
  header.world = space.world;
  header.matrix = axes->directions ? "space directions" : "spacings";
  for (std::size_t i = 0; i < 3; ++i) header.steps[i] = space.signs * (axes->directions ? (*axes->directions)[i] : header.steps[i]);
  header.origin = space.signs * Triple(*origin);
  return header;
}

Result<TextPayload> ReadPayload(const TextHeader& text) {
  const std::string encoding = ToLower(*text.Find("encoding"));
  TextPayload payload{.file = text.Find({"data file", "datafile"}),
                      .big_endian = ToLower(text.Find("endian").value_or("little")) == "big",
                      .lines_key = "line skip",
                      .lines = text.Find({"line skip", "lineskip"}).value_or("0"),
                      .bytes_key = "byte skip",
                      .bytes = text.Find({"byte skip", "byteskip"}).value_or("0")};
  if (encoding == "gzip" || encoding == "gz") {
    payload.compression = Compression::kDeflate;
  } else if (encoding == "bzip2" || encoding == "bz2") {
    payload.compression = Compression::kBzip2;
  } else if (encoding != "raw") {
    return text.Refused("encoding '" + encoding + "' is not supported; supported: raw, gzip and bzip2");
  }
  return payload;
}

Result<LocatedSamples> Locate(const std::string& path, const ReadOptions& options) {
  return LocateInTextVolume(path,
                            {.name = "NRRD",
                             .first_line = "NRRD000",
                             .separators = ":",
                             .key_value = ":=",
                             .ignores_case = true,
                             .data_keys = {"data file", "datafile"},
                             .required = {"type", "dimension", "sizes", "encoding"},
                             .read_header = ReadHeader,
                             .read_payload = ReadPayload},
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
