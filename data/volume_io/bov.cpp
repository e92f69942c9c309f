// Bricks of values (.bov): a text header, and the samples of one variable in a file of their own. Source: VisIt's user manual, "The BOV
// file format"; what it leaves open is as VisIt's reader takes it (databases/BOV/avtBOVFileFormat.C).
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <string_view>
#include <utility>

#include "common/base/second_of.h"
#include "common/text/parse_number.h"
#include "data/volume_io/formats.h"
#include "data/volume_io/structured_grid.h"
#include "data/volume_io/text_header.h"

namespace slabstream {
namespace {

constexpr std::array<std::pair<std::string_view, SampleType>, 7> kTypes = {{{"byte", SampleType::kUint8},
                                                                            {"char", SampleType::kUint8},
                                                                            {"short", SampleType::kInt16},
                                                                            {"int", SampleType::kInt32},
                                                                            {"float", SampleType::kFloat32},
                                                                            {"real", SampleType::kFloat32},
                                                                            {"double", SampleType::kFloat64}}};

// In lower case, without quotes.
std::string Word(const TextHeader& text, const char* key, const char* otherwise = "") {
  std::string word = ToLower(text.Find(key).value_or(otherwise));
  std::erase(word, '"');
  return word;
}

// One of two words; the first one if there is none.
Result<bool> IsSecond(const TextHeader& text, const char* key, const std::string& first, const std::string& second) {
  const std::string word = Word(text, key, first.c_str());
  if (word == first || word == second) return word == second;
  return text.NotAVolume(fmt::format("{} is '{}', must be {} or {}", key, word, first, second));
}

Result<RawHeader> ReadHeader(const TextHeader& text, const ReadOptions&) {
  RawHeader header;
  const auto sizes = text.Numbers({"data_size"}, 3, {}), origin = text.Numbers({"brick_origin"}, 3, {0, 0, 0}),
             lengths = text.Numbers({"brick_size"}, 3, {1, 1, 1});
  for (const auto* numbers : {&sizes, &origin, &lengths}) {
    if (!numbers->ok()) return numbers->status();
  }
  const std::string type = Word(text, "data_format", "byte"), components = Word(text, "data_components", "1");
  const std::optional<SampleType> named = SecondOf(kTypes, type);
  if (!named) return text.NotAVolume(fmt::format("DATA_FORMAT is '{}', must be BYTE, SHORT, INT, FLOAT or DOUBLE", type));
  header.type = *named;
  header.components = components == "complex" ? 2 : ParseNumber<int>(components).value_or(0);
  if (header.components < 1 || header.components > kMaxComponents) {
    return text.NotAVolume(fmt::format("DATA_COMPONENTS is '{}', must be in [1, {}]", components, kMaxComponents));
  }
  const Result<bool> cells = IsSecond(text, "centering", "nodal", "zonal");
  if (!cells.ok()) return cells.status();
  PointGrid grid{.origin = Triple(*origin), .matrix = "BRICK_SIZE"};
  for (int axis = 0; axis < 3; ++axis) {
    const auto i = std::size_t(axis);
    const double size = (*sizes)[i];
    grid.points[i] = *cells && size > 1 ? size + 1 : size;
    Vec3 step;
    step[axis] = (*lengths)[i] / std::max(grid.points[i] - 1, 1.0);
    grid.steps[i] = step;
  }
  if (Status status = SetGrid(header, text.path, grid, *cells ? ValuesAt::kCells : ValuesAt::kPoints); !status.ok()) return status;
  return header;
}

Result<TextPayload> ReadPayload(const TextHeader& text) {
  const std::string file = *text.Find("data_file");
  if (file.find('%') != std::string::npos) {
    return text.Refused(fmt::format("its samples lie in several files, {}, which is not supported", file));
  }
  const Result<bool> big_endian = IsSecond(text, "data_endian", "little", "big");
  if (!big_endian.ok()) return big_endian.status();
  return TextPayload{.file = file,
                     .compression = ToLower(file).ends_with(".gz") ? Compression::kDeflate : Compression::kNone,
                     .big_endian = *big_endian,
                     .bytes_key = "BYTE_OFFSET",
                     .bytes = Word(text, "byte_offset", "0")};
}

Result<LocatedSamples> Locate(const std::string& path, const ReadOptions& options) {
  return LocateInTextVolume(path,
                            {.name = "BOV",
                             .separators = ":",
                             .ignores_case = true,
                             .header_alone = true,
                             .required = {"data_file", "data_size"},
                             .read_header = ReadHeader,
                             .read_payload = ReadPayload},
                            options);
}

}  // namespace

VolumeFormat Bov() { return {.name = "BOV", .endings = {".bov"}, .options = {"channel"}, .locate = Locate}; }

}  // namespace slabstream
