#include "worker/kernels/shade_faces.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "worker/kernels/shade_faces.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <hwy/cache_control.h>

#include <algorithm>
#include <array>

#include "common/view/phong.h"
#include "worker/kernels/draw_faces.h"
#include "worker/kernels/power-inl.h"
#include "worker/light/light_at-inl.h"

HWY_BEFORE_NAMESPACE();
namespace slabstream::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using FloatTag = hn::CappedTag<float, 16>;
using IntTag = hn::RebindToSigned<FloatTag>;
using UintTag = hn::RebindToUnsigned<FloatTag>;
using Floats = hn::Vec<FloatTag>;
using Uints = hn::Vec<UintTag>;

HWY_INLINE Floats Set(float value) { return hn::Set(FloatTag(), value); }

struct Normal {
  Floats x, y, z;
};

HWY_INLINE Normal Unpack(Uints packed) {
  const FloatTag df;
  const IntTag di;
  constexpr int kRight = 32 - kNormalBits;
  const auto bits = hn::BitCast(di, packed);
  return {hn::ConvertTo(df, hn::ShiftRight<kRight>(hn::ShiftLeft<kRight>(bits))),
          hn::ConvertTo(df, hn::ShiftRight<kRight>(hn::ShiftLeft<kRight - kNormalBits>(bits))),
          hn::ConvertTo(df, hn::ShiftRight<kRight>(hn::ShiftLeft<kRight - 2 * kNormalBits>(bits)))};
}

HWY_INLINE Normal Blend(const Normal& a, const Normal& b, Floats t) {
  const auto blend = [&](Floats p, Floats q) { return hn::Add(p, hn::Mul(t, hn::Sub(q, p))); };
  return {blend(a.x, b.x), blend(a.y, b.y), blend(a.z, b.z)};
}

HWY_INLINE Floats Dot(const Normal& n, const float (&v)[3]) {
  return hn::Add(hn::Add(hn::Mul(n.x, Set(v[0])), hn::Mul(n.y, Set(v[1]))), hn::Mul(n.z, Set(v[2])));
}

// Pixels that are shaded at once.
constexpr std::size_t kLanes = hn::MaxLanes(FloatTag());

// The face data of these pixels, pixel by pixel. Copied ahead of time: gathering by lane is several times as slow as copying whole records,
// and loading a register right after its parts were stored stalls.
struct Staged {
  alignas(64) std::array<FaceSite, kLanes> sites;
  alignas(64) std::array<FaceNormals, kLanes> normals;
  alignas(64) std::array<float, 4 * kLanes> colors;
};

HWY_INLINE bool IsEmpty(std::uint64_t key) { return key >> 32 == kEmptyKey >> 32; }

HWY_INLINE bool AllEmpty(const std::uint64_t* HWY_RESTRICT keys) {
  const UintTag du;
  Uints face, depth;
  hn::LoadInterleaved2(du, reinterpret_cast<const std::uint32_t*>(keys), face, depth);
  return hn::AllTrue(du, hn::Eq(depth, hn::Set(du, std::uint32_t(kEmptyKey >> 32))));
}

// For pixels that are not all empty; empty ones get any face.
template <bool kLabels>
HWY_INLINE void Stage(const FaceShading& shading, const std::uint64_t* HWY_RESTRICT keys, Staged& staged) {
  for (std::size_t i = 0; i < kLanes; ++i) {
    const std::size_t face = IsEmpty(keys[i]) ? 0 : std::uint32_t(keys[i]);
    staged.sites[i] = shading.sites[face];
    staged.normals[i] = shading.normals[face];
    const std::size_t bin = shading.sites[face].bin_and_side & ((1U << kBinBits) - 1);
    if constexpr (kLabels) {
      const float* of_bin = shading.colors + 4 * bin;
      const float* of_label = shading.label_colors + 4 * std::size_t{shading.labels[face]};
      for (std::size_t c = 0; c < 4; ++c) staged.colors[4 * i + c] = of_bin[c] * (1 - of_label[3]) + of_label[c];
    } else {
      std::copy_n(shading.colors + 4 * bin, 4, &staged.colors[4 * i]);
    }
  }
}

// Prefetches: neighbouring pixels may see faces that are far apart in memory. When a pixel is staged, its face has arrived.
HWY_INLINE void FetchFaces(const FaceShading& shading, const std::uint64_t* HWY_RESTRICT keys) {
  for (std::size_t i = 0; i < kLanes; ++i) {
    if (IsEmpty(keys[i])) continue;
    hwy::Prefetch(shading.sites + std::uint32_t(keys[i]));
    hwy::Prefetch(shading.normals + std::uint32_t(keys[i]));
  }
}

// Shadows and ambient occlusion on the points that pixels see.
class LightOnPixels {
 public:
  // hit(axis): the points' positions, finite where `seen`.
  template <class Hit>
  HWY_INLINE LightOnPixels(const FaceShading& shading, hn::Mask<FloatTag> seen, Hit&& hit) : shading_(shading) {
    if (!any()) return;
    const auto position = [&](std::size_t i) HWY_ATTR { return hn::IfThenElseZero(seen, hit(i)); };
    place_ = PlaceInLight(FloatTag(), *shading.frame_light, position(0), position(1), position(2));
    first_ = SharesAt(FloatTag(), *shading.frame_light, place_, 0);
  }

  bool any() const { return shading_.frame_light != nullptr; }
  // The others need any().
  HWY_INLINE Floats open() const { return first_.open; }
  HWY_INLINE Floats Reached(int light) const {
    return light == 0 || shading_.frame_light->lights == 1 ? first_.reached
                                                           : SharesAt(FloatTag(), *shading_.frame_light, place_, light).reached;
  }
  // Of pixels without a normal: |N.L| is 1/2 on average. If nothing is lit: the mean of the lights.
  HWY_INLINE Floats WithoutNormal() const {
    auto sum = hn::Zero(FloatTag());
    for (int i = 0; i < shading_.light_count; ++i) sum = hn::Add(sum, Reached(i));
    const float ambient = shading_.phong ? shading_.ambient : 0;
    const float each = shading_.phong ? shading_.diffuse * 0.5F : 1 / float(shading_.light_count);
    return hn::Mul(first_.open, hn::Add(Set(ambient), hn::Mul(Set(each), sum)));
  }

 private:
  const FaceShading& shading_;
  LightPlace<FloatTag> place_;
  LightShares<FloatTag> first_;
};

HWY_INLINE void ShadePixels(const FaceShading& shading, const std::uint64_t* HWY_RESTRICT keys, const Staged& staged, std::int32_t column,
                            std::int32_t row, float* HWY_RESTRICT rgba, float* HWY_RESTRICT depth_out,
                            std::uint32_t* HWY_RESTRICT voxel_out) {
  const FloatTag df;
  const IntTag di;
  const UintTag du;
  Uints face, depth_bits;
  hn::LoadInterleaved2(du, reinterpret_cast<const std::uint32_t*>(keys), face, depth_bits);
  const auto is_empty = hn::Eq(depth_bits, hn::Set(du, std::uint32_t(kEmptyKey >> 32)));
  if (hn::AllTrue(du, is_empty)) {
    for (std::size_t c = 0; c < 4; ++c) hn::StoreU(hn::Zero(df), df, rgba + c * hn::Lanes(df));
    hn::StoreU(hn::BitCast(df, depth_bits), df, depth_out);
    hn::StoreU(hn::Zero(du), du, voxel_out);
    return;
  }
  const auto seen = hn::Not(hn::RebindMask(df, is_empty));
  const auto depth = hn::BitCast(df, depth_bits);
  hn::StoreU(depth, df, depth_out);

  Uints xy, rest;
  hn::LoadInterleaved2(du, reinterpret_cast<const std::uint32_t*>(staged.sites.data()), xy, rest);
  const auto low = hn::Set(du, 0xFFFF);
  const auto x = hn::And(xy, low), y = hn::ShiftRight<16>(xy), z = hn::And(rest, low);
  const auto axis = hn::ShiftRight<16 + kBinBits + 1>(rest);

  const auto one = hn::Set(du, 1), seven = hn::Set(du, 7);
  auto index = hn::Add(hn::Mul(hn::ShiftRight<4>(z), hn::Set(du, shading.bricks_y)), hn::ShiftRight<4>(y));
  index = hn::Add(hn::Mul(index, hn::Set(du, shading.bricks_x)), hn::ShiftRight<4>(x));
  index = hn::Or(hn::ShiftLeft<2>(index), axis);
  const auto append_parity = [&](Uints position) { index = hn::Or(hn::ShiftLeft<1>(index), hn::And(position, one)); };
  const auto append_rest = [&](Uints position) { index = hn::Or(hn::ShiftLeft<3>(index), hn::And(hn::ShiftRight<1>(position), seven)); };
  append_parity(z);
  append_parity(y);
  append_parity(x);
  append_rest(z);
  append_rest(y);
  append_rest(x);
  hn::StoreU(hn::IfThenZeroElse(is_empty, index), du, voxel_out);

  // Depths of empty pixels are infinite; their results are not used.
  const auto px = hn::Add(hn::Iota(df, float(column)), Set(0.5F)), py = Set(float(row) + 0.5F);
  const auto hit = [&](std::size_t i) {
    const auto origin =
        hn::Add(hn::Add(Set(shading.origin[i]), hn::Mul(px, Set(shading.origin_x[i]))), hn::Mul(py, Set(shading.origin_y[i])));
    const auto direction =
        hn::Add(hn::Add(Set(shading.direction[i]), hn::Mul(px, Set(shading.direction_x[i]))), hn::Mul(py, Set(shading.direction_y[i])));
    return hn::Add(origin, hn::Mul(depth, direction));
  };
  const LightOnPixels light(shading, seen, hit);
  auto diffuse = Set(shading.diffuse_without_normal), specular = hn::Zero(df);
  if (light.any()) diffuse = light.WithoutNormal();
  if (shading.phong) {
    // The point's position in its cell, 0 ... 1.
    const auto within_cell = [&](std::size_t i, Uints voxel) {
      const auto t = hn::Add(hn::Sub(hit(i), hn::ConvertTo(df, hn::BitCast(di, voxel))), Set(0.5F));
      return hn::IfThenElseZero(seen, hn::Min(hn::Max(t, hn::Zero(df)), Set(1)));
    };
    const auto in_x = within_cell(0, x), in_y = within_cell(1, y), in_z = within_cell(2, z);
    const auto u = hn::IfThenElse(hn::RebindMask(df, hn::Eq(axis, hn::Zero(du))), in_y, in_x);
    const auto v = hn::IfThenElse(hn::RebindMask(df, hn::Eq(axis, hn::Set(du, 2))), in_y, in_z);

    Uints corner[4];
    hn::LoadInterleaved4(du, staged.normals.data()->data(), corner[0], corner[1], corner[2], corner[3]);
    Normal n = Blend(Blend(Unpack(corner[0]), Unpack(corner[1]), u), Blend(Unpack(corner[2]), Unpack(corner[3]), u), v);
    const auto square = hn::Add(hn::Add(hn::Mul(n.x, n.x), hn::Mul(n.y, n.y)), hn::Mul(n.z, n.z));
    const auto has_normal = hn::Gt(square, Set(1));
    const auto per_length = hn::Div(Set(1), hn::Sqrt(hn::IfThenElse(has_normal, square, Set(1))));
    n = {hn::Mul(n.x, per_length), hn::Mul(n.y, per_length), hn::Mul(n.z, per_length)};

    const auto n_v = Dot(n, shading.to_viewer);
    auto lit = hn::Zero(df), shine = hn::Zero(df);
    for (int i = 0; i < shading.light_count; ++i) {
      const auto n_l = Dot(n, shading.light[i]);
      const auto r_v = hn::Sub(hn::Mul(hn::Add(n_l, n_l), n_v), Set(shading.light_to_viewer[i]));
      auto facing = hn::Abs(n_l), shines = PowerOfFraction(hn::Min(hn::Max(r_v, hn::Zero(df)), Set(1)), Set(shading.shininess));
      if (light.any()) {
        const auto reached = light.Reached(i);
        facing = hn::Mul(facing, reached);
        shines = hn::Mul(shines, reached);
      }
      lit = hn::Add(lit, facing);
      shine = hn::Add(shine, shines);
    }
    auto of_normal = hn::Add(Set(shading.ambient), hn::Mul(Set(shading.diffuse), lit));
    if (light.any()) of_normal = hn::Mul(light.open(), of_normal);
    diffuse = hn::IfThenElse(has_normal, of_normal, diffuse);
    specular = hn::IfThenElseZero(has_normal, hn::Mul(Set(shading.specular), shine));
  }

  Floats red, green, blue, unused;
  hn::LoadInterleaved4(df, staged.colors.data(), red, green, blue, unused);
  const auto channel = [&](Floats color) {
    const auto value = hn::Add(hn::Mul(color, diffuse), specular);
    return hn::IfThenElseZero(seen, hn::Min(hn::Max(value, hn::Zero(df)), Set(1)));
  };
  hn::StoreInterleaved4(channel(red), channel(green), channel(blue), hn::IfThenElseZero(seen, Set(1)), df, rgba);
}

template <bool kLabels>
HWY_INLINE void ShadeRowOf(const FaceShading& shading, const std::uint64_t* keys, std::int32_t column, std::int32_t row, std::size_t count,
                           float* rgba, float* depth, std::uint32_t* voxel) {
  // The last pixels go through a buffer: keys after the row are meaningless, and nothing may be written there.
  const std::size_t whole = count / kLanes * kLanes;
  alignas(64) std::array<std::uint64_t, kLanes> last_keys;
  last_keys.fill(kEmptyKey);
  std::copy(keys + whole, keys + count, last_keys.begin());
  const auto keys_at = [&](std::size_t n) { return n < whole ? keys + n : last_keys.data(); };

  constexpr std::size_t kAhead = 3 * kLanes;  // pixels
  std::array<Staged, 2> staged;
  const auto stage = [&](std::size_t n) {
    if (!AllEmpty(keys_at(n))) Stage<kLabels>(shading, keys_at(n), staged[n / kLanes % 2]);
  };
  stage(0);
  for (std::size_t n = 0; n < whole; n += kLanes) {
    if (n + kAhead < whole) FetchFaces(shading, keys + n + kAhead);
    stage(n + kLanes);
    ShadePixels(shading, keys + n, staged[n / kLanes % 2], column + std::int32_t(n), row, rgba + 4 * n, depth + n, voxel + n);
  }
  if (whole == count) return;
  alignas(64) std::array<float, 4 * kLanes> last_rgba;
  alignas(64) std::array<float, kLanes> last_depth;
  alignas(64) std::array<std::uint32_t, kLanes> last_voxel;
  ShadePixels(shading, last_keys.data(), staged[whole / kLanes % 2], column + std::int32_t(whole), row, last_rgba.data(), last_depth.data(),
              last_voxel.data());
  std::copy_n(last_rgba.begin(), 4 * (count - whole), rgba + 4 * whole);
  std::copy_n(last_depth.begin(), count - whole, depth + whole);
  std::copy_n(last_voxel.begin(), count - whole, voxel + whole);
}

void ShadeRow(const FaceShading& shading, const std::uint64_t* keys, std::int32_t column, std::int32_t row, std::size_t count, float* rgba,
              float* depth, std::uint32_t* voxel) {
  if (shading.labels != nullptr) {
    ShadeRowOf<true>(shading, keys, column, row, count, rgba, depth, voxel);
  } else {
    ShadeRowOf<false>(shading, keys, column, row, count, rgba, depth, voxel);
  }
}

}  // namespace slabstream::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace slabstream {
namespace {

void Copy(const Vec3& from, float (&to)[3]) {
  for (int i = 0; i < 3; ++i) to[i] = float(from[i]);
}

}  // namespace

FaceShading MakeFaceShading(const Camera& camera, const Shading& shading, const Index3& volume_size) {
  FaceShading out;
  const Camera::Ray first = camera.RayAt(0, 0), right = camera.RayAt(camera.width, 0), down = camera.RayAt(0, camera.height);
  Copy(first.origin, out.origin);
  Copy((1.0 / camera.width) * (right.origin - first.origin), out.origin_x);
  Copy((1.0 / camera.height) * (down.origin - first.origin), out.origin_y);
  Copy(first.direction, out.direction);
  Copy((1.0 / camera.width) * (right.direction - first.direction), out.direction_x);
  Copy((1.0 / camera.height) * (down.direction - first.direction), out.direction_y);

  const Vec3 to_viewer = -camera.view_direction;
  Copy(to_viewer, out.to_viewer);
  out.phong = shading.model == ShadingModel::kPhong;
  const Phong phong(shading, camera.view_direction);
  for (const Vec3& light : phong.lights()) {
    Copy(light, out.light[out.light_count]);
    out.light_to_viewer[out.light_count++] = float(Dot(light, to_viewer));
  }
  const auto [ambient, diffuse, specular, shininess] = shading.On();
  out.ambient = ambient;
  out.diffuse = diffuse;
  out.specular = specular;
  out.shininess = shininess;
  // |N.L| is 1/2 on average over all directions of N.
  if (out.phong) out.diffuse_without_normal = ambient + diffuse * 0.5F * float(out.light_count);
  out.bricks_x = std::uint32_t(volume_size.x + kFaceBrick - 1) / kFaceBrick;
  out.bricks_y = std::uint32_t(volume_size.y + kFaceBrick - 1) / kFaceBrick;
  return out;
}

HWY_EXPORT(ShadeRow);

void ShadeFaceRow(const FaceShading& shading, const std::uint64_t* keys, std::int32_t column, std::int32_t row, std::size_t count,
                  float* rgba, float* depth, std::uint32_t* voxel) {
  HWY_DYNAMIC_DISPATCH(ShadeRow)(shading, keys, column, row, count, rgba, depth, voxel);
}

}  // namespace slabstream
#endif
