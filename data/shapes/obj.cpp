// Wavefront OBJ: vertices (v), perhaps with colours behind them, normals (vn) and polygons (f). Materials, textures, lines and curves are
// left out. A vertex that polygons use with several normals becomes several.
#include <fmt/format.h>

#include <array>
#include <vector>

#include "common/volume/memory_budget.h"
#include "data/shapes/numbered.h"
#include "data/shapes/parsing.h"
#include "data/shapes/shape_formats.h"

namespace slabstream {
namespace {

class ObjReader {
 public:
  ObjReader(std::string_view bytes, ShapeBuilder& builder) : rest_(bytes), builder_(builder) {}

  void Read() {
    // Lines of vertices and of polygons take about as much memory as they have letters.
    builder_.Fail(CheckFitsMemory(std::int64_t(2 * rest_.size()), "the vertices of the file"));
    for (line_ = 1; !rest_.empty() && builder_.ok(); ++line_) ReadLine(TakeLine(rest_));
    if (!colors_.empty()) {
      colors_.resize(places_.size(), {1, 1, 1});
      builder_.Has(kRed);
    }
    if (corners_.keys().empty()) {
      for (std::uint32_t i = 0; i < places_.size(); ++i) AddVertex(i, kNone);
    }
    for (const auto& [place, normal] : corners_.keys()) AddVertex(place, normal);
  }

 private:
  static constexpr std::uint32_t kNone = UINT32_MAX;  // number of a normal
  static constexpr std::uint32_t kMost = 1U << 31;    // of places and normals

  void ReadLine(std::string_view line) {
    if (line.starts_with('#') && SaysLps(line)) builder_.SetLps();
    const std::string_view keyword = TakeWord(line);
    if (keyword == "v") ReadPlace(line);
    if (keyword == "vn") ReadNormal(line);
    if (keyword == "f") ReadPolygon(line);
  }

  void Wrong(std::string_view what, std::string_view word) {
    builder_.Wrong(fmt::format("line {}: has '{}', must be {}", line_, Shortened(word), what));
  }

  std::array<double, 3> Three(std::string_view& words) {
    std::array<double, 3> numbers{};
    for (double& number : numbers) {
      const std::string_view word = TakeWord(words);
      const std::optional<double> read = ToNumber(word);
      if (!read) Wrong("three numbers", word);
      number = read.value_or(0);
    }
    return numbers;
  }

  void ReadPlace(std::string_view words) {
    places_.push_back(Three(words));
    // One number behind the place is a weight, three are a colour.
    std::string_view more = words;
    TakeWord(more);
    if (TakeWord(more).empty()) return;
    const std::array<double, 3> color = Three(words);
    colors_.resize(places_.size() - 1, {1, 1, 1});
    colors_.push_back({float(color[0]), float(color[1]), float(color[2])});
  }

  void ReadNormal(std::string_view words) {
    const std::array<double, 3> normal = Three(words);
    normals_.push_back({float(normal[0]), float(normal[1]), float(normal[2])});
  }

  // "3", "3/4", "3//5" or "3/4/5": numbers of a place, a texture's point and a normal, from 1; or from -1 backwards from the last one.
  void ReadPolygon(std::string_view words) {
    polygon_.clear();
    for (std::string_view word = TakeWord(words); !word.empty(); word = TakeWord(words)) {
      const auto number = [&](std::string_view text, std::size_t count) {
        const std::int64_t read = ToNumber<std::int64_t>(text).value_or(0), at = read < 0 ? std::int64_t(count) + read : read - 1;
        if (read == 0 || at < 0 || at >= kMost) Wrong("a number of a vertex", word);
        return std::uint32_t(at);
      };
      const std::size_t slash = word.find('/'), last = word.rfind('/');
      const bool has_normal = last != slash && last + 1 < word.size();
      const std::uint32_t place = number(word.substr(0, slash), places_.size());
      const std::uint32_t normal = has_normal ? number(word.substr(last + 1), normals_.size()) : kNone;
      if (!builder_.ok()) return;
      polygon_.push_back(corners_.NumberOf({place, normal}));
    }
    builder_.AddPolygon(polygon_);
  }

  void AddVertex(std::uint32_t place, std::uint32_t normal) {
    if (place >= places_.size()) return builder_.Wrong(fmt::format("a polygon has vertex {}, there are {}", place + 1, places_.size()));
    if (normal != kNone && normal >= normals_.size())
      return builder_.Wrong(fmt::format("a polygon has normal {}, there are {}", normal + 1, normals_.size()));
    VertexRow row{};
    std::ranges::copy(places_[place], row.begin() + kX);
    if (!colors_.empty()) std::ranges::copy(colors_[place], row.begin() + kRed);
    if (normal != kNone) {
      std::ranges::copy(normals_[normal], row.begin() + kNormalX);
      builder_.Has(kNormalX);
    }
    builder_.AddVertex(row);
  }

  std::string_view rest_;
  ShapeBuilder& builder_;
  std::size_t line_ = 0;
  std::vector<std::array<double, 3>> places_;
  std::vector<std::array<float, 3>> colors_, normals_;
  Numbered<2> corners_;                // place and normal
  std::vector<std::int64_t> polygon_;  // numbers of corners
};

}  // namespace

void ReadObj(std::string_view bytes, ShapeBuilder& builder) { ObjReader(bytes, builder).Read(); }

}  // namespace slabstream
