// PLY, the Polygon File Format (Turk, 1994): text, or binary of either byte order. Vertices with any properties, and faces; what other
// elements hold is left out.
#include <fmt/format.h>

#include <array>
#include <utility>

#include "common/base/second_of.h"
#include "data/shapes/parsing.h"
#include "data/shapes/shape_formats.h"

namespace slabstream {
namespace {

struct Property {
  std::string name;
  SampleType type = SampleType::kFloat32;
  std::optional<SampleType> count;  // of a list
};

struct Element {
  std::string name;
  std::uint64_t count = 0;
  std::vector<Property> properties;
};

std::optional<SampleType> TypeNamed(std::string_view name) {
  constexpr std::array<std::pair<std::string_view, SampleType>, 8> kOldNames = {{{"char", SampleType::kInt8},
                                                                                 {"uchar", SampleType::kUint8},
                                                                                 {"short", SampleType::kInt16},
                                                                                 {"ushort", SampleType::kUint16},
                                                                                 {"int", SampleType::kInt32},
                                                                                 {"uint", SampleType::kUint32},
                                                                                 {"float", SampleType::kFloat32},
                                                                                 {"double", SampleType::kFloat64}}};
  const std::optional<SampleType> found = SecondOf(kOldNames, name);
  return found ? found : SampleTypeNamed(name);
}

class PlyReader {
 public:
  PlyReader(std::string_view bytes, ShapeBuilder& builder) : rest_(bytes), builder_(builder) {}

  void Read() {
    ReadHeader();
    for (const Element& element : elements_) {
      if (element.name == "vertex") BeginVertices(element);
      // Elements without properties have no bytes, however many there are.
      for (std::uint64_t i = 0; i < element.count && !element.properties.empty() && builder_.ok(); ++i) {
        ReadRow(element);
        if (ended_) builder_.Truncated(fmt::format("has {} of {} {}", i, element.count, Shortened(element.name)));
      }
    }
  }

 private:
  void ReadHeader() {
    if (TakeLine(rest_) != "ply") return builder_.Wrong("not a PLY file: the first line is not ply");
    while (builder_.ok()) {
      if (rest_.empty()) return builder_.Truncated("the header has no end_header");
      const std::string_view line = TakeLine(rest_);
      std::string_view words = line;
      const std::string_view keyword = TakeWord(words);
      if (keyword == "end_header") return;
      if (keyword == "format") ReadFormat(TakeWord(words));
      if (keyword == "comment" && SaysLps(line)) builder_.SetLps();
      if (keyword == "element") {
        const std::string_view name = TakeWord(words), count = TakeWord(words);
        elements_.push_back({std::string(name), ParseNumber<std::uint64_t>(count).value_or(0), {}});
        if (!ParseNumber<std::uint64_t>(count))
          builder_.Wrong(fmt::format("element {} has '{}', must be a whole number", Shortened(name), Shortened(count)));
      } else if (keyword == "property") {
        ReadProperty(words);
      }
    }
  }

  void ReadFormat(std::string_view format) {
    text_ = format == "ascii";
    swapped_ = format == "binary_big_endian";
    if (!text_ && !swapped_ && format != "binary_little_endian")
      builder_.Wrong(fmt::format("format is '{}', must be ascii, binary_little_endian or binary_big_endian", Shortened(format)));
  }

  void ReadProperty(std::string_view words) {
    if (elements_.empty()) return builder_.Wrong("a property stands before the first element");
    const auto type = [&] {
      const std::string_view name = TakeWord(words);
      const std::optional<SampleType> found = TypeNamed(name);
      if (!found)
        builder_.Wrong(fmt::format("a property of element {} has type '{}', must be char, uchar, short, ushort, int, uint, float or double",
                                   Shortened(elements_.back().name), Shortened(name)));
      return found.value_or(SampleType::kInt8);
    };
    Property property;
    if (words.find("list") == words.find_first_not_of(" \t")) {
      TakeWord(words);
      property.count = type();
    }
    property.type = type();
    property.name = TakeWord(words);
    elements_.back().properties.push_back(std::move(property));
  }

  void BeginVertices(const Element& element) {
    std::vector<std::string> names;
    std::vector<const Property*> single;
    for (const Property& property : element.properties) {
      if (!property.count && property.name.starts_with("scalar_")) {
        names.emplace_back("scalar");  // as CloudCompare names it
      } else {
        names.push_back(property.count ? "" : property.name);
      }
    }
    const NamedColumns columns = FindColumns(names);
    if (!columns[kX] || !columns[kY] || !columns[kZ]) return builder_.Wrong("element vertex must have the properties x, y and z");
    const auto type = [&](VertexColumn column) { return element.properties[*columns[column]].type; };
    builder_.Has(columns);
    if (type(kX) == SampleType::kFloat32) builder_.SetFloats();
    if (columns[kRed])
      builder_.SetFullChannel(type(kRed) == SampleType::kUint16                                          ? 65535
                              : type(kRed) == SampleType::kFloat32 || type(kRed) == SampleType::kFloat64 ? 1
                                                                                                         : 255);
    column_of_.assign(names.size(), kVertexColumns);
    for (std::size_t column = 0; column < kVertexColumns; ++column) {
      if (columns[column]) column_of_[*columns[column]] = column;
    }
    if (element.count > rest_.size()) return builder_.Truncated(fmt::format("has {} vertices in {} bytes", element.count, rest_.size()));
    builder_.Expect(element.count, 0);
  }

  void ReadRow(const Element& element) {
    const bool vertex = element.name == "vertex", face = element.name == "face";
    VertexRow row{};
    for (std::size_t i = 0; i < element.properties.size(); ++i) {
      const Property& property = element.properties[i];
      const std::int64_t count = property.count ? ToWhole(Next(*property.count)) : 1;
      if (property.count && !ended_ && (count < 0 || count > std::int64_t(rest_.size())))
        builder_.Wrong(fmt::format("a list of {} has {} numbers", element.name, count));
      list_.clear();
      double read = 0;
      for (std::int64_t n = 0; n < count && !ended_ && builder_.ok(); ++n) {
        read = Next(property.type);
        if (property.count) list_.push_back(ToWhole(read));
      }
      if (ended_ || !builder_.ok()) return;
      if (vertex && column_of_[i] < kVertexColumns) row[column_of_[i]] = read;
      if (face && property.count && property.name.starts_with("vertex_ind")) builder_.AddPolygon(list_);
    }
    if (vertex) builder_.AddVertex(row);
  }

  double Next(SampleType type) {
    if (text_) {
      const std::string_view word = TakeWord(rest_);
      const std::optional<double> number = ToNumber(word);
      ended_ = word.empty();
      if (!number && !ended_) builder_.Wrong(fmt::format("has '{}', must be a number", Shortened(word)));
      return number.value_or(0);
    }
    const std::size_t bytes = BytesPerSample(type);
    ended_ = bytes > rest_.size();
    if (ended_) return 0;
    const double number = NumberAt({BytesOf(rest_), swapped_}, type, 0);
    rest_.remove_prefix(bytes);
    return number;
  }

  std::string_view rest_;
  ShapeBuilder& builder_;
  bool text_ = false, swapped_ = false;
  bool ended_ = false;  // there were no more numbers
  std::vector<Element> elements_;
  std::vector<std::size_t> column_of_;  // of each property of a vertex; kVertexColumns: none
  std::vector<std::int64_t> list_;
};

}  // namespace

void ReadPly(std::string_view bytes, ShapeBuilder& builder) { PlyReader(bytes, builder).Read(); }

}  // namespace slabstream
