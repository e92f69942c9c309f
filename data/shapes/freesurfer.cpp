// Surfaces of FreeSurfer (lh.pial, rh.white, ...): triangles, big endian, in the axes of a volume that FreeSurfer has brought to its own
// ("tkRAS"). Where the file says how that volume lies, its vertices become those of the scanner's space.
#include <fmt/format.h>

#include <array>

#include "data/shapes/parsing.h"
#include "data/shapes/shape_formats.h"
#include "data/volume_io/text_cursor.h"

namespace slabstream {
namespace {

constexpr std::string_view kMagic = "\xff\xff\xfe";

// The volume's axes and its centre in the scanner's space, by lines such as "cras = 1 2 3". FreeSurfer's axes are x against the voxels'
// first axis, y along the third one and z against the second one.
void SetPlace(std::string_view footer, ShapeBuilder& builder) {
  if (footer.find("valid = 1") == std::string_view::npos) return;
  constexpr std::array<std::string_view, 4> kKeys = {"xras", "yras", "zras", "cras"};
  std::array<Vec3, kKeys.size()> found;
  std::size_t count = 0;
  while (!footer.empty()) {
    std::string_view words = TakeLine(footer);
    const auto* const key = std::ranges::find(kKeys, TakeWord(words));
    if (key == kKeys.end() || TakeWord(words) != "=") continue;
    ++count;
    for (const Axis axis : kAxes) {
      const std::string_view word = TakeWord(words);
      if (!ToNumber(word)) return builder.Wrong(fmt::format("{} has '{}', must be three numbers", *key, Shortened(word)));
      found[std::size_t(key - kKeys.begin())][axis] = *ToNumber(word);
    }
  }
  const auto& [x, y, z, centre] = found;
  if (count == kKeys.size()) builder.SetMap({{-x, z, -y}, centre});
}

}  // namespace

bool IsFreeSurfer(const std::string& path) {
  std::array<std::byte, kMagic.size()> start{};
  return TextCursor(path).Read(start) == start.size() && std::ranges::equal(start, BytesOf(kMagic));
}

void ReadFreeSurfer(std::string_view bytes, ShapeBuilder& builder) {
  TakeLine(bytes);  // who has made it, and when
  TakeLine(bytes);
  constexpr std::size_t kCounts = 8, kEach = 12;  // bytes of both counts, and of a vertex or a triangle
  if (bytes.size() < kCounts) return builder.Truncated("the header ends early");
  const BinaryHeader numbers(BytesOf(bytes), true);
  const std::size_t vertices = numbers.At<std::uint32_t>(0), triangles = numbers.At<std::uint32_t>(4);
  const std::size_t end = kCounts + kEach * (vertices + triangles);
  if (end > bytes.size())
    return builder.Truncated(fmt::format("{} vertices and {} triangles need {} bytes, has {}", vertices, triangles, end, bytes.size()));
  SetPlace(bytes.substr(end), builder);
  builder.SetFloats();
  builder.Expect(vertices, triangles);
  std::size_t at = kCounts;
  for (; at < kCounts + kEach * vertices; at += kEach)
    builder.AddVertex({numbers.At<float>(at), numbers.At<float>(at + 4), numbers.At<float>(at + 8)});
  for (; at < end; at += kEach)
    builder.AddTriangle(numbers.At<std::int32_t>(at), numbers.At<std::int32_t>(at + 4), numbers.At<std::int32_t>(at + 8));
}

}  // namespace slabstream
