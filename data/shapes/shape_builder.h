// ShapeBuilder: a shape as its reader finds it, vertex by vertex. It takes memory as vertices come, in steps that it checks beforehand. Its
// first failure stays: what is added later changes nothing, and Finish returns it. So readers need not ask after each call.
//
// One thread at a time.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/base/status.h"
#include "common/shapes/shape.h"
#include "common/volume/affine_map.h"

namespace slabstream {

// What files say of a vertex.
enum VertexColumn : std::size_t { kX, kY, kZ, kNormalX, kNormalY, kNormalZ, kRed, kGreen, kBlue, kAlpha, kValue, kRadius, kVertexColumns };
using VertexRow = std::array<double, kVertexColumns>;

// For each column the number of the name that means it, in any case; none: there is no such name. Normals and colours have all of their
// columns (but alpha) or none.
using NamedColumns = std::array<std::optional<std::size_t>, kVertexColumns>;
NamedColumns FindColumns(const std::vector<std::string>& names);

class ShapeBuilder {
 public:
  // What is said of each vertex from now on, beside its place.
  void Has(VertexColumn column) { has_[column] = true; }
  void Has(const NamedColumns& columns);
  void HasOnlyPlaces() { has_ = {}; }
  // From the file's coordinates to those of the world, from now on. One that mirrors turns triangles round.
  void SetMap(const AffineMap& map) { map_ = map; }
  void SetLps() { map_.steps = {Vec3{-1, 0, 0}, Vec3{0, -1, 0}, Vec3{0, 0, 1}}; }  // of a patient: to the left, posterior, superior
  // Places are floats in the file. So they are kept as they are, and the first one is not the origin.
  void SetFloats() { floats_ = true; }
  // The number of a full channel in colours: 255 of bytes. 0, as at first: 1 if no channel is more, else 255.
  void SetFullChannel(double full) { full_ = full; }

  // So many more will come. InvalidArgument: more than a shape can have. ResourceExhausted.
  void Expect(std::uint64_t vertices, std::uint64_t triangles);
  void AddVertex(const VertexRow& row);
  // Numbers of vertices from `base` on. Those of a polygon go round it; less than three are no polygon. Of a strip, each with the two
  // before it is a triangle.
  void AddTriangle(std::int64_t a, std::int64_t b, std::int64_t c);
  void AddPolygon(std::span<const std::int64_t> corners, std::int64_t base = 0);
  void AddStrip(std::span<const std::int64_t> corners, std::int64_t base = 0);
  // The vertices since the last line are one. A single one is left out.
  void EndLine();

  void Fail(const Status& status);
  void Wrong(const std::string& why) { Fail(Status::InvalidArgument(why)); }
  void Truncated(const std::string& what) { Fail(Status::DataLoss("truncated: " + what)); }
  bool ok() const { return status_.ok(); }
  std::size_t vertices() const { return shape_.positions.size(); }
  std::size_t triangles() const { return shape_.triangles.size(); }

  // A mesh if there are triangles, else lines if there are any, else points. InvalidArgument: the first failure, no vertex, or a vertex of
  // a triangle that is not there.
  Result<Shape> Finish();

 private:
  void SetColors();
  bool mirrors() const { return Dot(map_.steps[0], Cross(map_.steps[1], map_.steps[2])) < 0; }

  Status status_;
  Shape shape_;
  std::vector<std::array<float, 4>> colors_;
  std::array<bool, kVertexColumns> has_ = {};
  AffineMap map_;
  bool floats_ = false;
  double full_ = 0;
};

}  // namespace slabstream
