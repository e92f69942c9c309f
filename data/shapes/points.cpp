// Points in tables: text with commas, semicolons, tabs or blanks between its columns (.csv, .tsv, and .fcsv of 3D Slicer), and arrays of
// NumPy (.npy).
#include <fmt/format.h>

#include <algorithm>
#include <string>
#include <vector>

#include "common/memory/aligned_buffer.h"
#include "common/text/split.h"
#include "common/volume/memory_budget.h"
#include "data/shapes/parsing.h"
#include "data/shapes/shape_formats.h"
#include "data/volume_io/npy_header.h"
#include "data/volume_io/payload.h"
#include "data/volume_io/text_header.h"

namespace slabstream {
namespace {

class TableReader {
 public:
  TableReader(std::string_view bytes, ShapeBuilder& builder) : rest_(bytes), builder_(builder) {}

  void Read() {
    constexpr std::string_view kMark = "\xef\xbb\xbf";  // in front of UTF-8
    if (rest_.starts_with(kMark)) rest_.remove_prefix(kMark.size());
    for (std::size_t number = 1; !rest_.empty() && builder_.ok(); ++number) {
      const std::string_view line = TakeLine(rest_);
      if (line.starts_with('#') || line.starts_with("//")) {
        ReadComment(line);
      } else if (!line.empty()) {
        ReadLine(line, number);
      }
    }
  }

 private:
  // 3D Slicer writes "# columns = id,x,y,z" and "# CoordinateSystem = LPS", or 1 for it; others "# x y z" or "//X Y Z".
  void ReadComment(std::string_view line) {
    const std::size_t equals = line.find('=');
    const std::string_view value = equals == std::string_view::npos ? "" : Trimmed(line.substr(equals + 1));
    if (line.find("CoordinateSystem") != std::string_view::npos && (value == "LPS" || value == "1")) builder_.SetLps();
    line.remove_prefix(equals != std::string_view::npos ? equals + 1 : std::min(line.find_first_not_of("#/ \t"), line.size()));
    if (!columns_[kX] && !TakeNames(line)) separator_ = ' ';
  }

  // Whether they name the places at least.
  bool TakeNames(std::string_view line) {
    std::vector<std::string> names;
    SplitLine(line);
    for (std::string_view field : fields_) {
      if (field.size() > 1 && field.starts_with('"') && field.ends_with('"')) field = field.substr(1, field.size() - 2);
      names.emplace_back(field);
    }
    columns_ = FindColumns(names);
    if (!columns_[kX] || !columns_[kY] || !columns_[kZ]) columns_ = {};
    builder_.Has(columns_);
    return columns_[kX].has_value();
  }

  void ReadLine(std::string_view line, std::size_t number) {
    if (!columns_[kX]) {
      SplitLine(line);
      const auto is_number = [](std::string_view field) { return ToNumber(field).has_value(); };
      if (TakeNames(line)) return;
      columns_[kX] = 0;
      columns_[kY] = 1;
      columns_[kZ] = 2;
      // Names of other columns.
      if (!std::ranges::any_of(fields_, is_number)) return;
    }
    SplitLine(line);
    VertexRow row{};
    for (std::size_t column = 0; column < kVertexColumns; ++column) {
      if (!columns_[column]) continue;
      const std::string_view field = *columns_[column] < fields_.size() ? fields_[*columns_[column]] : std::string_view();
      const std::optional<double> read = ToNumber(column == kValue && field.empty() ? "nan" : field);
      if (!read)
        return builder_.Wrong(fmt::format("line {}: column {} is '{}', must be a number", number, *columns_[column] + 1, Shortened(field)));
      row[column] = *read;
    }
    builder_.AddVertex(row);
  }

  // The separator of the first line holds for all.
  void SplitLine(std::string_view line) {
    for (const char separator : {'\t', ';', ','}) {
      if (!columns_[kX] && separator_ == ' ' && line.find(separator) != std::string_view::npos) separator_ = separator;
    }
    fields_.clear();
    if (separator_ == ' ') {
      for (std::string_view word = TakeWord(line); !word.empty(); word = TakeWord(line)) fields_.push_back(word);
    } else {
      for (const std::string_view field : Split(line, separator_)) fields_.push_back(Trimmed(field));
    }
  }

  std::string_view rest_;
  ShapeBuilder& builder_;
  char separator_ = ' ';
  std::vector<std::string_view> fields_;  // of the line that is read
  NamedColumns columns_;
};

}  // namespace

void ReadTable(std::string_view bytes, ShapeBuilder& builder) { TableReader(bytes, builder).Read(); }

bool IsNpyOfPoints(const std::string& path) {
  const Result<NpyHeader> header = ReadNpyHeader(path);
  return header.ok() && header->shape.size() == 2 && (header->shape[1] == 3 || header->shape[1] == 4);
}

void ReadNpyOfPoints(const std::string& path, ShapeBuilder& builder) {
  const Result<NpyHeader> header = ReadNpyHeader(path);
  if (!header.ok()) return builder.Fail(header.status());
  if (!(header->shape[0] >= 0 && header->shape[0] <= kMaxShapeVertices))
    return builder.Wrong(fmt::format("has {} points, limit {}", header->shape[0], kMaxShapeVertices));
  const auto rows = std::size_t(header->shape[0]), columns = std::size_t(header->shape[1]), each = BytesPerSample(header->type);
  const Payload payload{.file = path, .offset = header->end};
  const auto size = std::int64_t(rows * columns * each);
  builder.Fail(CheckHolds(payload, size));
  builder.Fail(CheckFitsMemory(size, "the file"));
  if (columns == 4) builder.Has(kRadius);
  builder.Expect(rows, 0);
  if (!builder.ok()) return;
  if (header->type == SampleType::kFloat32) builder.SetFloats();
  AlignedVector<std::byte> bytes(rows * columns * each);
  builder.Fail(ReadPayload(payload, bytes));
  const BinaryHeader numbers(bytes, header->big_endian);
  for (std::size_t i = 0; i < rows; ++i) {
    const auto number = [&](std::size_t column) {
      return NumberAt(numbers, header->type, each * (header->fortran ? column * rows + i : i * columns + column));
    };
    VertexRow row = {number(0), number(1), number(2)};
    if (columns == 4) row[kRadius] = number(3);
    builder.AddVertex(row);
  }
}

}  // namespace slabstream
