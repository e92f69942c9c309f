#include "common/view/sheet_grid.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace slabstream {
namespace {

using Matrix = std::array<double, 9>;  // row major

Matrix Product(const Matrix& a, const Matrix& b) {
  Matrix product{};
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) {
      for (std::size_t n = 0; n < 3; ++n) product[3 * i + j] += a[3 * i + n] * b[3 * n + j];
    }
  }
  return product;
}

// The inverse up to a positive factor: the adjugate, times the sign of the determinant.
Matrix InverseDirection(const Matrix& m) {
  const Matrix adjugate = {m[4] * m[8] - m[5] * m[7], m[2] * m[7] - m[1] * m[8], m[1] * m[5] - m[2] * m[4],
                           m[5] * m[6] - m[3] * m[8], m[0] * m[8] - m[2] * m[6], m[2] * m[3] - m[0] * m[5],
                           m[3] * m[7] - m[4] * m[6], m[1] * m[6] - m[0] * m[7], m[0] * m[4] - m[1] * m[3]};
  const double determinant = m[0] * adjugate[0] + m[1] * adjugate[3] + m[2] * adjugate[6];
  Matrix inverse = adjugate;
  for (double& value : inverse) value = determinant < 0 ? -value : value;
  return inverse;
}

struct Extent {
  double begin = std::numeric_limits<double>::infinity(), end = -std::numeric_limits<double>::infinity();
  void Add(double x) { begin = std::min(begin, x), end = std::max(end, x); }
};

}  // namespace

SheetGrid MakeSheetGrid(const Camera& camera, const VolumeGeometry& geometry, double footprint) {
  const auto [c, u, v] = AxesOf(camera.traversal_axis);
  const auto column_of = [&](const std::array<double, 4>& row, Axis axis) { return row[std::size_t(Number(axis))]; };
  const Vec3 centre = geometry.centre();
  const bool perspective = camera.projection == Projection::kPerspective;

  // The plane through the volume's centre, k = centre[c], stands for the grid: the point where a ray meets it is the ray's pixel.
  // picture_from_plane takes (u, v, 1) to homogeneous coordinates of the picture.
  Matrix picture_from_plane;
  const std::array<const std::array<double, 4>*, 3> rows = {&camera.x_row, &camera.y_row, &camera.w_row};
  for (std::size_t i = 0; i < 3; ++i) {
    picture_from_plane[3 * i] = column_of(*rows[i], u);
    picture_from_plane[3 * i + 1] = column_of(*rows[i], v);
    picture_from_plane[3 * i + 2] = column_of(*rows[i], c) * centre[c] + (*rows[i])[3];
  }

  // Pixels of the picture a voxel, at the centre.
  const double u_centre = centre[u], v_centre = centre[v];
  const auto pixels_per_voxel = [&](std::size_t column) {
    const auto at_centre = [&](std::size_t row) {
      return picture_from_plane[3 * row] * u_centre + picture_from_plane[3 * row + 1] * v_centre + picture_from_plane[3 * row + 2];
    };
    const double w = at_centre(2), x = at_centre(0) / w, y = at_centre(1) / w;
    const double by_x = (picture_from_plane[column] - x * picture_from_plane[6 + column]) / w;
    const double by_y = (picture_from_plane[3 + column] - y * picture_from_plane[6 + column]) / w;
    return std::clamp(std::hypot(by_x, by_y), kMinGridPixelsPerVoxel, kMaxGridPixelsPerVoxel);
  };

  SheetGrid grid;
  grid.footprint = footprint;
  grid.x_u = pixels_per_voxel(0);
  grid.y_v = pixels_per_voxel(1);
  const Vec3 direction = camera.view_direction / camera.spacing;  // data space
  grid.shear_u = direction[u] / std::abs(direction[c]);
  grid.shear_v = direction[v] / std::abs(direction[c]);
  if (perspective) {
    // From the eye e, slice k is the plane k = centre scaled by w(k) about e.
    const Vec3& e = camera.eye;
    grid.w_c = 1 / (centre[c] - e[c]);
    grid.w_0 = -e[c] * grid.w_c;
    grid.x_c = grid.x_u * e[u] * grid.w_c;
    grid.x_0 = grid.x_u * e[u] * (grid.w_0 - 1);
    grid.y_c = grid.y_v * e[v] * grid.w_c;
    grid.y_0 = grid.y_v * e[v] * (grid.w_0 - 1);
  } else {
    const double per_slice_u = direction[u] / direction[c], per_slice_v = direction[v] / direction[c];
    grid.x_c = -grid.x_u * per_slice_u;
    grid.x_0 = grid.x_u * per_slice_u * centre[c];
    grid.y_c = -grid.y_v * per_slice_v;
    grid.y_0 = grid.y_v * per_slice_v * centre[c];
  }

  // The pixels that footprints of the volume reach.
  Extent columns, image_rows;
  for (const double k : {-0.5, geometry.size[c] - 0.5}) {
    const SlicePlacement slice = PlaceSlice(grid, k);
    const FootprintSigma sigma = FootprintIn(grid, slice);
    for (const double side : {-1.0, 1.0}) {
      columns.Add(slice.scale_u * (centre[u] + side * (0.5 * geometry.size[u] + kFootprintCut * sigma.u)) + slice.offset_u);
      image_rows.Add(slice.scale_v * (centre[v] + side * (0.5 * geometry.size[v] + kFootprintCut * sigma.v)) + slice.offset_v);
    }
  }
  // Cut to what is in the picture, unless the picture's border sees beyond the horizon of the slices.
  const Matrix plane_from_picture = InverseDirection(picture_from_plane);
  const Matrix grid_from_plane = {grid.x_u, 0, 0, 0, grid.y_v, 0, 0, 0, 1};
  const Matrix unshifted = Product(grid_from_plane, plane_from_picture);
  Extent seen_columns, seen_rows;
  bool horizon = false;
  constexpr double kFilterReach = 4;  // pixels of the picture that resampling reaches beyond its border, with some to spare
  for (const double x : {-kFilterReach, camera.width + kFilterReach}) {
    for (const double y : {-kFilterReach, camera.height + kFilterReach}) {
      const double w = unshifted[6] * x + unshifted[7] * y + unshifted[8];
      const double least = 1e-6 * (std::abs(unshifted[6] * x) + std::abs(unshifted[7] * y) + std::abs(unshifted[8]));
      if (w <= least) {
        horizon = true;
        continue;
      }
      seen_columns.Add((unshifted[0] * x + unshifted[1] * y + unshifted[2]) / w);
      seen_rows.Add((unshifted[3] * x + unshifted[4] * y + unshifted[5]) / w);
    }
  }
  if (!horizon) {
    constexpr double kGridReach = 2;  // the same in pixels of the grid, if those are wider
    columns = {std::max(columns.begin, seen_columns.begin - kGridReach), std::min(columns.end, seen_columns.end + kGridReach)};
    image_rows = {std::max(image_rows.begin, seen_rows.begin - kGridReach), std::min(image_rows.end, seen_rows.end + kGridReach)};
  }

  // Pixel (0, 0) begins there.
  const bool empty = columns.begin >= columns.end || image_rows.begin >= image_rows.end;
  const double first_column = empty ? 0 : std::floor(columns.begin), first_row = empty ? 0 : std::floor(image_rows.begin);
  const double width = empty ? 1 : std::ceil(columns.end) - first_column, height = empty ? 1 : std::ceil(image_rows.end) - first_row;
  constexpr double kAbsurd = 1 << 30;
  grid.width = (std::int32_t(std::min(width, kAbsurd)) + kGridColumnStep - 1) / kGridColumnStep * kGridColumnStep;
  grid.height = std::int32_t(std::min(height, kAbsurd));
  grid.x_c -= first_column * grid.w_c;
  grid.x_0 -= first_column * grid.w_0;
  grid.y_c -= first_row * grid.w_c;
  grid.y_0 -= first_row * grid.w_0;
  grid.from_picture = Product({1, 0, -first_column, 0, 1, -first_row, 0, 0, 1}, unshifted);
  return grid;
}

FootprintSigma FootprintIn(const SheetGrid& grid, const SlicePlacement& slice) {
  const auto sigma = [&grid](double shear, double scale) {
    shear = std::min(std::abs(shear), kMaxFootprintShear);
    const double usual = std::sqrt(std::max(kFootprintVoxelVariance * (1 + shear * shear), kFootprintGridVariance / (scale * scale)));
    return std::max(usual, std::min(grid.footprint * usual, kMaxFootprintSigma));
  };
  return {sigma(grid.shear_u, slice.scale_u), sigma(grid.shear_v, slice.scale_v)};
}

}  // namespace slabstream
