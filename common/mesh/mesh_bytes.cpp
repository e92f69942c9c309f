#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <type_traits>

#include "common/mesh/mesh_part.h"

namespace slabstream {
namespace {

static_assert(std::endian::native == std::endian::little, "meshes are little endian and are copied as they are");
static_assert(sizeof(Vector3<float>) == 12 && std::is_trivially_copyable_v<Vector3<float>> && sizeof(Tetrahedron) == 16);

struct Header {
  std::uint64_t points, tetrahedra;
  std::uint32_t at, lit;
};
static_assert(sizeof(Header) == 24);

template <class Vector>
void Append(std::byte*& to, const Vector& from) {
  const std::span bytes = std::as_bytes(std::span(from));
  to = std::ranges::copy(bytes, to).out;
}

template <class Vector>
void Take(const std::byte*& from, std::size_t count, Vector& to) {
  to.resize(count);
  const std::span bytes = std::as_writable_bytes(std::span(to));
  std::copy_n(from, bytes.size(), bytes.begin());
  from += bytes.size();
}

bool IsFinite(const Vector3<float>& point) { return std::isfinite(point.x) && std::isfinite(point.y) && std::isfinite(point.z); }

Status CheckCells(const Mesh& mesh) {
  for (std::size_t i = 0; i < mesh.points.size(); ++i) {
    if (!IsFinite(mesh.points[i])) return Status::DataLoss(fmt::format("mesh: point {} is not finite", i));
  }
  for (std::size_t i = 0; i < mesh.tetrahedra.size(); ++i) {
    const auto& [a, b, c, d] = mesh.tetrahedra[i];
    if (const PointNumber most = std::max({a, b, c, d}); most >= mesh.points.size()) {
      return Status::DataLoss(fmt::format("mesh: tetrahedron {} has point {}, must be below {}", i, most, mesh.points.size()));
    }
    if (a == b || a == c || a == d || b == c || b == d || c == d) {
      return Status::DataLoss(fmt::format("mesh: tetrahedron {} has a point twice: {}, {}, {}, {}", i, a, b, c, d));
    }
  }
  return Status::Ok();
}

}  // namespace

std::vector<std::byte> EncodeMesh(const Mesh& mesh) {
  const Header header = {mesh.points.size(), mesh.tetrahedra.size(), std::uint32_t(mesh.at), mesh.gradients.empty() ? 0U : 1U};
  std::vector<std::byte> bytes(sizeof header + std::span(mesh.points).size_bytes() + std::span(mesh.tetrahedra).size_bytes() +
                               std::span(mesh.values).size_bytes() + std::span(mesh.gradients).size_bytes());
  std::byte* to = bytes.data();
  Append(to, std::array{header});
  Append(to, mesh.points);
  Append(to, mesh.tetrahedra);
  Append(to, mesh.values);
  Append(to, mesh.gradients);
  return bytes;
}

Result<Mesh> DecodeMesh(std::span<const std::byte> bytes) {
  Header header;
  if (bytes.size() < sizeof header) {
    return Status::DataLoss(fmt::format("mesh: has {} bytes, must have at least {}", bytes.size(), sizeof header));
  }
  std::memcpy(&header, bytes.data(), sizeof header);
  const auto [points, tetrahedra, at, lit] = header;
  if (points > std::uint64_t(kMaxMeshPoints)) {
    return Status::DataLoss(fmt::format("mesh: has {} points, must have at most {}", points, kMaxMeshPoints));
  }
  if (tetrahedra > std::uint64_t(kMaxTetrahedra)) {
    return Status::DataLoss(fmt::format("mesh: has {} tetrahedra, must have at most {}", tetrahedra, kMaxTetrahedra));
  }
  if (at > std::uint32_t(ValuesAt::kCells)) return Status::DataLoss(fmt::format("mesh: values are at {}, must be at 0 or 1", at));
  if (lit > (points > 0 ? 1 : 0)) {
    return Status::DataLoss(fmt::format("mesh: lit is {}, must be 0, or 1 if there are points", lit));
  }
  Mesh mesh;
  mesh.at = ValuesAt(at);
  const std::uint64_t values = mesh.at == ValuesAt::kPoints ? points : tetrahedra;
  const std::uint64_t expected = sizeof header + points * sizeof(Vector3<float>) + tetrahedra * sizeof(Tetrahedron) +
                                 values * sizeof(float) + lit * points * sizeof(Vector3<float>);
  if (bytes.size() != expected) {
    return Status::DataLoss(
        fmt::format("mesh: has {} bytes, must have {} for {} points and {} tetrahedra", bytes.size(), expected, points, tetrahedra));
  }
  const std::byte* from = bytes.data() + sizeof header;
  Take(from, std::size_t(points), mesh.points);
  Take(from, std::size_t(tetrahedra), mesh.tetrahedra);
  Take(from, std::size_t(values), mesh.values);
  Take(from, std::size_t(lit * points), mesh.gradients);
  if (Status status = CheckCells(mesh); !status.ok()) return status;
  return mesh;
}

}  // namespace slabstream
