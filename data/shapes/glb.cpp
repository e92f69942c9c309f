// glTF 2.0, binary (.glb): the triangles, strips and fans of all nodes of its scene, where the matrices of the nodes place them. Materials,
// textures, lines, skins and morph targets are left out.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <utility>
#include <vector>

#include "common/json/json.h"
#include "data/shapes/parsing.h"
#include "data/shapes/shape_formats.h"

namespace slabstream {
namespace {

constexpr std::int64_t kAbsent = -1, kNotWhole = -2;

// A whole number in an object.
std::int64_t Whole(const Json& object, std::string_view name, std::int64_t if_absent = kAbsent) {
  const Json* const found = object.find(name);
  if (found == nullptr) return if_absent;
  const std::int64_t number = found->is_number() ? ToWhole(found->get<double>()) : kNotWhole;
  return number < 0 ? kNotWhole : number;
}

// Numbers of one accessor, row by row.
struct Accessor {
  BinaryHeader bytes = {{}, false};
  SampleType type = SampleType::kFloat32;
  std::size_t count = 0, components = 0, stride = 0;  // bytes from row to row
  bool normalized = false;

  double At(std::size_t row, std::size_t component) const {
    const double number = NumberAt(bytes, type, row * stride + component * BytesPerSample(type));
    return normalized ? number / Full() : number;
  }
  double Full() const {
    return type == SampleType::kInt8     ? INT8_MAX
           : type == SampleType::kUint8  ? UINT8_MAX
           : type == SampleType::kInt16  ? INT16_MAX
           : type == SampleType::kUint16 ? UINT16_MAX
                                         : 1;
  }
};

AffineMap Product(const AffineMap& a, const AffineMap& b) {
  AffineMap product;
  product.offset = a.To(b.offset);
  for (std::size_t i = 0; i < 3; ++i) product.steps[i] = a.To(b.steps[i]) - a.offset;
  return product;
}

// A primitive of a mesh as a node shows it.
struct Shown {
  const Json* primitive;
  AffineMap map;
};

constexpr std::size_t kMostShown = 1 << 20, kMostJson = std::size_t{64} << 20;  // primitives; bytes

enum Mode : std::int64_t { kPoints = 0, kTriangles = 4, kStrip = 5, kFan = 6 };

class GlbReader {
 public:
  GlbReader(std::string_view bytes, ShapeBuilder& builder) : bytes_(bytes), builder_(builder) {}

  void Read() {
    ReadChunks();
    if (const Json* const required = json_.find("extensionsRequired"); required != nullptr) {
      for (const Json& each : *required) {
        const std::string name = each.is_string() ? each.text() : "";
        // Those change numbers' types, or what is left out.
        const bool known = name == "KHR_mesh_quantization" || name.starts_with("KHR_materials_") || name.starts_with("KHR_texture_") ||
                           name.starts_with("EXT_texture_");
        if (!known) return builder_.Wrong(fmt::format("requires the extension '{}', which is not supported", Shortened(name)));
      }
    }
    if (builder_.ok()) ReadScene();
    // What many nodes show counts as often.
    std::uint64_t vertices = 0, triangles = 0;
    for (const Shown& shown : shown_) {
      const std::int64_t indices = Whole(*shown.primitive, "indices");
      const Accessor places = Attribute(*shown.primitive, "POSITION", {3});
      vertices += places.count;
      const std::size_t corners = indices == kAbsent ? places.count : Numbers(indices, {1}).count;
      triangles += Whole(*shown.primitive, "mode", kTriangles) == kTriangles ? corners / 3 : corners;
    }
    builder_.Expect(vertices, triangles);
    for (const Shown& shown : shown_) {
      if (builder_.ok()) Add(shown);
    }
  }

 private:
  void ReadChunks() {
    constexpr std::size_t kHeader = 12, kChunk = 8;
    const BinaryHeader numbers(BytesOf(bytes_), false);
    if (!bytes_.starts_with("glTF") || bytes_.size() < kHeader + kChunk) return builder_.Wrong("not a binary glTF file");
    if (const auto version = numbers.At<std::uint32_t>(4); version != 2)
      return builder_.Wrong(fmt::format("version of glTF is {}, must be 2", version));
    constexpr std::array<std::string_view, 2> kTypes = {"JSON", {"BIN\0", 4}};
    std::array<std::string_view, 2> chunks;
    for (std::size_t at = kHeader; at + kChunk <= bytes_.size();) {
      const std::size_t size = numbers.At<std::uint32_t>(at);
      const auto* const type = std::ranges::find(kTypes, bytes_.substr(at + 4, 4));
      at += kChunk;
      if (size > bytes_.size() - at) return builder_.Truncated(fmt::format("a chunk has {} bytes, {} are left", size, bytes_.size() - at));
      if (type != kTypes.end()) chunks[std::size_t(type - kTypes.begin())] = bytes_.substr(at, size);
      at += size;
    }
    if (chunks[0].size() > kMostJson) return builder_.Wrong(fmt::format("its JSON has {} bytes, limit {}", chunks[0].size(), kMostJson));
    Result<Json> json = Json::Parse(chunks[0]);
    if (!json.ok()) return builder_.Fail(json.status());
    json_ = *std::move(json);
    binary_ = chunks[1];
  }

  // An element of one of the lists; null, which has no members: there is none.
  const Json& Element(std::string_view list, std::int64_t number) {
    static const Json none;
    const Json* const all = json_.find(list);
    if (all != nullptr && number >= 0 && std::size_t(number) < std::size_t(all->end() - all->begin())) return all->begin()[number];
    builder_.Wrong(fmt::format("has {} {}, must be in [0, {})", list, number, all == nullptr ? 0 : all->end() - all->begin()));
    return none;
  }

  void ReadScene() {
    const Json* const nodes = json_.find("nodes");
    parents_.assign(nodes == nullptr ? 0 : nodes->size(), 0);
    const std::int64_t scene = Whole(json_, "scene", 0);
    if (json_.contains("scenes")) {
      ShowNodes(Element("scenes", scene).find("nodes"), {});
    } else if (const Json* const meshes = json_.find("meshes"); meshes != nullptr) {
      for (const Json& mesh : *meshes) ShowMesh(mesh, {});
    }
  }

  // A stack, since nodes may be as deep as the file is long.
  void ShowNodes(const Json* numbers, const AffineMap& map) {
    std::vector<std::pair<const Json*, AffineMap>> open = {{numbers, map}};
    while (!open.empty() && builder_.ok()) {
      const auto [list, to_world] = open.back();
      open.pop_back();
      if (list == nullptr) continue;
      for (const Json& number : *list) {
        const std::int64_t at = number.is_number() ? ToWhole(number.get<double>()) : kNotWhole;
        const Json& node = Element("nodes", at);
        if (!builder_.ok()) return;
        if (++parents_[std::size_t(at)] > 1) return builder_.Wrong(fmt::format("node {} has more than one parent", at));
        const AffineMap place = Product(to_world, PlaceOf(node));
        if (const std::int64_t mesh = Whole(node, "mesh"); mesh != kAbsent) ShowMesh(Element("meshes", mesh), place);
        open.emplace_back(node.find("children"), place);
      }
    }
  }

  void ShowMesh(const Json& mesh, const AffineMap& map) {
    const Json* const primitives = mesh.find("primitives");
    if (primitives == nullptr) return;
    for (const Json& primitive : *primitives) {
      const std::int64_t mode = Whole(primitive, "mode", kTriangles);
      if (mode != kPoints && (mode < kTriangles || mode > kFan)) continue;
      if (shown_.size() == kMostShown) return builder_.Wrong(fmt::format("its nodes show more than {} primitives", kMostShown));
      shown_.push_back({&primitive, map});
    }
  }

  // The numbers of an array, or those that it has by default.
  template <std::size_t kCount>
  std::array<double, kCount> Numbers(const Json& node, std::string_view name, std::array<double, kCount> numbers) {
    const Json* const found = node.find(name);
    if (found == nullptr) return numbers;
    const bool all = found->is_array() && found->size() == kCount &&
                     std::all_of(found->begin(), found->end(), [](const Json& each) { return each.is_number(); });
    if (!all) builder_.Wrong(fmt::format("{} of a node must be {} numbers", name, kCount));
    for (std::size_t i = 0; all && i < kCount; ++i) numbers[i] = found->at(i).get<double>();
    return numbers;
  }

  AffineMap PlaceOf(const Json& node) {
    const auto m = Numbers<16>(node, "matrix", {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1});  // column by column
    const AffineMap matrix = {{Vec3{m[0], m[1], m[2]}, Vec3{m[4], m[5], m[6]}, Vec3{m[8], m[9], m[10]}}, {m[12], m[13], m[14]}};
    const auto t = Numbers<3>(node, "translation", {}), s = Numbers<3>(node, "scale", {1, 1, 1});
    const auto [x, y, z, w] = Numbers<4>(node, "rotation", {0, 0, 0, 1});  // a unit quaternion
    const AffineMap moved = {{s[0] * Vec3{1 - 2 * (y * y + z * z), 2 * (x * y + z * w), 2 * (x * z - y * w)},
                              s[1] * Vec3{2 * (x * y - z * w), 1 - 2 * (x * x + z * z), 2 * (y * z + x * w)},
                              s[2] * Vec3{2 * (x * z + y * w), 2 * (y * z - x * w), 1 - 2 * (x * x + y * y)}},
                             {t[0], t[1], t[2]}};
    return Product(matrix, moved);  // a node has the one or the other
  }

  // An accessor, of which all rows lie in the file. Its rows have one of these numbers of components.
  Accessor Numbers(std::int64_t number, std::initializer_list<std::size_t> components) {
    const Json& json = Element("accessors", number);
    if (!builder_.ok()) return {};
    constexpr std::array<std::pair<std::int64_t, SampleType>, 6> kTypes = {{{5120, SampleType::kInt8},
                                                                            {5121, SampleType::kUint8},
                                                                            {5122, SampleType::kInt16},
                                                                            {5123, SampleType::kUint16},
                                                                            {5125, SampleType::kUint32},
                                                                            {5126, SampleType::kFloat32}}};
    constexpr std::array<std::string_view, 4> kShapes = {"SCALAR", "VEC2", "VEC3", "VEC4"};
    const auto wrong = [&](std::string_view why) {
      builder_.Wrong(fmt::format("accessor {}: {}", number, why));
      return Accessor();
    };
    if (json.contains("sparse")) return wrong("sparse ones are not supported");
    const auto* const type = std::ranges::find(kTypes, Whole(json, "componentType"), [](const auto& each) { return each.first; });
    if (type == kTypes.end())
      return wrong(fmt::format("componentType is {}, must be 5120 to 5126, not 5124", Whole(json, "componentType")));
    const Json* const shape = json.find("type");
    const auto* const found = std::ranges::find(kShapes, shape != nullptr && shape->is_string() ? shape->text() : "");
    Accessor accessor{.type = type->second, .components = std::size_t(found - kShapes.begin()) + 1};
    if (std::ranges::find(components, accessor.components) == components.end()) return wrong("its type has another number of components");
    const Json* const normalized = json.find("normalized");
    accessor.normalized = normalized != nullptr && *normalized == Json(true);
    if (!json.contains("bufferView")) return wrong("has no bufferView");
    const Json& view = Element("bufferViews", Whole(json, "bufferView"));
    if (!builder_.ok()) return {};
    if (Whole(view, "buffer") != 0 || Element("buffers", 0).contains("uri")) return wrong("its numbers are not in the file");
    const std::size_t row = accessor.components * BytesPerSample(accessor.type);
    const std::int64_t count = Whole(json, "count"), begin = Whole(view, "byteOffset", 0), in_view = Whole(json, "byteOffset", 0),
                       length = Whole(view, "byteLength"), stride = Whole(view, "byteStride", std::int64_t(row));
    constexpr std::int64_t kMostStride = 252;
    const auto size = std::int64_t(binary_.size());
    if (begin < 0 || begin > size || length < 0 || length > size - begin)
      return wrong(fmt::format("its bufferView has bytes from {} on, {} in all, of {}", begin, length, size));
    if (stride < std::int64_t(row) || (stride > kMostStride && stride != std::int64_t(row)))
      return wrong(fmt::format("byteStride is {}, must be in [{}, {}]", stride, row, kMostStride));
    if (count < 0 || in_view < 0 || in_view > length || (count > 0 && (length - in_view - std::int64_t(row) + stride) / stride < count))
      return wrong(fmt::format("{} rows of {} bytes from byte {} on do not fit its bufferView of {} bytes", count, row, in_view, length));
    accessor.bytes = BinaryHeader(BytesOf(binary_.substr(std::size_t(begin + in_view), std::size_t(length - in_view))), false);
    accessor.count = std::size_t(count);
    accessor.stride = std::size_t(stride);
    return accessor;
  }

  // Without rows: there is none.
  Accessor Attribute(const Json& primitive, std::string_view name, std::initializer_list<std::size_t> components) {
    const Json* const attributes = primitive.find("attributes");
    const std::int64_t number = attributes == nullptr ? kAbsent : Whole(*attributes, name);
    return number == kAbsent ? Accessor() : Numbers(number, components);
  }

  void Add(const Shown& shown) {
    const Accessor places = Attribute(*shown.primitive, "POSITION", {3});
    const Accessor normals = Attribute(*shown.primitive, "NORMAL", {3}), colors = Attribute(*shown.primitive, "COLOR_0", {3, 4});
    for (const Accessor& each : {normals, colors}) {
      if (each.count != 0 && each.count != places.count)
        builder_.Wrong(fmt::format("a primitive has {} positions and {} normals or colours", places.count, each.count));
    }
    if (!builder_.ok()) return;
    const auto base = std::int64_t(builder_.vertices());
    builder_.SetMap(shown.map);
    builder_.SetFullChannel(1);
    builder_.HasOnlyPlaces();
    if (normals.count > 0) builder_.Has(kNormalX);
    if (colors.count > 0) builder_.Has(kRed);
    if (colors.components == 4) builder_.Has(kAlpha);
    const auto copy = [](const Accessor& from, std::size_t i, double* to) {
      for (std::size_t c = 0; c < from.components; ++c) to[c] = from.At(i, c);
    };
    for (std::size_t i = 0; i < places.count; ++i) {
      VertexRow row{};
      copy(places, i, &row[kX]);
      if (normals.count > 0) copy(normals, i, &row[kNormalX]);
      if (colors.count > 0) copy(colors, i, &row[kRed]);
      builder_.AddVertex(row);
    }
    const std::int64_t indices = Whole(*shown.primitive, "indices"), mode = Whole(*shown.primitive, "mode", kTriangles);
    if (mode == kPoints) return;
    const Accessor numbers = indices == kAbsent ? Accessor() : Numbers(indices, {1});
    std::vector<std::int64_t> corners(indices == kAbsent ? places.count : numbers.count);
    for (std::size_t i = 0; i < corners.size(); ++i) {
      corners[i] = indices == kAbsent ? std::int64_t(i) : std::int64_t(numbers.At(i, 0));
      if (corners[i] >= std::int64_t(places.count))
        builder_.Wrong(fmt::format("an index is {}, must be in [0, {})", corners[i], places.count));
    }
    if (mode == kFan) builder_.AddPolygon(corners, base);
    if (mode == kStrip) builder_.AddStrip(corners, base);
    for (std::size_t i = 2; mode == kTriangles && i < corners.size(); i += 3)
      builder_.AddPolygon(std::span(corners).subspan(i - 2, 3), base);
  }

  const std::string_view bytes_;
  ShapeBuilder& builder_;
  Json json_;
  std::string_view binary_;
  std::vector<int> parents_;  // of each node, that were seen
  std::vector<Shown> shown_;
};

}  // namespace

void ReadGlb(std::string_view bytes, ShapeBuilder& builder) { GlbReader(bytes, builder).Read(); }

}  // namespace slabstream
