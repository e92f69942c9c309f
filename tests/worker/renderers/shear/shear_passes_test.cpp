// The decomposition of views into one-dimensional passes.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "worker/renderers/shear/cubic_kernel.h"
#include "worker/renderers/shear/shear_passes.h"

namespace slabstream::shear {
namespace {

constexpr unsigned kSeed = 41;

struct View {
  Vec3 start, right, down, forward;
};

// The columns of a rotation: a random unit quaternion.
View RandomRotation(std::mt19937& random) {
  std::normal_distribution<double> normal;
  double q[4];
  for (double& part : q) part = normal(random);
  const double length = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  const double w = q[0] / length, x = q[1] / length, y = q[2] / length, z = q[3] / length;
  return {{5 * normal(random), 5 * normal(random), 5 * normal(random)},
          {1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)},
          {2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)},
          {2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)}};
}

Vec3 PlaceOf(const View& view, double u, double v, double k, bool turned) {
  return view.start + u * (turned ? view.down : view.right) + v * (turned ? view.right : view.down) + k * view.forward;
}

// Each pass finds the coordinate that it resamples from those that are there at the time.
void ExpectProductIsTheView(const View& view, const ShearPasses& passes, std::mt19937& random) {
  std::uniform_real_distribution<double> uniform(-100, 100);
  for (int i = 0; i < 5; ++i) {
    const double u = uniform(random), v = uniform(random), k = uniform(random);
    const Vec3 p = PlaceOf(view, u, v, k, passes.turned);
    const double x = p[passes.axes[0]], y = p[passes.axes[1]], z = p[passes.axes[2]];
    const double slack = 1e-9 * (1 + std::abs(x) + std::abs(y) + std::abs(z));
    EXPECT_NEAR(passes.x_u * u + passes.x_y * y + passes.x_z * z + passes.x_0, x, slack);
    EXPECT_NEAR(passes.y_u * u + passes.y_v * v + passes.y_z * z + passes.y_0, y, slack);
    EXPECT_NEAR(passes.z_k, view.forward[passes.axes[2]], 0);
  }
}

void ExpectNoBottleneck(const ShearPasses& passes) {
  EXPECT_LE(std::abs(passes.slide_x), 1 + 1e-12);
  EXPECT_LE(std::abs(passes.slide_y), 1 + 1e-12);
  EXPECT_LE(std::abs(passes.x_y), 1 + 1e-12);
}

// Samples a voxel in the volume after pass 1 and pass 2, relative to the smaller one of the volume and the result.
double Bottleneck(const ShearPasses& passes) {
  const double first = 1 / std::abs(passes.x_u), second = first / std::abs(passes.y_v), third = second / std::abs(passes.z_k);
  return std::min(first, second) / std::min(1.0, third);
}

TEST(ShearPasses, MultiplyBackToRotationsWithoutABottleneck) {
  std::mt19937 random(kSeed);
  double worst = 1;
  for (int i = 0; i < 20000; ++i) {
    SCOPED_TRACE(::testing::Message() << "seed " << kSeed << " rotation " << i);
    const View view = RandomRotation(random);
    const ShearPasses passes = MakeShearPasses(view.start, view.right, view.down, view.forward);
    ExpectProductIsTheView(view, passes, random);
    ExpectNoBottleneck(passes);
    worst = std::min(worst, Bottleneck(passes));
    if (HasFailure()) return;
  }
  EXPECT_GT(worst, 0.5);
  RecordProperty("bottleneck", std::to_string(worst));
}

TEST(ShearPasses, MultiplyBackToScaledAndStretchedViews) {
  std::mt19937 random(kSeed);
  std::uniform_real_distribution<double> exponent(-3, 3);
  for (int i = 0; i < 5000; ++i) {
    SCOPED_TRACE(::testing::Message() << "seed " << kSeed << " view " << i);
    View view = RandomRotation(random);
    const double pixel = std::exp2(exponent(random)), step = std::exp2(exponent(random));
    const Vec3 spacing = {std::exp2(exponent(random)), std::exp2(exponent(random)), std::exp2(exponent(random))};
    view.right = pixel * view.right / spacing;
    view.down = pixel * view.down / spacing;
    view.forward = step * view.forward / spacing;
    const ShearPasses passes = MakeShearPasses(view.start, view.right, view.down, view.forward);
    ExpectProductIsTheView(view, passes, random);
    ExpectNoBottleneck(passes);
    if (HasFailure()) return;
  }
}

// About each axis by multiples of 45 degrees, and a hair beside.
TEST(ShearPasses, HaveNoBottleneckNearDegenerateRotations) {
  std::mt19937 random(kSeed);
  for (int axis = 0; axis < 3; ++axis) {
    for (int eighths = 0; eighths < 8; ++eighths) {
      for (const double beside : {0.0, 1e-12, -1e-12, 1e-6, -1e-6}) {
        SCOPED_TRACE(::testing::Message() << "axis " << axis << " by " << 45 * eighths << " degrees and " << beside);
        const double angle = std::numbers::pi / 4 * eighths + beside, c = std::cos(angle), s = std::sin(angle);
        View view;
        Vec3* const columns[3] = {&view.right, &view.down, &view.forward};
        (*columns[axis])[axis] = 1;
        Vec3 &a = *columns[(axis + 1) % 3], &b = *columns[(axis + 2) % 3];
        a[(axis + 1) % 3] = c;
        a[(axis + 2) % 3] = s;
        b[(axis + 1) % 3] = -s;
        b[(axis + 2) % 3] = c;
        const ShearPasses passes = MakeShearPasses(view.start, view.right, view.down, view.forward);
        ExpectProductIsTheView(view, passes, random);
        ExpectNoBottleneck(passes);
        EXPECT_GE(Bottleneck(passes), std::numbers::sqrt2 / 2 - 1e-5);
      }
    }
  }
}

TEST(CubicKernel, ReconstructsPolynomials) {
  const auto weights = [](const CubicKernel& kernel, double t) {
    const auto at = [&](const std::array<float, 4>& c) {
      return double(c[0]) + t * (double(c[1]) + t * (double(c[2]) + t * double(c[3])));
    };
    std::array<double, 4> w = {at(kernel.before), at(kernel.at), 0, at(kernel.behind)};
    w[2] = 1 - w[0] - w[1] - w[3];
    return w;
  };
  for (const Kernel kind : {Kernel::kCatmullRom, Kernel::kMitchell, Kernel::kBSpline, Kernel::kLinear}) {
    const CubicKernel kernel = MakeCubicKernel(kind);
    for (double t = 0; t < 1; t += 1.0 / 16) {
      const auto w = weights(kernel, t), mirrored = weights(kernel, 1 - t);
      double linear = 0, square = 0;
      for (int i = 0; i < 4; ++i) {
        EXPECT_NEAR(w[std::size_t(i)], mirrored[std::size_t(3 - i)], 1e-6);
        linear += w[std::size_t(i)] * (i - 1);
        square += w[std::size_t(i)] * (i - 1) * (i - 1);
      }
      EXPECT_NEAR(linear, t, 1e-6);  // all four reconstruct lines
      if (kind == Kernel::kCatmullRom) {
        EXPECT_NEAR(square, t * t, 1e-6);
      }
    }
  }
}

}  // namespace
}  // namespace slabstream::shear
