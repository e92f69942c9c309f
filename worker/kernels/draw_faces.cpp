#include "worker/kernels/draw_faces.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "worker/kernels/draw_faces.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <hwy/cache_control.h>

#include <algorithm>
#include <bit>
#include <limits>

HWY_BEFORE_NAMESPACE();
namespace slabstream::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using FloatTag = hn::CappedTag<float, 16>;  // lanes are faces
using IntTag = hn::RebindToSigned<FloatTag>;
using UintTag = hn::RebindToUnsigned<FloatTag>;
constexpr std::size_t kMostFaces = hn::MaxLanes(FloatTag());

// A vector of faces, ready to be drawn: the pixels to visit, clipped to the band, and the values at the leftmost and topmost pixel that the
// face can touch, inside the band or not.
struct FaceBatch {
  alignas(64) std::int32_t right[kMostFaces], below[kMostFaces];   // columns and rows from that pixel to the first visited one
  alignas(64) std::int32_t columns[kMostFaces], rows[kMostFaces];  // visited
  alignas(64) std::int32_t key[kMostFaces];                        // of the first visited pixel
  alignas(64) float u[kMostFaces], v[kMostFaces], depth[kMostFaces];
  // Perspective.
  alignas(64) float divisor[kMostFaces], u_x[kMostFaces], u_y[kMostFaces], v_x[kMostFaces], v_y[kMostFaces], slope_x[kMostFaces],
      slope_y[kMostFaces];
};

// Fills the batch and returns the lanes whose faces may touch pixels of the band, as bits.
template <bool kPerspective>
HWY_INLINE std::uint32_t PlaceFaces(const FaceProjection& faces, const FaceSite* sites, std::size_t count, const KeyBand& band,
                                    FaceBatch& batch) {
  const FloatTag df;
  const IntTag di;
  const UintTag du;
  const auto set = [&](float value) { return hn::Set(df, value); };
  hn::Vec<UintTag> xy, z_and_rest;
  hn::LoadInterleaved2(du, reinterpret_cast<const std::uint32_t*>(sites), xy, z_and_rest);
  const auto local = [&](auto shifted) { return hn::ConvertTo(df, hn::BitCast(di, hn::And(shifted, hn::Set(du, 15)))); };
  const auto i = local(xy), j = local(hn::ShiftRight<16>(xy)), k = local(z_and_rest);
  const auto linear = [&](const float(&step)[3]) {
    return hn::Add(hn::Add(hn::Mul(i, set(step[0])), hn::Mul(j, set(step[1]))), hn::Mul(k, set(step[2])));
  };
  const auto depth = hn::Add(set(faces.depth), linear(faces.depth_step));
  auto x = linear(faces.x_step), y = linear(faces.y_step);
  if constexpr (kPerspective) {
    const auto per_depth = hn::Div(set(1), depth);
    x = hn::Mul(x, per_depth);
    y = hn::Mul(y, per_depth);
  }
  x = hn::Add(set(faces.x_phase), x);
  y = hn::Add(set(faces.y_phase), y);

  const auto left = hn::Ceil(hn::Sub(x, set(faces.half_width))), top = hn::Ceil(hn::Sub(y, set(faces.half_height)));
  const auto one = hn::Set(di, 1);
  const auto first_column = hn::ConvertTo(di, left), first_row = hn::ConvertTo(di, top);
  const auto end_column = hn::Add(hn::ConvertTo(di, hn::Floor(hn::Add(x, set(faces.half_width)))), one);
  const auto end_row = hn::Add(hn::ConvertTo(di, hn::Floor(hn::Add(y, set(faces.half_height)))), one);
  const PixelBounds& clip = band.bounds;
  const auto column = hn::Max(first_column, hn::Set(di, clip.x_begin - faces.column));
  const auto row = hn::Max(first_row, hn::Set(di, clip.y_begin - faces.row));
  const auto columns = hn::Sub(hn::Min(end_column, hn::Set(di, clip.x_end - faces.column)), column);
  const auto rows = hn::Sub(hn::Min(end_row, hn::Set(di, clip.y_end - faces.row)), row);
  auto visible = hn::And(hn::Gt(hn::Min(columns, rows), hn::Zero(di)), hn::RebindMask(di, hn::FirstN(di, count)));
  const auto band_row = hn::Add(row, hn::Set(di, faces.row - clip.y_begin));
  const auto band_column = hn::Add(column, hn::Set(di, faces.column - clip.x_begin));
  hn::Store(hn::Sub(column, first_column), di, batch.right);
  hn::Store(hn::Sub(row, first_row), di, batch.below);
  hn::Store(columns, di, batch.columns);
  hn::Store(rows, di, batch.rows);
  hn::Store(hn::Add(hn::Mul(band_row, hn::Set(di, std::int32_t(band.stride))), band_column), di, batch.key);

  const auto dx = hn::Sub(left, x), dy = hn::Sub(top, y);
  const auto at = [&](auto along_x, auto along_y) { return hn::Add(hn::Mul(dx, along_x), hn::Mul(dy, along_y)); };
  if constexpr (kPerspective) {
    const auto index = [&](int axis) { return axis == 0 ? i : axis == 1 ? j : k; };
    const auto eye_a = hn::Add(set(faces.eye_a), index(faces.a));
    const auto eye_u = hn::Add(set(faces.eye_u), index(faces.u)), eye_v = hn::Add(set(faces.eye_v), index(faces.v));
    visible = hn::And(visible, hn::RebindMask(di, hn::Lt(hn::Mul(set(faces.sign), eye_a), hn::Zero(df))));
    // The ray through the centre has direction (eye_a, eye_u, eye_v) / depth; the ray one pixel aside meets the plane nearer or farther by
    // the slope.
    const auto per_ray_a = hn::Div(depth, eye_a);
    const auto slope_x = hn::Mul(set(faces.ray_x_a), per_ray_a), slope_y = hn::Mul(set(faces.ray_y_a), per_ray_a);
    const auto u_x = hn::Sub(hn::Mul(depth, set(faces.ray_x_u)), hn::Mul(slope_x, eye_u));
    const auto u_y = hn::Sub(hn::Mul(depth, set(faces.ray_y_u)), hn::Mul(slope_y, eye_u));
    const auto v_x = hn::Sub(hn::Mul(depth, set(faces.ray_x_v)), hn::Mul(slope_x, eye_v));
    const auto v_y = hn::Sub(hn::Mul(depth, set(faces.ray_y_v)), hn::Mul(slope_y, eye_v));
    hn::Store(at(u_x, u_y), df, batch.u);
    hn::Store(at(v_x, v_y), df, batch.v);
    hn::Store(depth, df, batch.depth);
    hn::Store(hn::Add(set(1), at(slope_x, slope_y)), df, batch.divisor);
    hn::Store(u_x, df, batch.u_x);
    hn::Store(u_y, df, batch.u_y);
    hn::Store(v_x, df, batch.v_x);
    hn::Store(v_y, df, batch.v_y);
    hn::Store(slope_x, df, batch.slope_x);
    hn::Store(slope_y, df, batch.slope_y);
  } else {
    hn::Store(at(set(faces.u_x), set(faces.u_y)), df, batch.u);
    hn::Store(at(set(faces.v_x), set(faces.v_y)), df, batch.v);
    hn::Store(hn::Add(depth, at(set(faces.depth_x), set(faces.depth_y))), df, batch.depth);
  }
  std::uint8_t bits[8] = {};
  hn::StoreMaskBits(di, visible, bits);
  return std::uint32_t(bits[0]) | std::uint32_t(bits[1]) << 8;
}

// Lanes are pixels of a row: as many as keys fit into a register, but at most kMostPixels.
template <std::size_t kMostPixels>
struct RowTags {
  using Key = hn::CappedTag<std::uint64_t, kMostPixels>;
  using Depth = hn::Rebind<float, Key>;
  using Bits = hn::Rebind<std::uint32_t, Key>;
};

template <class V, class M>
HWY_INLINE V DepthWhere(M hit, V depth) {
  return hn::IfThenElse(hit, depth, hn::Set(hn::DFromV<V>(), std::numeric_limits<float>::infinity()));
}

// Takes the face's keys where they are less: nowhere at infinite depths. `keys` points into the band's.
template <class Tags, bool kClipped, class V>
HWY_INLINE void Merge(V depth, std::uint32_t face, std::uint64_t* HWY_RESTRICT keys, const KeyBand& band) {
  const typename Tags::Key dk;
  if constexpr (kClipped) {
    const typename Tags::Depth df;
    const std::ptrdiff_t at = keys - band.keys;
    const auto inside = hn::And(hn::Ge(depth, hn::LoadU(df, band.limits.from + at)), hn::Le(depth, hn::LoadU(df, band.limits.to + at)));
    depth = DepthWhere(band.limits.inside ? inside : hn::Not(inside), depth);
  }
  const auto key = hn::Or(hn::ShiftLeft<32>(hn::PromoteTo(dk, hn::BitCast(typename Tags::Bits(), depth))), hn::Set(dk, face));
  hn::StoreU(hn::Min(key, hn::LoadU(dk, keys)), dk, keys);
}

// Any face of a batch.
template <bool kPerspective, bool kClipped>
HWY_INLINE void DrawFace(const FaceProjection& faces, const FaceBatch& batch, std::size_t n, std::uint32_t face, const KeyBand& band) {
  using Tags = RowTags<8>;
  const Tags::Depth df;
  const auto lanes = std::int32_t(hn::Lanes(df));
  const auto u0 = hn::Set(df, batch.u[n]), v0 = hn::Set(df, batch.v[n]), depth0 = hn::Set(df, batch.depth[n]);
  const auto reach = hn::Set(df, kFaceReach);
  for (std::int32_t column = 0; column < batch.columns[n]; column += lanes) {
    const hn::RebindToSigned<Tags::Depth> di;
    const auto right = hn::ConvertTo(df, hn::Add(hn::Set(di, batch.right[n] + column), hn::Iota(di, 0)));
    const auto from_left = [&](float along_x) { return hn::Mul(right, hn::Set(df, along_x)); };
    const auto u_left = from_left(kPerspective ? batch.u_x[n] : faces.u_x), v_left = from_left(kPerspective ? batch.v_x[n] : faces.v_x);
    const auto depth_left = from_left(kPerspective ? batch.slope_x[n] : faces.depth_x);
    std::uint64_t* keys = band.keys + batch.key[n] + column;
    for (std::int32_t row = 0; row < batch.rows[n]; ++row, keys += band.stride) {
      const auto below = hn::Set(df, float(batch.below[n] + row));
      const auto at = [&](auto from_here, float along_y) { return hn::Add(from_here, hn::Mul(below, hn::Set(df, along_y))); };
      if constexpr (kPerspective) {
        const auto u = hn::Add(u0, at(u_left, batch.u_y[n])), v = hn::Add(v0, at(v_left, batch.v_y[n]));
        const auto divisor = hn::Add(hn::Set(df, batch.divisor[n]), at(depth_left, batch.slope_y[n]));
        const auto hit = hn::Lt(hn::Max(hn::Abs(u), hn::Abs(v)), hn::Mul(reach, divisor));
        Merge<Tags, kClipped>(DepthWhere(hit, hn::Div(depth0, divisor)), face, keys, band);
      } else {
        const auto u = hn::Add(u0, at(u_left, faces.u_y)), v = hn::Add(v0, at(v_left, faces.v_y));
        const auto hit = hn::Lt(hn::Max(hn::Abs(u), hn::Abs(v)), reach);
        Merge<Tags, kClipped>(DepthWhere(hit, hn::Add(depth0, at(depth_left, faces.depth_y))), face, keys, band);
      }
    }
  }
}

// Small faces: at most 4 x 4 pixels, all computed at once. `u`, `v` and `depth` are each pixel's offsets from the values at the leftmost
// and topmost one, the same for all faces of an orthographic view.
constexpr std::int32_t kStampSide = 4;
constexpr std::int32_t kStampPixels = kStampSide * kStampSide;

struct Stamp {
  explicit Stamp(const FaceProjection& faces) {
    for (std::int32_t i = 0; i < kStampPixels; ++i) {
      const std::int32_t row = i / kStampSide;
      right[i] = float(i % kStampSide);
      below[i] = float(row);
    }
    const FloatTag df;
    for (std::size_t i = 0; i < kStampPixels; i += hn::Lanes(df)) {
      const auto at = [&](float along_x, float along_y) {
        return hn::Add(hn::Mul(hn::Load(df, right + i), hn::Set(df, along_x)), hn::Mul(hn::Load(df, below + i), hn::Set(df, along_y)));
      };
      hn::Store(at(faces.u_x, faces.u_y), df, u + i);
      hn::Store(at(faces.v_x, faces.v_y), df, v + i);
      hn::Store(at(faces.depth_x, faces.depth_y), df, depth + i);
    }
  }
  alignas(64) float right[kStampPixels], below[kStampPixels];
  alignas(64) float u[kStampPixels], v[kStampPixels], depth[kStampPixels];
};

HWY_INLINE bool Fits(const FaceBatch& batch, std::size_t n) {
  return batch.columns[n] <= kStampSide && batch.right[n] == 0 && batch.below[n] + batch.rows[n] <= kStampSide;
}

template <bool kPerspective, bool kClipped>
HWY_INLINE void DrawStamp(const Stamp& stamp, const FaceBatch& batch, std::size_t n, std::uint32_t face, const KeyBand& band) {
  const FloatTag df;
  const auto u0 = hn::Set(df, batch.u[n]), v0 = hn::Set(df, batch.v[n]), depth0 = hn::Set(df, batch.depth[n]);
  const auto reach = hn::Set(df, kFaceReach);
  const std::int32_t row_end = batch.below[n] + batch.rows[n];
  alignas(64) float depths[kStampPixels];
  for (std::int32_t i = 0; i < row_end * kStampSide; i += std::int32_t(hn::Lanes(df))) {
    if constexpr (kPerspective) {
      const auto right = hn::Load(df, stamp.right + i), below = hn::Load(df, stamp.below + i);
      const auto at = [&](float along_x, float along_y) {
        return hn::Add(hn::Mul(right, hn::Set(df, along_x)), hn::Mul(below, hn::Set(df, along_y)));
      };
      const auto u = hn::Add(u0, at(batch.u_x[n], batch.u_y[n])), v = hn::Add(v0, at(batch.v_x[n], batch.v_y[n]));
      const auto divisor = hn::Add(hn::Set(df, batch.divisor[n]), at(batch.slope_x[n], batch.slope_y[n]));
      const auto hit = hn::Lt(hn::Max(hn::Abs(u), hn::Abs(v)), hn::Mul(reach, divisor));
      hn::Store(DepthWhere(hit, hn::Div(depth0, divisor)), df, depths + i);
    } else {
      const auto u = hn::Add(u0, hn::Load(df, stamp.u + i)), v = hn::Add(v0, hn::Load(df, stamp.v + i));
      const auto hit = hn::Lt(hn::Max(hn::Abs(u), hn::Abs(v)), reach);
      hn::Store(DepthWhere(hit, hn::Add(depth0, hn::Load(df, stamp.depth + i))), df, depths + i);
    }
  }
  using Tags = RowTags<kStampSide>;
  const Tags::Depth row_tag;
  std::uint64_t* keys = band.keys + batch.key[n];
  for (std::int32_t row = batch.below[n]; row < row_end; ++row, keys += band.stride) {
    for (std::int32_t column = 0; column < kStampSide; column += std::int32_t(hn::Lanes(row_tag))) {
      Merge<Tags, kClipped>(hn::Load(row_tag, depths + kStampSide * row + column), face, keys + column, band);
    }
  }
}

template <bool kPerspective, bool kClipped>
std::size_t Draw(const FaceProjection& faces, const FaceSite* sites, const FaceNormals* normals, std::uint32_t first, std::uint32_t count,
                 const KeyBand& band) {
  const auto lanes = std::uint32_t(hn::Lanes(FloatTag()));
  const Stamp stamp(faces);
  FaceBatch batch;
  std::size_t drawn = 0;
  for (std::uint32_t n = first; n < first + count; n += lanes) {
    std::uint32_t visible = PlaceFaces<kPerspective>(faces, sites + n, std::min(lanes, first + count - n), band, batch);
    if (visible == 0) continue;
    drawn += std::size_t(std::popcount(visible));
    constexpr std::uint32_t kPerLine = 64 / sizeof(FaceNormals);
    for (std::uint32_t line = 0; line < lanes; line += kPerLine) hwy::Prefetch(normals + n + line);
    for (; visible != 0; visible &= visible - 1) {
      const auto lane = std::size_t(std::countr_zero(visible));
      const auto face = n + std::uint32_t(lane);
      if (Fits(batch, lane)) {
        DrawStamp<kPerspective, kClipped>(stamp, batch, lane, face, band);
      } else {
        DrawFace<kPerspective, kClipped>(faces, batch, lane, face, band);
      }
    }
  }
  return drawn;
}

std::size_t DrawAny(Projection projection, const FaceProjection& faces, const FaceSite* sites, const FaceNormals* normals,
                    std::uint32_t first, std::uint32_t count, const KeyBand& band) {
  const bool clipped = band.limits.from != nullptr;
  if (projection == Projection::kPerspective) {
    return clipped ? Draw<true, true>(faces, sites, normals, first, count, band)
                   : Draw<true, false>(faces, sites, normals, first, count, band);
  }
  return clipped ? Draw<false, true>(faces, sites, normals, first, count, band)
                 : Draw<false, false>(faces, sites, normals, first, count, band);
}

bool NothingSeen(const KeyBand& band, const PixelBounds& bounds, float depth) {
  const hn::ScalableTag<std::int64_t> d;  // depths are positive, so keys are too
  const auto lanes = std::int32_t(hn::Lanes(d));
  const auto limit = hn::Set(d, std::int64_t{std::bit_cast<std::int32_t>(depth)} << 32);
  for (std::int32_t y = bounds.y_begin; y < bounds.y_end; ++y) {
    const auto* row =
        reinterpret_cast<const std::int64_t*>(band.keys) + std::size_t(y - band.bounds.y_begin) * band.stride - band.bounds.x_begin;
    std::int32_t x = bounds.x_begin;
    for (; x + lanes <= bounds.x_end; x += lanes) {
      if (!hn::AllTrue(d, hn::Lt(hn::LoadU(d, row + x), limit))) return false;
    }
    for (; x < bounds.x_end; ++x) {
      if (row[x] >= hn::GetLane(limit)) return false;
    }
  }
  return true;
}

bool NothingSeenOfClipped(const KeyBand& band, const PixelBounds& bounds, float depth) {
  const hn::ScalableTag<std::uint64_t> d;
  const hn::Rebind<float, decltype(d)> df;
  const hn::Rebind<std::uint32_t, decltype(d)> du;
  const auto lanes = std::int32_t(hn::Lanes(d));
  const auto nearest = hn::Set(df, depth);
  for (std::int32_t y = bounds.y_begin; y < bounds.y_end; ++y) {
    const std::size_t row = std::size_t(y - band.bounds.y_begin) * band.stride + std::size_t(bounds.x_begin - band.bounds.x_begin);
    for (std::int32_t x = 0; x < bounds.width(); x += lanes) {
      const std::size_t at = row + std::size_t(x);
      const auto drawn = hn::BitCast(df, hn::TruncateTo(du, hn::ShiftRight<32>(hn::LoadU(d, band.keys + at))));
      const auto from = hn::LoadU(df, band.limits.from + at), to = hn::LoadU(df, band.limits.to + at);
      // The least depth from `depth` on that the limits let through. Rays without any have from > to.
      const auto beyond = hn::Max(nearest, band.limits.inside ? from : to);
      const auto least = band.limits.inside ? beyond : hn::IfThenElse(hn::Lt(nearest, from), nearest, beyond);
      auto hidden = hn::Lt(drawn, least);
      if (band.limits.inside) hidden = hn::Or(hidden, hn::Gt(from, to));
      if (!hn::AllTrue(df, hn::Or(hidden, hn::Not(hn::FirstN(df, std::size_t(bounds.width() - x)))))) return false;
    }
  }
  return true;
}

bool AllHides(const KeyBand& band, const PixelBounds& bounds, float depth) {
  return band.limits.from == nullptr ? NothingSeen(band, bounds, depth) : NothingSeenOfClipped(band, bounds, depth);
}

}  // namespace slabstream::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace slabstream {
HWY_EXPORT(DrawAny);
HWY_EXPORT(AllHides);

std::size_t DrawFaces(Projection projection, const FaceProjection& faces, const FaceSite* sites, const FaceNormals* normals,
                      std::uint32_t first, std::uint32_t count, const KeyBand& band) {
  return HWY_DYNAMIC_DISPATCH(DrawAny)(projection, faces, sites, normals, first, count, band);
}

bool AllHidden(const KeyBand& band, const PixelBounds& bounds, float depth) { return HWY_DYNAMIC_DISPATCH(AllHides)(band, bounds, depth); }

}  // namespace slabstream
#endif
