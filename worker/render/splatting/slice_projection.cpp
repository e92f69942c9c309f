#include "worker/render/splatting/slice_projection.h"

#include <cmath>

namespace slabstream {

SliceProjection::SliceProjection(const Camera& camera, const VolumeGeometry& geometry)
    : axes_(AxesOf(camera.traversal_axis)), perspective_(camera.projection == Projection::kPerspective) {
  const Vec3 middle = 0.5 * (ToVec3(geometry.size) - Vec3{1, 1, 1});
  const auto& w_row = camera.w_row;
  const double scale = 1 / (w_row[0] * middle.x + w_row[1] * middle.y + w_row[2] * middle.z + w_row[3]);
  const auto column = [&](std::size_t i) { return scale * Homogeneous{camera.x_row[i], camera.y_row[i], camera.w_row[i]}; };
  step_u_ = column(std::size_t(Number(axes_.u)));
  step_v_ = column(std::size_t(Number(axes_.v)));
  step_k_ = column(std::size_t(Number(axes_.c)));
  origin_ = column(3);
  sheet_distance_ = geometry.spacing[axes_.c] / std::abs(camera.view_direction[axes_.c]);
}

double SliceProjection::CellArea(double k) const { return std::abs(Determinant(step_u_, step_v_, SliceOrigin(k))); }

FootprintSigma SliceProjection::SigmaAt(double u, double v, double k) const {
  const Homogeneous p = At(u, v, k);
  const double x = p.x / p.w, y = p.y / p.w;
  double xx = 0, yy = 0, xy = 0;
  for (const Homogeneous& step : {step_u_, step_v_, step_k_}) {
    const double dx = (step.x - x * step.w) / p.w, dy = (step.y - y * step.w) / p.w;
    xx += dx * dx;
    yy += dy * dy;
    xy += dx * dy;
  }
  const double covariance = kFootprintVoxelVariance * std::abs(xy);
  return {std::sqrt(kFootprintVoxelVariance * xx + covariance + kFootprintPixelVariance),
          std::sqrt(kFootprintVoxelVariance * yy + covariance + kFootprintPixelVariance)};
}

}  // namespace slabstream
