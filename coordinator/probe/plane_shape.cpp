#include "coordinator/probe/plane_shape.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <mutex>
#include <vector>

#include "common/parallel/parallel.h"
#include "common/planning/framing.h"
#include "coordinator/probe/probe_volume.h"

namespace slabstream {
namespace {

// Over two axes of data space, u and v, the plane is at `height` along the third, which is the nearest to its normal.
struct Graph {
  Axis u, v, up;
  double at_zero, by_u, by_v;
  double last;  // of `up`: data space ends half a voxel beyond the centre of voxel `last`

  double Height(double at_u, double at_v) const { return at_zero + by_u * at_u + by_v * at_v; }
  Vec3 Place(double at_u, double at_v) const {
    Vec3 place;
    place[u] = at_u;
    place[v] = at_v;
    place[up] = Height(at_u, at_v);
    return place;
  }
};

Graph GraphOf(const HalfSpace& plane, const Index3& size) {
  const Axis up = *std::ranges::max_element(kAxes, {}, [&](Axis axis) { return std::abs(plane.normal[axis]); });
  const Axis u = up == Axis::kX ? Axis::kY : Axis::kX, v = up == Axis::kZ ? Axis::kY : Axis::kZ;
  const double per = -1 / plane.normal[up];
  return {u, v, up, per * plane.offset, per * plane.normal[u], per * plane.normal[v], double(size[up] - 1)};
}

struct Corner {
  double u, v;
};

// Where `keep` is not negative along its edges (Sutherland and Hodgman, 1974).
std::vector<Corner> Clipped(const std::vector<Corner>& polygon, auto&& keep) {
  std::vector<Corner> kept;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Corner &a = polygon[i], &b = polygon[(i + 1) % polygon.size()];
    const double at_a = keep(a), at_b = keep(b);
    if (at_a >= 0) kept.push_back(a);
    if ((at_a >= 0) == (at_b >= 0)) continue;
    const double t = at_a / (at_a - at_b);
    kept.push_back({a.u + t * (b.u - a.u), a.v + t * (b.v - a.v)});
  }
  return kept;
}

std::vector<Corner> PolygonOf(const Graph& graph, const Index3& size) {
  const double u = size[graph.u] - 0.5, v = size[graph.v] - 0.5;
  const std::vector<Corner> all = {{-0.5, -0.5}, {u, -0.5}, {u, v}, {-0.5, v}};
  const auto height = [&](const Corner& c) { return graph.Height(c.u, c.v); };
  return Clipped(Clipped(all, [&](const Corner& c) { return height(c) + 0.5; }),
                 [&](const Corner& c) { return graph.last + 0.5 - height(c); });
}

// Samples along an axis of `size` voxels, `per_voxel` of them a voxel; the first one is at the centre of the first voxel.
struct Samples {
  double per_voxel;
  std::uint32_t count;

  Samples(std::int32_t size, double wanted) : per_voxel(std::min(wanted, (kMaxPlaneSide - 1) / std::max(1.0, size - 1.0))) {
    count = std::uint32_t(std::lround(std::floor((size - 1) * per_voxel))) + 1;
  }
  double Place(std::uint32_t number) const { return number / per_voxel; }
};

}  // namespace

Result<Shape> PlaneShape(const ClipSlab& slab, const VolumeDescription& description, const ReadPlaneBox& read) {
  const VolumeGeometry& geometry = description.geometry;
  const Graph graph = GraphOf(MiddlePlane(slab, geometry), geometry.size);
  const std::vector<Corner> polygon = PolygonOf(graph, geometry.size);
  Shape shape;
  if (polygon.size() < 3) return shape;
  shape.origin = geometry.ToWorld(geometry.centre());
  for (const Corner& corner : polygon) {
    const Vec3 p = geometry.ToWorld(graph.Place(corner.u, corner.v)) - shape.origin;
    shape.positions.push_back({float(p.x), float(p.y), float(p.z)});
  }
  for (std::uint32_t i = 2; i < polygon.size(); ++i) shape.triangles.push_back({0, i - 1, i});

  const double wanted = graph.by_u == 0 && graph.by_v == 0 ? 1 : 2;
  const Samples columns(geometry.size[graph.u], wanted), rows(geometry.size[graph.v], wanted);
  const AffineMap to_data = FromWorld(geometry);
  const auto samples_of = [&](Axis axis, double per_voxel) {
    const auto along = [&](const Vec3& step) { return per_voxel * step[axis]; };
    return std::array{along(to_data.steps[0]), along(to_data.steps[1]), along(to_data.steps[2]), along(to_data.To(shape.origin))};
  };
  shape.plane = {.columns = columns.count,
                 .rows = rows.count,
                 .column = samples_of(graph.u, columns.per_voxel),
                 .row = samples_of(graph.v, rows.per_voxel),
                 .samples = std::vector<float>(std::size_t{columns.count} * rows.count)};

  constexpr std::uint32_t kTile = 64;  // samples a side, so that a box of voxels is small however the plane lies
  const std::uint32_t tiles_a_row = (columns.count + kTile - 1) / kTile, tiles = tiles_a_row * ((rows.count + kTile - 1) / kTile);
  std::mutex mutex;
  Status failed;  // the first one
  ParallelFor(0U, tiles, [&](std::uint32_t tile) {
    const std::uint32_t column = tile % tiles_a_row * kTile, row = tile / tiles_a_row * kTile;
    const std::uint32_t column_end = std::min(column + kTile, columns.count), row_end = std::min(row + kTile, rows.count);
    const auto place = [&](std::uint32_t c, std::uint32_t r) {
      return geometry.stretch.ToVoxel(graph.Place(columns.Place(c), rows.Place(r)));
    };
    // The place is linear, or grows with each coordinate, so its bounds are at corners. Far outside, the outermost voxel counts.
    Box box;
    for (const std::uint32_t c : {column, column_end - 1}) {
      for (const std::uint32_t r : {row, row_end - 1}) {
        const Index3 voxel = Max(Uniform(0), Min(VoxelAt(place(c, r)), geometry.size - Uniform(1)));
        box = Hull(box, {voxel - Uniform(1), voxel + Uniform(2)});
      }
    }
    box = Intersection(box, geometry.bounds());
    const Result<VoxelBlock> block = read(box);
    if (!block.ok()) {
      const std::scoped_lock lock(mutex);
      if (failed.ok()) failed = block.status();
      return;
    }
    VisitStoredType(block->type, [&]<class T>(const T*) {
      const ProbeVolume volume{
          .voxels = {geometry.size, [&](const Index3& voxel) { return double(block->samples<T>()[block->Offset(voxel)]); }}};
      for (std::uint32_t r = row; r < row_end; ++r) {
        for (std::uint32_t c = column; c < column_end; ++c) {
          const double value = description.mapping.FromStored(volume.Interpolated(place(c, r)));
          shape.plane.samples[std::size_t{r} * columns.count + c] =
              std::isfinite(value) ? float(value) : std::numeric_limits<float>::quiet_NaN();
        }
      }
    });
  });
  return failed.ok() ? Result<Shape>(std::move(shape)) : failed;
}

}  // namespace slabstream
