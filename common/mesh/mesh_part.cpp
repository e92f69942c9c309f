#include "common/mesh/mesh_part.h"

#include <fmt/format.h>
#include <xxhash.h>

#include <utility>

#include "common/mesh/kept_points.h"
#include "common/mesh/point_gradients.h"

namespace slabstream {
namespace {

// Those for which visit(keep) calls keep(cell, its bounds), by ascending number.
template <class Visit>
Mesh CellsOf(const Mesh& mesh, std::span<const Vector3<float>> gradients, Visit&& visit) {
  Mesh part;
  part.at = mesh.at;
  KeptPoints kept(mesh.points.size());
  visit([&](std::size_t cell, const CellBounds&) {
    const Tetrahedron& t = mesh.tetrahedra[cell];
    for (const PointNumber point : t) kept.Keep(point);
    part.tetrahedra.push_back(t);
    if (part.at == ValuesAt::kCells) part.values.push_back(mesh.values[cell]);
  });
  const std::size_t points = kept.Count();
  part.points.reserve(points);
  part.gradients.reserve(points);
  if (part.at == ValuesAt::kPoints) part.values.reserve(points);
  kept.Visit([&](std::size_t point) {
    part.points.push_back(mesh.points[point]);
    part.gradients.push_back(gradients[point]);
    if (part.at == ValuesAt::kPoints) part.values.push_back(mesh.values[point]);
  });
  kept.Renumber(part.tetrahedra);
  return part;
}

}  // namespace

Mesh CellsTouching(const Mesh& mesh, const CellBounds& space) {
  return CellsOf(mesh, mesh.gradients, [&](auto&& keep) {
    for (std::size_t cell = 0; cell < mesh.tetrahedra.size(); ++cell) {
      if (const CellBounds bounds = BoundsOf(mesh, cell); Touch(bounds, space)) keep(cell, bounds);
    }
  });
}

MeshCutter::MeshCutter(std::shared_ptr<const Mesh> mesh) : mesh_(std::move(mesh)), gradients_(PointGradients(*mesh_)), runs_(*mesh_) {}

Mesh MeshCutter::Cut(const Box& box) const {
  if (box.empty()) return {.at = mesh_->at};
  return CellsOf(*mesh_, gradients_, [&](auto&& keep) { runs_.Visit(*mesh_, SpaceOf(box), keep); });
}

Status MeshCutter::Visit(const std::function<void(const Mesh&)>& function) const {
  function(*mesh_);
  return Status::Ok();
}

std::string MeshCutter::Digest() const {
  const auto digest = [](const auto& array) { return XXH3_64bits(array.data(), std::span(array).size_bytes()); };
  return fmt::format("{} {} {} {:x} {:x} {:x}", mesh_->points.size(), mesh_->tetrahedra.size(), int(mesh_->at), digest(mesh_->points),
                     digest(mesh_->tetrahedra), digest(mesh_->values));
}

}  // namespace slabstream
