// Voxel coordinates of splatting, from the camera to the transform stage, against a matrix product in double precision.
#include <gtest/gtest.h>

#include <cmath>
#include <iostream>
#include <random>

#include "tests/render/render_support.h"
#include "worker/kernels/transform.h"
#include "worker/render/splatting/cell_piece.h"

namespace slabstream {
namespace {

using namespace slabstream::testing;  // NOLINT(google-build-using-namespace): test support

double Apply(const std::array<double, 4>& row, const Vec3& p) { return row[0] * p.x + row[1] * p.y + row[2] * p.z + row[3]; }

// The bound of transform.h, which does not grow with the volume.
TEST(Coordinates, KeepTheirErrorBoundInLargeVolumes) {
  const unsigned seed = 41;
  std::mt19937 random(seed);
  // Phases so fine that they tell the position itself, within kResolution.
  GaussianKernel kernel = MakeGaussianKernel(0.7);
  kernel.phases = 1 << 20;
  const double kResolution = std::ldexp(0.5, -20);
  for (Projection projection : {Projection::kOrthographic, Projection::kPerspective}) {
    for (std::int32_t side : {1024, 4096}) {
      double worst = 0;  // error by bound
      for (int view = 0; view < 20; ++view) {
        const VolumeGeometry geometry = {{side, side, side}, {1, 1, 1}};
        const Camera camera = MakeCamera(RandomView(projection, random), {side, side}, geometry);
        const SliceProjection slices(camera, geometry);
        const auto [c, u, v] = slices.axes();
        VoxelBatch batch;
        std::vector<Index3> firsts;
        std::vector<VoxelRecord> records(kFootprintCell);
        while (batch.voxel_count + kFootprintCell <= VoxelBatch::kVoxels) {
          Index3 first;
          first[c] = std::int32_t(random() % unsigned(side));
          first[v] = std::int32_t(random() % unsigned(side));
          first[u] = std::int32_t(random() % unsigned(side / kFootprintCell)) * kFootprintCell;
          BeamPiece piece = CellPiece(slices.At(first[u], first[v], first[c]), slices.step_u(), {&kernel, &kernel});
          piece.mask = 0xFFFFFFFF;
          piece.count = kFootprintCell;
          piece.records = records.data();
          batch.pieces.push_back(piece);
          batch.voxel_count += kFootprintCell;
          firsts.push_back(first);
        }
        TransformPieces(projection, batch);
        for (std::size_t n = 0; n < batch.voxel_count; ++n) {
          Index3 voxel = firsts[n / kFootprintCell];
          voxel[u] += std::int32_t(n % kFootprintCell);
          const double w = Apply(camera.w_row, ToVec3(voxel));
          const double x = Apply(camera.x_row, ToVec3(voxel)) / w, y = Apply(camera.y_row, ToVec3(voxel)) / w;
          const auto along_u = std::size_t(Number(u));
          const double voxel_pixels =
              std::hypot(camera.x_row[along_u] - x * camera.w_row[along_u], camera.y_row[along_u] - y * camera.w_row[along_u]) / w;
          const double bound = std::ldexp(1.0, -21) * kFootprintCell * voxel_pixels;
          const auto check = [&](double at, std::int32_t first_tap, std::int32_t phase) {
            const double t = at - 0.5 - kernel.radius;  // gaussian_kernel.h
            const double got = first_tap - 1 + (phase + 0.5) / kernel.phases;
            worst = std::max(worst, (std::abs(got - t) - kResolution) / bound);
          };
          check(x, batch.column[n], batch.phase_x[n]);
          check(y, batch.row[n], batch.phase_y[n]);
        }
      }
      EXPECT_LE(worst, 1) << "seed " << seed << " side " << side;
      std::cout << "largest error by bound, " << side << " voxels a side: " << worst << '\n';
    }
  }
}

}  // namespace
}  // namespace slabstream
