// Legacy VTK files of structured points (.vtk), ASCII or binary, by VTK's "File Formats". Their samples are the first scalars of the
// points, or the only array of a field there. Binary numbers are big endian.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/parse_number.h"
#include "common/volume_io/formats.h"
#include "common/volume_io/text_cursor.h"
#include "common/volume_io/text_header.h"

namespace slabstream {
namespace {

std::optional<SampleType> ToSampleType(std::string_view name) {
  static constexpr std::array<std::pair<std::string_view, SampleType>, 13> kNames = {{{"char", SampleType::kInt8},
                                                                                      {"signed_char", SampleType::kInt8},
                                                                                      {"unsigned_char", SampleType::kUint8},
                                                                                      {"short", SampleType::kInt16},
                                                                                      {"unsigned_short", SampleType::kUint16},
                                                                                      {"int", SampleType::kInt32},
                                                                                      {"unsigned_int", SampleType::kUint32},
                                                                                      {"long", SampleType::kInt64},
                                                                                      {"unsigned_long", SampleType::kUint64},
                                                                                      {"vtktypeint64", SampleType::kInt64},
                                                                                      {"vtktypeuint64", SampleType::kUint64},
                                                                                      {"float", SampleType::kFloat32},
                                                                                      {"double", SampleType::kFloat64}}};
  const auto* const found = std::ranges::find(kNames, name, [](const auto& entry) { return entry.first; });
  return found == kNames.end() ? std::nullopt : std::optional(found->second);
}

// Samples in the file: `tuples` of `components` each, from `offset` on.
struct Array {
  std::string name;
  SampleType type = SampleType::kUint8;
  int components = 1;
  std::int64_t tuples = 0, offset = 0;
};

class Parser {
 public:
  Parser(const std::string& path, const ReadOptions& options) : path_(path), options_(options), cursor_(path) {}

  Result<RawVolume> Read();

 private:
  Status Wrong(const std::string& why) const { return Status::InvalidArgument(path_ + ": " + why); }
  Status Ended() const { return Status::DataLoss(path_ + ": truncated: the header ends early"); }

  Status ReadKind();
  // Reads keywords up to the samples, which chosen_ then holds, or to the end of the file.
  Status ReadKeywords();
  Status OnKeyword(const std::string& keyword);
  Status ReadScalars();
  Status ReadField();
  Result<Vec3> ReadThree(const std::string& keyword);
  Result<std::int64_t> ReadCount(const std::string& keyword, std::int64_t most);
  Status Skip(const Array& array);
  // The one array that is read, or an error that names what there is.
  Result<Array> Chosen() const;

  const std::string& path_;
  const ReadOptions& options_;
  TextCursor cursor_;
  bool binary_ = false;
  RawHeader header_;
  Vec3 size_, spacing_ = {1, 1, 1};
  std::int64_t points_ = 0, cells_ = 0;  // since POINT_DATA or CELL_DATA; 0: not there, or before
  bool has_cell_data_ = false;
  std::optional<Array> scalars_;
  std::vector<Array> fields_;  // of points
};

Status Parser::ReadKind() {
  const std::optional<std::string> first = cursor_.Line();
  if (!first || !first->starts_with("# vtk DataFile Version")) {
    return Wrong("not a VTK volume: the first line does not begin with # vtk DataFile Version");
  }
  if (!cursor_.Line()) return Ended();  // the title
  const std::optional<std::string> encoding = cursor_.Word();
  if (!encoding) return Ended();
  binary_ = *encoding == "BINARY";
  if (!binary_ && *encoding != "ASCII")
    return Wrong(fmt::format("not a VTK volume: the third line is '{}', must be ASCII or BINARY", *encoding));
  return Status::Ok();
}

Result<Vec3> Parser::ReadThree(const std::string& keyword) {
  Vec3 three;
  for (int i = 0; i < 3; ++i) {
    const std::optional<std::string> word = cursor_.Word();
    if (!word) return Ended();
    const std::optional<double> number = ParseNumber<double>(*word);
    if (!number) return Wrong(fmt::format("{} has '{}', must be three numbers", keyword, *word));
    three[i] = *number;
  }
  return three;
}

Result<std::int64_t> Parser::ReadCount(const std::string& keyword, std::int64_t most) {
  const std::optional<std::string> word = cursor_.Word();
  if (!word) return Ended();
  const std::int64_t count = ParseNumber<std::int64_t>(*word).value_or(-1);
  if (count < 0 || count > most) return Wrong(fmt::format("{} has '{}', must be a whole number in [0, {}]", keyword, *word, most));
  return count;
}

constexpr std::int64_t kMostTuples = std::int64_t{1} << 48;

Status Parser::Skip(const Array& array) {
  const std::int64_t samples = array.tuples * array.components;
  if (binary_) {
    const std::int64_t bytes = samples * std::int64_t(BytesPerSample(array.type));
    if (Status status = CheckHolds({.file = path_, .offset = array.offset}, bytes); !status.ok()) return status;
    cursor_.GoTo(array.offset + bytes);
    return Status::Ok();
  }
  for (std::int64_t i = 0; i < samples; ++i) {
    if (!cursor_.Word()) return Ended();
  }
  return Status::Ok();
}

Status Parser::ReadScalars() {
  Array array;
  array.name = cursor_.Word().value_or("");
  const std::string type = cursor_.Word().value_or(""), components = cursor_.Line().value_or("");
  const std::optional<SampleType> known = ToSampleType(ToLower(type));
  if (!known) return Wrong(fmt::format("SCALARS {}: type '{}' is not supported", array.name, type));
  array.type = *known;
  if (const std::size_t digit = components.find_first_not_of(" \t"); digit != std::string::npos) {
    array.components =
        ParseNumber<int>(std::string_view(components).substr(digit, components.find_last_not_of(" \t") - digit + 1)).value_or(0);
    if (array.components < 1 || array.components > 4) {
      return Wrong(fmt::format("SCALARS {} has '{}' components, must be in [1, 4]", array.name, components.substr(digit)));
    }
  }
  if (cursor_.Word() != "LOOKUP_TABLE" || !cursor_.Line()) return Wrong(fmt::format("SCALARS {}: LOOKUP_TABLE is missing", array.name));
  array.offset = cursor_.offset();
  array.tuples = points_ + cells_;
  if (points_ == 0) return Skip(array);
  scalars_ = array;
  return Status::Ok();
}

Status Parser::ReadField() {
  constexpr std::int64_t kMostArrays = 4096;
  if (!cursor_.Word()) return Ended();  // its name
  const Result<std::int64_t> count = ReadCount("FIELD", kMostArrays);
  if (!count.ok()) return count.status();
  for (std::int64_t i = 0; i < *count; ++i) {
    Array array;
    array.name = cursor_.Word().value_or("");
    const Result<std::int64_t> components = ReadCount("FIELD", kMaxComponents), tuples = ReadCount("FIELD", kMostTuples);
    for (const auto* number : {&components, &tuples}) {
      if (!number->ok()) return number->status();
    }
    const std::string type = cursor_.Word().value_or("");
    const std::optional<SampleType> known = ToSampleType(ToLower(type));
    if (!known) return Wrong(fmt::format("array {} of a FIELD: type '{}' is not supported", array.name, type));
    if (!cursor_.Line()) return Ended();
    array = {array.name, *known, int(*components), *tuples, cursor_.offset()};
    if (points_ > 0 && array.tuples == points_) fields_.push_back(array);
    if (Status status = Skip(array); !status.ok()) return status;
  }
  return Status::Ok();
}

Status Parser::OnKeyword(const std::string& keyword) {
  if (keyword == "DATASET") {
    const std::string kind = cursor_.Word().value_or("");
    return kind == "STRUCTURED_POINTS" ? Status::Ok() : Wrong(fmt::format("a VTK dataset of type {}, must be STRUCTURED_POINTS", kind));
  }
  if (keyword == "DIMENSIONS" || keyword == "SPACING" || keyword == "ASPECT_RATIO" || keyword == "ORIGIN") {
    const Result<Vec3> three = ReadThree(keyword);
    if (!three.ok()) return three.status();
    (keyword == "DIMENSIONS" ? size_ : keyword == "ORIGIN" ? header_.origin : spacing_) = *three;
    return Status::Ok();
  }
  if (keyword == "POINT_DATA" || keyword == "CELL_DATA") {
    const Result<std::int64_t> count = ReadCount(keyword, kMostTuples);
    if (!count.ok()) return count.status();
    const bool points = keyword == "POINT_DATA";
    points_ = points ? *count : 0;
    cells_ = points ? 0 : *count;
    has_cell_data_ = has_cell_data_ || !points;
    return Status::Ok();
  }
  if (keyword == "SCALARS") return ReadScalars();
  if (keyword == "FIELD") return ReadField();
  if (keyword == "METADATA") {
    (void)cursor_.Line();
    while (!cursor_.Line().value_or("").empty()) {
    }
    return Status::Ok();
  }
  return Wrong(fmt::format("VTK attribute {} is not supported; supported: SCALARS and FIELD", keyword));
}

Status Parser::ReadKeywords() {
  while (!scalars_) {
    const std::optional<std::string> keyword = cursor_.Word();
    if (!keyword) return Status::Ok();
    if (Status status = OnKeyword(*keyword); !status.ok()) return status;
  }
  return Status::Ok();
}

Result<Array> Parser::Chosen() const {
  if (scalars_) return *scalars_;
  if (fields_.size() == 1) return fields_.front();
  std::string names;
  for (const Array& array : fields_) names.append(names.empty() ? "" : ", ").append(array.name);
  if (!names.empty()) return Wrong("has no scalars, and several arrays, must have one: " + names);
  return Wrong(has_cell_data_ ? "its samples belong to cells (CELL_DATA), must belong to points; ParaView's filter Cell Data to Point Data "
                                "makes them so"
                              : "has no samples of points (POINT_DATA)");
}

Result<RawVolume> Parser::Read() {
  if (!cursor_.is_open()) return Status::NotFound(path_ + ": cannot be opened for reading");
  if (Status status = ReadKind(); !status.ok()) return status;
  if (Status status = ReadKeywords(); !status.ok()) return status;
  const Result<Array> array = Chosen();
  if (!array.ok()) return array.status();
  if (Status status = SetSize(header_, path_, {size_.x, size_.y, size_.z}, options_); !status.ok()) return status;
  const std::int64_t voxels = VolumeGeometry{header_.size}.bounds().voxel_count();
  if (array->tuples != voxels) return Wrong(fmt::format("POINT_DATA has {} points, DIMENSIONS {}", array->tuples, voxels));
  if (array->components < 1) return Wrong(fmt::format("array {} has no components", array->name));
  header_.type = array->type;
  header_.components = array->components;
  header_.world = World::kScene;
  header_.matrix = "SPACING";
  header_.steps = StepsOf(spacing_);
  if (binary_) return ReadSamples(path_, header_, {.file = path_, .offset = array->offset, .big_endian = true}, options_);
  // A digit and a blank, at least.
  const std::int64_t least_bytes = 2 * header_.sample_bytes() / std::int64_t(BytesPerSample(header_.type)) - 1;
  if (Status status = CheckHolds({.file = path_, .offset = array->offset}, least_bytes); !status.ok()) return status;
  Result<RawVolume> raw = TakeMemory(path_, header_, options_);
  if (!raw.ok() || options_.headers_only) return raw;
  cursor_.GoTo(array->offset);
  if (Status status = ReadTextSamples(cursor_, header_.type, raw->bytes); !status.ok()) {
    return Status(status.code(), path_ + ": " + status.message());
  }
  return raw;
}

Result<RawVolume> Read(const std::string& path, const ReadOptions& options) { return Parser(path, options).Read(); }

}  // namespace

VolumeFormat VtkLegacy() { return {.name = "VTK", .endings = {".vtk"}, .options = {"channel"}, .read = Read}; }

}  // namespace slabstream
