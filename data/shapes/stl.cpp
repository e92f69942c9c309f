// STL (3D Systems, 1988): triangles with their corners, binary or as text. Corners at the same place become one vertex, so that the surface
// can be shaded smoothly. Normals of triangles are left out, since the corners say the same.
#include <fmt/format.h>

#include <array>
#include <bit>
#include <vector>

#include "data/shapes/numbered.h"
#include "data/shapes/parsing.h"
#include "data/shapes/shape_formats.h"
#include "data/volume_io/text_header.h"

namespace slabstream {
namespace {

constexpr std::size_t kHeader = 80, kCount = 4, kTriangle = 50, kNormal = 12;  // bytes
constexpr std::string_view kSolid = "solid";

class StlReader {
 public:
  explicit StlReader(ShapeBuilder& builder) : builder_(builder) { builder_.SetFloats(); }

  void ReadBinary(std::string_view bytes) {
    if (bytes.size() < kHeader + kCount)
      return builder_.Truncated(fmt::format("has {} bytes, a binary STL file 84 at least", bytes.size()));
    const auto count = BinaryHeader(BytesOf(bytes), false).At<std::uint32_t>(kHeader);
    if (count > (bytes.size() - kHeader - kCount) / kTriangle) {
      return builder_.Truncated(fmt::format("a binary STL file of {} triangles has {} bytes, this one {}", count,
                                            kHeader + kCount + kTriangle * count, bytes.size()));
    }
    builder_.Expect(0, count);
    const BinaryHeader numbers(BytesOf(bytes), false);
    for (std::size_t i = 0; i < count; ++i) {
      for (std::size_t corner = 0; corner < 3; ++corner) {
        const std::size_t at = kHeader + kCount + kTriangle * i + kNormal * (corner + 1);
        corners_.push_back(Vertex({numbers.At<float>(at), numbers.At<float>(at + 4), numbers.At<float>(at + 8)}));
      }
      EndTriangle();
    }
  }

  void ReadText(std::string_view rest) {
    TakeLine(rest);
    bool ended = false;
    for (std::string_view word = TakeWord(rest); !word.empty() && builder_.ok(); word = TakeWord(rest)) {
      const std::string keyword = ToLower(std::string(Shortened(word)));
      ended = keyword == "endsolid";
      if (ended || keyword == kSolid) TakeLine(rest);  // its name
      if (keyword == "endloop") EndTriangle();
      if (keyword != "vertex") continue;
      std::array<float, 3> place{};
      for (float& coordinate : place) {
        const std::string_view number = TakeWord(rest);
        if (!ToNumber(number)) builder_.Wrong(fmt::format("vertex {} has '{}', must be a number", all_, Shortened(number)));
        coordinate = float(ToNumber(number).value_or(0));
      }
      corners_.push_back(Vertex(place));
      ++all_;
    }
    if (!ended) builder_.Truncated("the last word is not endsolid");
  }

 private:
  std::int64_t Vertex(std::array<float, 3> place) {
    for (float& coordinate : place) coordinate += 0.0F;  // -0 becomes 0
    const std::uint32_t number = vertices_.NumberOf(std::bit_cast<std::array<std::uint32_t, 3>>(place));
    if (number == builder_.vertices()) builder_.AddVertex({place[0], place[1], place[2]});
    return number;
  }

  void EndTriangle() {
    if (corners_.size() != 3) builder_.Wrong(fmt::format("triangle {} has {} corners", builder_.triangles(), corners_.size()));
    builder_.AddPolygon(corners_);
    corners_.clear();
  }

  ShapeBuilder& builder_;
  Numbered<3> vertices_;
  std::vector<std::int64_t> corners_;  // of the triangle that is read
  std::size_t all_ = 0;                // vertices of a text
};

}  // namespace

// The header of a binary file may begin as a text does, but the number of its bytes tells.
void ReadStl(std::string_view bytes, ShapeBuilder& builder) {
  const bool solid = bytes.starts_with(kSolid),
             counted = bytes.size() >= kHeader + kCount &&
                       bytes.size() - kHeader - kCount == kTriangle * BinaryHeader(BytesOf(bytes), false).At<std::uint32_t>(kHeader);
  std::string_view rest = bytes;
  if (SaysLps(solid && !counted ? TakeLine(rest) : bytes.substr(0, kHeader))) builder.SetLps();
  StlReader reader(builder);
  solid && !counted ? reader.ReadText(bytes) : reader.ReadBinary(bytes);
}

}  // namespace slabstream
