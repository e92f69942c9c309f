#include "data/shapes/shape_builder.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string_view>
#include <utility>

#include "common/volume/memory_budget.h"
#include "data/volume_io/text_header.h"

namespace slabstream {
namespace {

// What files call the columns. A name that two of them have is the first one's.
const std::array<std::vector<std::string_view>, kVertexColumns> kNames = {{{"x", "points:0"},
                                                                           {"y", "points:1"},
                                                                           {"z", "points:2"},
                                                                           {"nx", "normals:0"},
                                                                           {"ny", "normals:1"},
                                                                           {"nz", "normals:2"},
                                                                           {"red", "diffuse_red", "r"},
                                                                           {"green", "diffuse_green", "g"},
                                                                           {"blue", "diffuse_blue", "b"},
                                                                           {"alpha"},
                                                                           {"value", "values", "quality", "scalar", "scalars", "intensity"},
                                                                           {"radius", "radii", "r"}}};

// The value of the vertex behind `all`. Vertices of which nothing was said have `otherwise`.
template <class T>
void Put(std::vector<T>& all, std::size_t number, const T& value, const T& otherwise) {
  all.resize(number, otherwise);
  all.push_back(value);
}

// If any vertex has a value, all have one.
template <class T>
void Complete(std::vector<T>& all, std::size_t count, const T& otherwise) {
  if (!all.empty()) all.resize(count, otherwise);
}

constexpr float kOpaque = std::numeric_limits<float>::infinity();  // of which no share is taken
constexpr std::array<float, 3> kNoNormal = {};
constexpr float kNoValue = std::numeric_limits<float>::quiet_NaN();

std::array<float, 3> Floats(const Vec3& v) { return {float(v.x), float(v.y), float(v.z)}; }

}  // namespace

NamedColumns FindColumns(const std::vector<std::string>& names) {
  NamedColumns columns;
  for (std::size_t column = 0; column < kVertexColumns; ++column) {
    for (std::size_t i = kNames[column].size(); i-- > 0;) {
      for (std::size_t number = names.size(); number-- > 0;) {
        if (ToLower(names[number]) == kNames[column][i]) columns[column] = number;
      }
    }
  }
  for (const std::size_t first : {kNormalX, kRed}) {
    if (!columns[first] || !columns[first + 1] || !columns[first + 2]) columns[first].reset();
  }
  if (columns[kRadius] == columns[kRed]) columns[kRadius].reset();
  return columns;
}

void ShapeBuilder::Has(const NamedColumns& columns) {
  for (std::size_t i = 0; i < kVertexColumns; ++i) has_[i] = columns[i].has_value();
}

void ShapeBuilder::Fail(const Status& status) {
  if (ok()) status_ = status;
}

void ShapeBuilder::Expect(std::uint64_t vertices, std::uint64_t triangles) {
  const std::uint64_t all = shape_.positions.size() + vertices, all_triangles = shape_.triangles.size() + triangles;
  if (vertices > kMaxShapeVertices || all > kMaxShapeVertices)
    return Wrong(fmt::format("has {} vertices, limit {}", std::max(all, vertices), kMaxShapeVertices));
  if (triangles > kMaxShapeParts || all_triangles > kMaxShapeParts)
    return Wrong(fmt::format("has {} triangles, limit {}", std::max(all_triangles, triangles), kMaxShapeParts));
  const std::size_t vertex_bytes = sizeof shape_.positions[0] + (has_[kNormalX] ? sizeof kNoNormal : 0) +
                                   (has_[kRed] ? sizeof colors_[0] + sizeof shape_.colors[0] : 0) + (has_[kValue] ? sizeof kNoValue : 0) +
                                   (has_[kRadius] ? sizeof shape_.radii[0] : 0);
  Fail(CheckFitsMemory(std::int64_t(vertices * vertex_bytes + triangles * sizeof shape_.triangles[0]), "the shape"));
  if (!ok()) return;
  if (vertices > 0) shape_.positions.reserve(all);
  if (triangles > 0) shape_.triangles.reserve(all_triangles);
}

void ShapeBuilder::AddVertex(const VertexRow& row) {
  if (!ok()) return;
  constexpr std::size_t kLeast = 1024;
  const std::size_t number = vertices();
  if (number == shape_.positions.capacity()) Expect(std::max(kLeast, std::min<std::size_t>(number, kMaxShapeVertices - number)), 0);
  const Vec3 place = map_.To({row[kX], row[kY], row[kZ]});
  if (number == 0 && !floats_) shape_.origin = place;
  const std::array<float, 3> position = Floats(place - shape_.origin);
  if (!std::ranges::all_of(position, [](float x) { return std::isfinite(x); }))
    Wrong(fmt::format("vertex {} is at ({}, {}, {}), must be finite", number, row[kX], row[kY], row[kZ]));
  if (has_[kRadius] && !(row[kRadius] >= 0 && std::isfinite(float(row[kRadius]))))
    Wrong(fmt::format("vertex {} has the radius {}, must be at least 0", number, row[kRadius]));
  if (!ok()) return;
  shape_.positions.push_back(position);
  if (has_[kNormalX]) {
    // Normals stay at right angles to surfaces under any map.
    const auto& [x, y, z] = map_.steps;
    const Vec3 normal = row[kNormalX] * Cross(y, z) + row[kNormalY] * Cross(z, x) + row[kNormalZ] * Cross(x, y);
    const double length = (mirrors() ? -1 : 1) * Length(normal);
    Put(shape_.normals, number, std::isnormal(length) ? Floats(normal / length) : kNoNormal, kNoNormal);
  }
  if (has_[kRed]) {
    constexpr std::array<float, 4> kWhite = {1, 1, 1, 1};
    const double full = full_ > 0 ? full_ : 1;
    const std::array<float, 4> color = {float(row[kRed] / full), float(row[kGreen] / full), float(row[kBlue] / full),
                                        has_[kAlpha] ? float(row[kAlpha] / full) : kOpaque};
    Put(colors_, number, color, kWhite);
  }
  if (has_[kValue]) Put(shape_.values, number, float(row[kValue]), kNoValue);
  if (has_[kRadius]) Put(shape_.radii, number, float(row[kRadius]), 0.0F);
}

void ShapeBuilder::AddTriangle(std::int64_t a, std::int64_t b, std::int64_t c) {
  if (!ok()) return;
  std::vector<std::array<std::uint32_t, 3>>& all = shape_.triangles;
  constexpr std::size_t kLeast = 1024;
  if (all.size() == all.capacity()) Expect(0, std::max(kLeast, std::min<std::size_t>(all.size(), kMaxShapeParts - all.size())));
  if (mirrors()) std::swap(b, c);
  for (const std::int64_t corner : {a, b, c}) {
    if (corner < 0 || corner >= kMaxShapeVertices)
      Wrong(fmt::format("triangle {} has vertex {}, must be in [0, {})", all.size(), corner, kMaxShapeVertices));
  }
  if (ok()) all.push_back({std::uint32_t(a), std::uint32_t(b), std::uint32_t(c)});
}

void ShapeBuilder::AddPolygon(std::span<const std::int64_t> corners, std::int64_t base) {
  for (std::size_t i = 2; i < corners.size(); ++i) AddTriangle(base + corners[0], base + corners[i - 1], base + corners[i]);
}

void ShapeBuilder::AddStrip(std::span<const std::int64_t> corners, std::int64_t base) {
  for (std::size_t i = 2; i < corners.size(); ++i)
    AddTriangle(base + corners[i - 2], base + corners[i - 1 + i % 2], base + corners[i - i % 2]);
}

void ShapeBuilder::EndLine() {
  std::vector<std::uint32_t>& begins = shape_.line_begins;
  if (begins.empty()) begins.push_back(0);
  const std::size_t begin = begins.back();
  if (vertices() >= begin + 2) begins.push_back(std::uint32_t(vertices()));
  const std::size_t kept = begins.back();
  shape_.positions.resize(kept);
  const auto shorten = [&](auto& all) { all.resize(std::min(all.size(), kept)); };
  shorten(colors_);
  shorten(shape_.values);
  shorten(shape_.radii);
}

void ShapeBuilder::SetColors() {
  const auto channel = [](float share) { return share > 0 ? std::uint8_t(std::lround(255 * std::min(share, 1.0F))) : std::uint8_t{0}; };
  const bool bytes = full_ == 0 && std::ranges::any_of(colors_, [](const auto& c) { return std::max({c[0], c[1], c[2]}) > 1; });
  const float scale = bytes ? 1.0F / 255 : 1;
  for (const auto& [red, green, blue, alpha] : colors_)
    shape_.colors.push_back({channel(scale * red), channel(scale * green), channel(scale * blue), channel(scale * alpha)});
}

Result<Shape> ShapeBuilder::Finish() {
  const std::size_t count = vertices();
  if (ok() && count == 0) Wrong("has no vertex");
  for (std::size_t i = 0; ok() && i < triangles(); ++i) {
    for (const std::uint32_t corner : shape_.triangles[i]) {
      if (corner >= count) Wrong(fmt::format("triangle {} has vertex {}, must be in [0, {})", i, corner, count));
    }
  }
  if (!ok()) return status_;
  const bool mesh = triangles() > 0;
  if (shape_.line_begins.size() < 2 || mesh) shape_.line_begins.clear();
  shape_.kind = mesh ? ShapeKind::kMesh : shape_.line_begins.empty() ? ShapeKind::kPoints : ShapeKind::kLines;
  SetColors();
  if (mesh) shape_.radii.clear();
  if (!mesh) shape_.normals.clear();
  Complete(shape_.normals, count, kNoNormal);
  Complete(shape_.colors, count, {255, 255, 255, 255});
  Complete(shape_.values, count, kNoValue);
  Complete(shape_.radii, count, 0.0F);
  return std::move(shape_);
}

}  // namespace slabstream
