#include "data/volume_io/vtk_legacy_file.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <utility>

#include "common/base/second_of.h"
#include "common/text/parse_number.h"
#include "data/volume_io/payload.h"
#include "data/volume_io/raw_volume.h"
#include "data/volume_io/text_header.h"

namespace slabstream {
namespace {

constexpr std::int64_t kMostTuples = std::int64_t{1} << 48;
constexpr std::string_view kFirstLine = "# vtk DataFile Version";

std::optional<SampleType> ToSampleType(std::string_view name) {
  // VTK writes its own type of numbers of points and cells as int.
  static constexpr std::array<std::pair<std::string_view, SampleType>, 20> kTypeNames = {{{"char", SampleType::kInt8},
                                                                                          {"signed_char", SampleType::kInt8},
                                                                                          {"unsigned_char", SampleType::kUint8},
                                                                                          {"short", SampleType::kInt16},
                                                                                          {"unsigned_short", SampleType::kUint16},
                                                                                          {"int", SampleType::kInt32},
                                                                                          {"unsigned_int", SampleType::kUint32},
                                                                                          {"long", SampleType::kInt64},
                                                                                          {"unsigned_long", SampleType::kUint64},
                                                                                          {"vtkidtype", SampleType::kInt32},
                                                                                          {"vtktypeint8", SampleType::kInt8},
                                                                                          {"vtktypeuint8", SampleType::kUint8},
                                                                                          {"vtktypeint16", SampleType::kInt16},
                                                                                          {"vtktypeuint16", SampleType::kUint16},
                                                                                          {"vtktypeint32", SampleType::kInt32},
                                                                                          {"vtktypeuint32", SampleType::kUint32},
                                                                                          {"vtktypeint64", SampleType::kInt64},
                                                                                          {"vtktypeuint64", SampleType::kUint64},
                                                                                          {"float", SampleType::kFloat32},
                                                                                          {"double", SampleType::kFloat64}}};
  return SecondOf(kTypeNames, name);
}

constexpr std::string_view kBits = "bit", kTexts = "string";

// Of binary numbers.
std::int64_t BytesOf(const VtkLegacyArray& array) {
  return array.type_name == kBits ? (array.samples() + 7) / 8 : array.samples() * std::int64_t(BytesPerSample(array.type));
}

// VTK writes letters that would end a name as a per cent sign and two hexadecimal digits.
std::string DecodedName(const std::string& text) {
  std::string name;
  for (std::size_t i = 0; i < text.size(); ++i) {
    unsigned letter = 0;
    const char* const digits = text.data() + i + 1;
    if (text[i] == '%' && i + 2 < text.size() && std::from_chars(digits, digits + 2, letter, 16).ptr == digits + 2) {
      name += char(letter);
      i += 2;
    } else {
      name += text[i];
    }
  }
  return name;
}

// Attributes with a fixed number of components.
int ComponentsOf(std::string_view keyword) {
  static constexpr std::array<std::pair<std::string_view, int>, 6> kAttributes = {
      {{"VECTORS", 3}, {"NORMALS", 3}, {"TENSORS", 9}, {"TENSORS6", 6}, {"GLOBAL_IDS", 1}, {"PEDIGREE_IDS", 1}}};
  const auto* const found = std::ranges::find(kAttributes, keyword, [](const auto& entry) { return entry.first; });
  return found == kAttributes.end() ? 0 : found->second;
}

}  // namespace

Result<VtkLegacyFile> VtkLegacyFile::Open(const std::string& path, const std::vector<std::string_view>& kinds) {
  VtkLegacyFile file(path);
  if (!file.cursor_.is_open()) return Status::NotFound(path + ": cannot be opened for reading");
  if (Status status = file.ReadStart(); !status.ok()) return status;
  if (std::ranges::find(kinds, file.kind_) == kinds.end()) {
    return file.Wrong(fmt::format(
        "a VTK dataset of type {}, must be STRUCTURED_POINTS, RECTILINEAR_GRID, STRUCTURED_GRID or UNSTRUCTURED_GRID", file.kind_));
  }
  if (Status status = file.ReadKeywords(); !status.ok()) return status;
  return file;
}

std::optional<std::string> VtkLegacyFile::KindOf(const std::string& path) {
  VtkLegacyFile file(path);
  return file.ReadStart().ok() ? std::optional(file.kind_) : std::nullopt;
}

std::optional<std::string> VtkLegacyFile::Keyword() {
  std::optional<std::string> word = cursor_.Word();
  if (word) std::ranges::transform(*word, word->begin(), [](unsigned char c) { return char(std::toupper(c)); });
  return word;
}

Status VtkLegacyFile::ReadStart() {
  const std::optional<std::string> first = cursor_.Line();
  if (!first || !first->starts_with(kFirstLine)) {
    return Wrong(fmt::format("not a VTK dataset: the first line does not begin with {}", kFirstLine));
  }
  const std::string_view version = std::string_view(*first).substr(kFirstLine.size());
  const std::size_t digit = std::min(version.find_first_not_of(' '), version.size());
  version_ = ParseNumber<int>(version.substr(digit, version.find('.') - digit)).value_or(0);
  if (!cursor_.Line()) return Ended();  // the title
  const std::optional<std::string> encoding = Keyword();
  if (!encoding) return Ended();
  binary_ = *encoding == "BINARY";
  if (!binary_ && *encoding != "ASCII") {
    return Wrong(fmt::format("not a VTK dataset: the third line is '{}', must be ASCII or BINARY", *encoding));
  }
  const std::optional<std::string> dataset = Keyword(), kind = Keyword();
  if (!kind) return Ended();
  if (*dataset != "DATASET") return Wrong(fmt::format("not a VTK dataset: has '{}', must have DATASET", *dataset));
  kind_ = *kind;
  return Status::Ok();
}

Status VtkLegacyFile::ReadKeywords() {
  while (const std::optional<std::string> keyword = Keyword()) {
    if (Status status = OnKeyword(*keyword); !status.ok()) return status;
  }
  return Status::Ok();
}

Status VtkLegacyFile::OnKeyword(const std::string& keyword) {
  if (keyword == "DIMENSIONS" || keyword == "SPACING" || keyword == "ASPECT_RATIO" || keyword == "ORIGIN") return ReadThree(keyword);
  if (keyword == "POINT_DATA" || keyword == "CELL_DATA") return ReadSection(keyword);
  if (keyword == "POINTS") return ReadPlaces(keyword, 3);
  if (keyword.ends_with("_COORDINATES") && keyword.size() == std::string_view("X_COORDINATES").size()) return ReadPlaces(keyword, 1);
  if (keyword == "CELLS" || std::ranges::find(kPolydataCells, keyword) != kPolydataCells.end()) return ReadCells(keyword);
  if (keyword == "CELL_TYPES") {
    const Result<std::int64_t> count = ReadCount(keyword, kMostTuples);
    return count.ok() ? Add({.name = keyword, .type = SampleType::kInt32, .tuples = *count}) : count.status();
  }
  if (keyword == "SCALARS") return ReadScalars();
  if (keyword == "FIELD") return ReadField();
  if (keyword == "LOOKUP_TABLE") return SkipLookupTable();
  if (keyword == "METADATA") return SkipMetadata();
  return ReadAttribute(keyword);
}

Status VtkLegacyFile::ReadThree(const std::string& keyword) {
  Vec3& three = threes_[keyword == "ASPECT_RATIO" ? "SPACING" : keyword];
  for (int i = 0; i < 3; ++i) {
    const std::optional<std::string> word = cursor_.Word();
    if (!word) return Ended();
    const std::optional<double> number = ParseNumber<double>(*word);
    if (!number) return Wrong(fmt::format("{} has '{}', must be three numbers", keyword, *word));
    three[i] = *number;
  }
  return Status::Ok();
}

Status VtkLegacyFile::ReadSection(const std::string& keyword) {
  const Result<std::int64_t> count = ReadCount(keyword, kMostTuples);
  if (!count.ok()) return count.status();
  section_ = keyword;
  elements_ = *count;
  return Status::Ok();
}

Status VtkLegacyFile::ReadPlaces(const std::string& keyword, int components) {
  const Result<std::int64_t> count = ReadCount(keyword, kMostTuples);
  if (!count.ok()) return count.status();
  VtkLegacyArray array{.name = keyword, .components = components, .tuples = *count};
  if (Status status = ReadType(array, keyword); !status.ok()) return status;
  return Add(std::move(array));
}

// Before version 5, each cell's number of points stands in front of them. Since then, there are the places where the cells begin and end
// among the points of all.
Status VtkLegacyFile::ReadCells(const std::string& keyword) {
  const Result<std::int64_t> count = ReadCount(keyword, kMostTuples), numbers = ReadCount(keyword, kMostTuples);
  for (const auto* read : {&count, &numbers}) {
    if (!read->ok()) return read->status();
  }
  constexpr int kVersionOfOffsets = 5;
  cells_ = *count;
  if (version_ < kVersionOfOffsets) return Add({.name = keyword, .type = SampleType::kInt32, .tuples = *numbers});
  cells_ = std::max<std::int64_t>(*count - 1, 0);
  if (Status status = ReadPartOfCells(keyword, "OFFSETS", *count); !status.ok()) return status;
  return ReadPartOfCells(keyword, "CONNECTIVITY", *numbers);
}

Status VtkLegacyFile::ReadPartOfCells(const std::string& cells, const std::string& name, std::int64_t tuples) {
  const std::optional<std::string> keyword = Keyword();
  if (!keyword) return Ended();
  if (*keyword != name) return Wrong(fmt::format("{}: has '{}', must have {}", cells, *keyword, name));
  VtkLegacyArray array{.name = cells == "CELLS" ? name : cells + " " + name, .tuples = tuples};
  if (Status status = ReadType(array, name); !status.ok()) return status;
  return Add(std::move(array));
}

Status VtkLegacyFile::ReadScalars() {
  VtkLegacyArray array{.section = section_, .name = DecodedName(cursor_.Word().value_or("")), .tuples = elements_, .scalars = true};
  if (Status status = ReadType(array, "SCALARS " + array.name); !status.ok()) return status;
  const std::string components = cursor_.Line().value_or("");
  if (const std::size_t digit = components.find_first_not_of(" \t"); digit != std::string::npos) {
    array.components =
        ParseNumber<int>(std::string_view(components).substr(digit, components.find_last_not_of(" \t") - digit + 1)).value_or(0);
    if (array.components < 1 || array.components > 4) {
      return Wrong(fmt::format("SCALARS {} has '{}' components, must be in [1, 4]", array.name, components.substr(digit)));
    }
  }
  if (Keyword() != "LOOKUP_TABLE" || !cursor_.Word()) return Wrong(fmt::format("SCALARS {}: LOOKUP_TABLE is missing", array.name));
  return Add(std::move(array));
}

Status VtkLegacyFile::ReadField() {
  constexpr std::int64_t kMostArrays = 4096;
  if (!cursor_.Word()) return Ended();  // its name
  const Result<std::int64_t> count = ReadCount("FIELD", kMostArrays);
  if (!count.ok()) return count.status();
  for (std::int64_t i = 0; i < *count; ++i) {
    std::optional<std::string> name = cursor_.Word();
    if (name == "METADATA") {  // of the array in front
      if (Status status = SkipMetadata(); !status.ok()) return status;
      name = cursor_.Word();
    }
    // Fields in front of the sections belong to the whole dataset.
    VtkLegacyArray array{.section = section_.empty() ? "FIELD" : section_, .name = DecodedName(name.value_or(""))};
    const Result<std::int64_t> components = ReadCount("FIELD", kMaxComponents), tuples = ReadCount("FIELD", kMostTuples);
    for (const auto* number : {&components, &tuples}) {
      if (!number->ok()) return number->status();
    }
    if (Status status = ReadType(array, fmt::format("array {} of a FIELD", array.name)); !status.ok()) return status;
    array.components = int(*components);
    array.tuples = *tuples;
    if (Status status = Add(std::move(array)); !status.ok()) return status;
  }
  return Status::Ok();
}

Status VtkLegacyFile::ReadAttribute(const std::string& keyword) {
  VtkLegacyArray array{.section = section_, .components = ComponentsOf(keyword), .tuples = elements_};
  const bool colors = keyword == "COLOR_SCALARS", coordinates = keyword == "TEXTURE_COORDINATES";
  if (array.components == 0 && !colors && !coordinates) {
    const std::string behind = arrays_.empty() ? "" : " behind " + arrays_.back().name;
    return Wrong(fmt::format("has '{}'{}, must have a VTK keyword that is supported", keyword, behind));
  }
  array.name = DecodedName(cursor_.Word().value_or(""));
  if (colors || coordinates) {
    const Result<std::int64_t> components = ReadCount(keyword, kMaxComponents);
    if (!components.ok()) return components.status();
    array.components = int(*components);
  }
  array.colors = colors;
  array.scalars = colors && array.components == 1;  // so does VTK write scalars of bytes
  if (!colors) {
    if (Status status = ReadType(array, fmt::format("{} {}", keyword, array.name)); !status.ok()) return status;
  }
  return Add(std::move(array));
}

Status VtkLegacyFile::SkipLookupTable() {
  if (!cursor_.Word()) return Ended();  // its name
  const Result<std::int64_t> colors = ReadCount("LOOKUP_TABLE", kMostTuples);
  if (!colors.ok()) return colors.status();
  if (binary_ && !cursor_.Line()) return Ended();
  return Skip({.type = SampleType::kUint8, .components = 4, .tuples = *colors, .offset = cursor_.offset()});
}

// Up to an empty line.
Status VtkLegacyFile::SkipMetadata() {
  (void)cursor_.Line();
  while (!cursor_.Line().value_or("").empty()) {
  }
  return Status::Ok();
}

Result<std::int64_t> VtkLegacyFile::ReadCount(const std::string& keyword, std::int64_t most) {
  const std::optional<std::string> word = cursor_.Word();
  if (!word) return Ended();
  const std::int64_t count = ParseNumber<std::int64_t>(*word).value_or(-1);
  if (count < 0 || count > most) return Wrong(fmt::format("{} has '{}', must be a whole number in [0, {}]", keyword, *word, most));
  return count;
}

Status VtkLegacyFile::ReadType(VtkLegacyArray& array, const std::string& what) {
  array.type_name = ToLower(cursor_.Word().value_or(""));
  const std::optional<SampleType> known = ToSampleType(array.type_name);
  array.supported = known.has_value();
  if (known) array.type = *known;
  if (known || (!array.section.empty() && (array.type_name == kBits || array.type_name == kTexts))) return Status::Ok();
  return Wrong(fmt::format("{}: type '{}' is not supported", what, array.type_name));
}

Status VtkLegacyFile::Add(VtkLegacyArray array) {
  if ((binary_ || array.type_name == kTexts) && !cursor_.Line()) return Ended();  // what is left of the line in front of the numbers
  array.offset = cursor_.offset();
  if (Status status = array.type_name == kTexts ? SkipTexts(array) : Skip(array); !status.ok()) return status;
  if (array.section.empty() || (array.tuples == elements_ && array.components > 0)) arrays_.push_back(std::move(array));
  return Status::Ok();
}

Status VtkLegacyFile::Skip(const VtkLegacyArray& array) {
  if (binary_) {
    if (Status status = CheckHolds(array); !status.ok()) return status;
    cursor_.GoTo(array.offset + BytesOf(array));
    return Status::Ok();
  }
  for (std::int64_t i = 0; i < array.samples(); ++i) {
    if (!cursor_.Word()) return Damaged(fmt::format("truncated: has {} of {} numbers of {}", i, array.samples(), array.name));
  }
  return Status::Ok();
}

// A line each; binary: each behind its length, whose first two bits say how many bytes it has.
Status VtkLegacyFile::SkipTexts(const VtkLegacyArray& array) {
  for (std::int64_t i = 0; i < array.samples(); ++i) {
    std::optional<char> next = '\n';
    if (binary_) {
      next = cursor_.Next();
      const auto first = std::uint8_t(next.value_or(0));
      const int more = first >> 6 == 3 ? 0 : first >> 6 == 2 ? 1 : first >> 6 == 1 ? 3 : 7;
      std::int64_t length = first & 0x3f;
      for (int byte = 0; byte < more && next && length < kMostTuples; ++byte) {
        next = cursor_.Next();
        length = length << 8 | std::uint8_t(next.value_or(0));
      }
      if (next && length > 0) {  // the last byte of the text is read, so that a text that is cut off is noticed
        cursor_.GoTo(cursor_.offset() + std::min(length, kMostTuples) - 1);
        next = cursor_.Next();
      }
    } else if (!cursor_.Line()) {
      next.reset();
    }
    if (!next) return Damaged(fmt::format("truncated: has {} of {} texts of {}", i, array.samples(), array.name));
  }
  return Status::Ok();
}

OfferedArrays VtkLegacyFile::Offered() const {
  OfferedArrays offered;
  std::array<bool, 2> has_active = {};  // by ValuesAt
  for (std::size_t i = 0; i < arrays_.size(); ++i) {
    const VtkLegacyArray& array = arrays_[i];
    if (array.section.empty()) continue;
    const ValuesAt at = array.section == "POINT_DATA" ? ValuesAt::kPoints : ValuesAt::kCells;
    const bool active = array.scalars && !std::exchange(has_active[std::size_t(at)], true);
    offered.arrays.push_back({.name = array.name,
                              .at = at,
                              .type = array.supported ? std::optional(array.type) : std::nullopt,
                              .type_name = array.type_name,
                              .components = array.components,
                              .active = active});
    offered.numbers.push_back(i);
  }
  return offered;
}

Vec3 VtkLegacyFile::Three(const std::string& keyword, const Vec3& if_absent) const {
  const auto found = threes_.find(keyword);
  return found == threes_.end() ? if_absent : found->second;
}

Result<VtkLegacyArray> VtkLegacyFile::Own(const std::string& name) const {
  const auto found =
      std::ranges::find_if(arrays_, [&](const VtkLegacyArray& array) { return array.section.empty() && array.name == name; });
  if (found == arrays_.end()) return Wrong("has no " + name);
  return *found;
}

Status VtkLegacyFile::CheckHolds(const VtkLegacyArray& array) const {
  // In text, a digit and a blank at least.
  const std::int64_t bytes = binary_ ? BytesOf(array) : 2 * array.samples() - 1;
  return slabstream::CheckHolds({.file = path_, .offset = array.offset}, std::max<std::int64_t>(bytes, 0));
}

Status VtkLegacyFile::ReadSamples(const VtkLegacyArray& array, AlignedVector<std::byte>& out) {
  if (binary_) {
    if (Status status = ReadPayload({.file = path_, .offset = array.offset}, out); !status.ok()) return status;
    SwapByteOrder(array.type, out);
    return Status::Ok();
  }
  cursor_.GoTo(array.offset);
  AlignedVector<std::byte> shares(array.colors ? out.size() * sizeof(float) : 0);
  Status status = array.colors ? ReadTextSamples(cursor_, SampleType::kFloat32, shares) : ReadTextSamples(cursor_, array.type, out);
  if (array.colors && status.ok()) {
    std::ranges::transform(Converted<float>(SampleType::kFloat32, shares), out.begin(),
                           [](float share) { return std::byte(std::lround(255 * std::clamp(share, 0.0F, 1.0F))); });
  }
  return status.ok() ? status : Status(status.code(), path_ + ": " + status.message());
}

}  // namespace slabstream
