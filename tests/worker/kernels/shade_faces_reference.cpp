#include "tests/worker/kernels/shade_faces_reference.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>

namespace slabstream::testing {
namespace {

// base^exponent for base in [0, 1], exponent in [1, 1000], within 2^-20 times max(1, -log2 of the power).
float PowerOfFractionFloat(float base, float exponent) {
  if (!(base > 0)) return 0;
  // base = m 2^e, m in [sqrt(1/2), sqrt(2)); ln m = 2 artanh(s), s = (m - 1) / (m + 1), |s| < 0.172: the series' error is below 2e-8.
  const auto bits = std::bit_cast<std::int32_t>(base);
  const std::int32_t e = (bits - 0x3F3504F3) >> 23;
  const auto m = std::bit_cast<float>(bits - (e << 23));
  const float s = (m - 1) / (m + 1), s2 = s * s;
  float series = 1.0F / 7;
  for (float coefficient : {1.0F / 5, 1.0F / 3, 1.0F}) series = series * s2 + coefficient;
  const float log2 = float(e) + (s * series) * float(2 / std::numbers::ln2);
  const float power = std::max(log2 * exponent, -126.0F);
  const float whole = std::floor(power + 0.5F), rest = (power - whole) * float(std::numbers::ln2);
  float result = 1.0F / 720;
  for (float coefficient : {1.0F / 120, 1.0F / 24, 1.0F / 6, 1.0F / 2, 1.0F, 1.0F}) result = result * rest + coefficient;
  return result * std::bit_cast<float>((int(whole) + 127) << 23);
}

struct Normal {
  float x, y, z;
};

Normal Unpack(std::uint32_t packed) {
  const auto component = [&](int bit) { return float(std::int32_t(packed << (32 - kNormalBits - bit)) >> (32 - kNormalBits)); };
  return {component(0), component(kNormalBits), component(2 * kNormalBits)};
}

Normal Blend(const Normal& a, const Normal& b, float t) { return {a.x + t * (b.x - a.x), a.y + t * (b.y - a.y), a.z + t * (b.z - a.z)}; }

float Dot(const Normal& n, const float (&v)[3]) { return (n.x * v[0] + n.y * v[1]) + n.z * v[2]; }

}  // namespace

void ShadeFaceRowReference(const FaceShading& shading, const std::uint64_t* keys, std::int32_t column, std::int32_t row, std::size_t count,
                           float* rgba, float* depth, std::uint32_t* voxel) {
  for (std::size_t n = 0; n < count; ++n) {
    depth[n] = std::bit_cast<float>(std::uint32_t(keys[n] >> 32));
    voxel[n] = 0;
    std::fill_n(rgba + 4 * n, 4, 0.0F);
    if (std::isinf(depth[n])) continue;
    const FaceSite& site = shading.sites[std::uint32_t(keys[n])];
    const FaceNormals& normals = shading.normals[std::uint32_t(keys[n])];
    const int axis = site.bin_and_side >> (kBinBits + 1);
    voxel[n] = FaceIndex(site.x, site.y, site.z, std::uint32_t(axis), shading.bricks_x, shading.bricks_y);

    float diffuse = shading.diffuse_without_normal, specular = 0;
    if (shading.phong) {
      const float px = float(column + std::int32_t(n)) + 0.5F, py = float(row) + 0.5F;
      const auto within_cell = [&](std::size_t i, std::uint16_t q) {
        const float origin = (shading.origin[i] + px * shading.origin_x[i]) + py * shading.origin_y[i];
        const float direction = (shading.direction[i] + px * shading.direction_x[i]) + py * shading.direction_y[i];
        return std::clamp(((origin + depth[n] * direction) - float(q)) + 0.5F, 0.0F, 1.0F);
      };
      const float u = axis == 0 ? within_cell(1, site.y) : within_cell(0, site.x);
      const float v = axis == 2 ? within_cell(1, site.y) : within_cell(2, site.z);
      Normal normal = Blend(Blend(Unpack(normals[0]), Unpack(normals[1]), u), Blend(Unpack(normals[2]), Unpack(normals[3]), u), v);
      const float square = (normal.x * normal.x + normal.y * normal.y) + normal.z * normal.z;
      if (square > 1) {
        const float per_length = 1 / std::sqrt(square);
        normal = {normal.x * per_length, normal.y * per_length, normal.z * per_length};
        const float n_v = Dot(normal, shading.to_viewer);
        float lit = 0, shine = 0;
        for (int i = 0; i < shading.light_count; ++i) {
          const float n_l = Dot(normal, shading.light[i]);
          lit += std::abs(n_l);
          shine += PowerOfFractionFloat(std::clamp((n_l + n_l) * n_v - shading.light_to_viewer[i], 0.0F, 1.0F), shading.shininess);
        }
        diffuse = shading.ambient + shading.diffuse * lit;
        specular = shading.specular * shine;
      }
    }
    const float* of_bin = shading.colors + 4 * std::size_t(site.bin_and_side & ((1U << kBinBits) - 1));
    for (std::size_t c = 0; c < 3; ++c) {
      float color = of_bin[c];
      if (shading.labels != nullptr) {
        const float* of_label = shading.label_colors + 4 * std::size_t{shading.labels[std::uint32_t(keys[n])]};
        color = color * (1 - of_label[3]) + of_label[c];
      }
      rgba[4 * n + c] = std::clamp(color * diffuse + specular, 0.0F, 1.0F);
    }
    rgba[4 * n + 3] = 1;
  }
}

}  // namespace slabstream::testing
