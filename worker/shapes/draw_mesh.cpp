#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "worker/shapes/draw_mesh.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <bit>
#include <limits>

#include "worker/shapes/draw_mesh.h"

HWY_BEFORE_NAMESPACE();
namespace slabstream::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

constexpr std::size_t kMostLanes = 16;
using Floats16 = std::array<float, kMostLanes>;
using Ints16 = std::array<std::int32_t, kMostLanes>;

// The vertices of a piece in the tile.
struct Vertices {
  alignas(64) std::array<std::int32_t, kMostOfPiece> step_x, step_y;  // rounded, from the tile's corner
  alignas(64) std::array<float, kMostOfPiece> key;
};

// False: a vertex lies behind the eye or too far away.
bool Transform(const ShapeScene& scene, const SceneShape& shape, const ShapePiece& piece, const PixelBounds& pixels, Vertices& out) {
  const hn::CappedTag<double, 8> d;
  const hn::Rebind<float, decltype(d)> df;
  const hn::Rebind<std::int32_t, decltype(d)> di;
  const auto set = [&](double value) HWY_ATTR { return hn::Set(d, value); };
  const bool perspective = scene.map.perspective();
  const Row4& row_w = perspective ? shape.w : shape.depth;
  const auto steps = set(kSteps), half = set(0.5), most = set(kMostPixel), least_w = set(scene.map.least_w);
  const auto left = set(pixels.x_begin), top = set(pixels.y_begin);
  auto irregular = hn::FirstN(d, 0);
  for (std::size_t i = 0; i < piece.vertices; i += hn::Lanes(d)) {
    const std::size_t at = piece.first_vertex + i;
    const auto px = hn::PromoteTo(d, hn::LoadU(df, &shape.view.positions[0][at])),
               py = hn::PromoteTo(d, hn::LoadU(df, &shape.view.positions[1][at])),
               pz = hn::PromoteTo(d, hn::LoadU(df, &shape.view.positions[2][at]));
    const auto apply = [&](const Row4& row) HWY_ATTR {
      return hn::Add(hn::Add(hn::Add(hn::Mul(set(row[0]), px), hn::Mul(set(row[1]), py)), hn::Mul(set(row[2]), pz)), set(row[3]));
    };
    auto x = apply(shape.x), y = apply(shape.y), key = apply(row_w);
    auto regular = hn::FirstN(d, hn::Lanes(d));
    if (perspective) {
      const auto w = key;
      x = hn::Div(x, w);
      y = hn::Div(y, w);
      key = hn::Div(set(-1), w);
      regular = hn::Gt(w, least_w);
    }
    regular = hn::And(regular, hn::And(hn::Lt(hn::Abs(x), most), hn::Lt(hn::Abs(y), most)));
    irregular = hn::Or(irregular, hn::AndNot(regular, hn::FirstN(d, piece.vertices - i)));
    const auto in_steps = [&](auto v, auto origin) HWY_ATTR {
      return hn::DemoteTo(di, hn::Sub(hn::Floor(hn::Add(hn::Mul(v, steps), half)), hn::Mul(origin, steps)));
    };
    hn::Store(in_steps(x, left), di, &out.step_x[i]);
    hn::Store(in_steps(y, top), di, &out.step_y[i]);
    hn::Store(hn::DemoteTo(df, key), df, &out.key[i]);
  }
  return hn::AllFalse(d, irregular);
}

// Edge functions at the samples of a cell, whose places are multiples of 32 steps, are added up by floats, which is faster. Sums of at most
// 2 * 2^14 * 32 stay whole and exact beside this number, and are the last bits of the float.
constexpr int kUnitBits = 5;
constexpr float kWholeFloat = 12582912;  // 1.5 * 2^23
constexpr std::uint32_t kWholeFloatBits = 0x4B400000;
static_assert(kShapeTile * kSteps <= 1 << 14);

// As many triangles as there are lanes. With x, y in steps, edge functions are a x + b y + c: inside if all are >= 0. Sums of whole numbers
// may wrap round on the way, but those in the tile do not.
struct Triangles {
  alignas(64) std::array<Floats16, 3> a, b;
  alignas(64) std::array<Ints16, 3> at_first, per_column, per_row;    // at the first cell's corner, less kWholeFloatBits; from cell to cell
  alignas(64) Ints16 first_column, first_row, last_column, last_row;  // cells
  alignas(64) Floats16 slope_x, slope_y, key, least, most;  // of keys: key + slope_x x + slope_y y, in pixels from the tile's corner
  std::uint32_t drawn = 0, large = 0;                       // bits of lanes
};

using IntTag = hn::CappedTag<std::int32_t, kMostLanes>;
using FloatTag = hn::CappedTag<float, kMostLanes>;
using Ints = hn::Vec<IntTag>;
using Floats = hn::Vec<FloatTag>;

HWY_INLINE std::uint32_t BitsOf(hn::Mask<IntTag> mask) {
  alignas(8) std::uint8_t bytes[8] = {};
  hn::StoreMaskBits(IntTag(), mask, bytes);
  return bytes[0] | std::uint32_t{bytes[1]} << 8;
}

// Candidates of a row of the rotated grid, which has one sample in each pixel: those in a box. Number 0: there is none.
struct RowSamples {
  Ints number, first_x, y;  // steps
};
HWY_INLINE RowSamples SamplesInRow(Ints row, Ints x_least, Ints x_most) {
  const IntTag di;
  const hn::RebindToUnsigned<IntTag> du;
  // The rows' samples are 1, 3, 0, 2 quarters of a pixel to the right of 32 steps.
  const auto bits = hn::ShiftLeft<1>(hn::BitCast(du, hn::And(row, hn::Set(di, 3))));
  const auto quarters = hn::And(hn::BitCast(di, hn::Shr(hn::Set(du, 0x8D), bits)), hn::Set(di, 3));
  const auto at = hn::Add(hn::ShiftLeft<6>(quarters), hn::Set(di, 32));
  const auto before = hn::ShiftRight<8>(hn::Sub(hn::Sub(x_least, at), hn::Set(di, 1))), last = hn::ShiftRight<8>(hn::Sub(x_most, at));
  return {hn::Sub(last, before), hn::Add(hn::ShiftLeft<8>(hn::Add(before, hn::Set(di, 1))), at),
          hn::Add(hn::ShiftLeft<6>(row), hn::Set(di, 32))};
}

// `corners`: of the first triangle.
HWY_INLINE void SetUp(const TileSamples& samples, const Vertices& vertices, const std::uint8_t* corners, std::size_t count,
                      Triangles& out) {
  const IntTag di;
  const FloatTag df;
  const hn::Rebind<std::uint8_t, IntTag> bytes;
  hn::Vec<decltype(bytes)> corner[3];
  hn::LoadInterleaved3(bytes, corners, corner[0], corner[1], corner[2]);
  Ints index[3], x[3], y[3];
  for (int i = 0; i < 3; ++i) {
    index[i] = hn::PromoteTo(di, corner[i]);
    x[i] = hn::GatherIndex(di, vertices.step_x.data(), index[i]);
    y[i] = hn::GatherIndex(di, vertices.step_y.data(), index[i]);
  }
  const auto least = [](const Ints(&v)[3]) HWY_ATTR { return hn::Min(hn::Min(v[0], v[1]), v[2]); };
  const auto most = [](const Ints(&v)[3]) HWY_ATTR { return hn::Max(hn::Max(v[0], v[1]), v[2]); };
  const Ints x_least = least(x), x_most = most(x), y_least = least(y), y_most = most(y);

  // Samples of a pixel or a row of pixels are so many steps apart.
  const bool four = samples.count() == 4;
  const auto first_sample = hn::Set(di, four ? 32 : 128);
  const auto sample_number = [&](Ints v) HWY_ATTR { return four ? hn::ShiftRight<6>(v) : hn::ShiftRight<8>(v); };
  const auto misses = [&](Ints low, Ints high) HWY_ATTR {
    // The number of the first sample that is not before `low` is beyond that of the last one up to `high`.
    const auto first = sample_number(hn::Sub(low, hn::Add(first_sample, hn::Set(di, 1)))),
               last = sample_number(hn::Sub(high, first_sample));
    return hn::Eq(first, last);
  };
  const auto end = hn::Set(di, kShapeTile * kSteps - 1), zero = hn::Zero(di);
  auto drawn = hn::FirstN(di, count);
  drawn = hn::And(drawn, hn::And(hn::Gt(hn::Min(x_most, y_most), hn::Set(di, -1)),
                                 hn::Lt(hn::Max(x_least, y_least), hn::Set(di, kShapeTile * kSteps))));
  const auto large = hn::And(drawn, hn::Gt(hn::Max(hn::Sub(x_most, x_least), hn::Sub(y_most, y_least)), hn::Set(di, kShapeTile * kSteps)));
  drawn = hn::AndNot(large, drawn);
  drawn = hn::AndNot(hn::Or(misses(x_least, x_most), misses(y_least, y_most)), drawn);
  out.large = BitsOf(large);

  const auto area = hn::Sub(hn::Mul(hn::Sub(x[1], x[0]), hn::Sub(y[2], y[0])), hn::Mul(hn::Sub(x[2], x[0]), hn::Sub(y[1], y[0])));
  drawn = hn::AndNot(hn::Eq(area, zero), drawn);
  out.drawn = BitsOf(drawn);
  if (out.drawn == 0) return;

  const int shift = four ? 9 : 10;  // steps of a cell
  const auto cell = [&](Ints v) HWY_ATTR { return hn::ShiftRightSame(hn::Min(hn::Max(v, zero), end), shift); };
  const Ints first_column = cell(x_least), first_row = cell(y_least);
  hn::Store(first_column, di, out.first_column.data());
  hn::Store(first_row, di, out.first_row.data());
  hn::Store(cell(x_most), di, out.last_column.data());
  hn::Store(cell(y_most), di, out.last_row.data());

  // Edge i lies opposite of corner i. With a positive area, what is left of its direction is inside.
  const auto turn = hn::Lt(area, zero);
  Ints a[3], b[3], on_edge[3];
  for (std::size_t i = 0; i < 3; ++i) {
    const std::size_t from = (i + 1) % 3, to = (i + 2) % 3;
    a[i] = hn::Sub(y[from], y[to]);
    b[i] = hn::Sub(x[to], x[from]);
    a[i] = hn::IfThenElse(turn, hn::Neg(a[i]), a[i]);
    b[i] = hn::IfThenElse(turn, hn::Neg(b[i]), b[i]);
    // A sample on the edge belongs to the triangle if a > 0, or a = 0 and b > 0.
    const auto owns = hn::Or(hn::Gt(a[i], zero), hn::And(hn::Eq(a[i], zero), hn::Gt(b[i], zero)));
    on_edge[i] = hn::IfThenElse(owns, zero, hn::Set(di, -1));
  }
  const auto edge_at = [&](std::size_t i, Ints at_x, Ints at_y) HWY_ATTR {
    const std::size_t from = (i + 1) % 3;
    return hn::Add(hn::Add(hn::Mul(a[i], hn::Sub(at_x, x[from])), hn::Mul(b[i], hn::Sub(at_y, y[from]))), on_edge[i]);
  };
  // Most of the least triangles lie between samples: those in whose box at most two may lie are looked at first.
  const auto first_row_number = hn::Add(sample_number(hn::Sub(y_least, hn::Set(di, 33))), hn::Set(di, 1));
  const auto last_row_number = sample_number(hn::Sub(y_most, hn::Set(di, 32)));
  auto small = hn::And(drawn, hn::Lt(hn::Sub(last_row_number, first_row_number), hn::Set(di, 2)));
  if (four && !hn::AllFalse(di, small)) {
    auto covers = hn::FirstN(di, 0);
    for (const Ints row : {first_row_number, last_row_number}) {
      const RowSamples in_row = SamplesInRow(row, x_least, x_most);
      const auto outside =
          hn::Or3(edge_at(0, in_row.first_x, in_row.y), edge_at(1, in_row.first_x, in_row.y), edge_at(2, in_row.first_x, in_row.y));
      // Where there are more, they are looked at later.
      covers = hn::Or(covers, hn::Or(hn::Gt(in_row.number, hn::Set(di, 1)),
                                     hn::And(hn::Eq(in_row.number, hn::Set(di, 1)), hn::Gt(outside, hn::Set(di, -1)))));
    }
    drawn = hn::AndNot(hn::AndNot(covers, small), drawn);
    out.drawn = BitsOf(drawn);
    if (out.drawn == 0) return;
  }
  for (std::size_t i = 0; i < 3; ++i) {
    const auto at_first = edge_at(i, hn::ShiftLeftSame(first_column, shift), hn::ShiftLeftSame(first_row, shift));
    hn::Store(hn::ConvertTo(df, a[i]), df, out.a[i].data());
    hn::Store(hn::ConvertTo(df, b[i]), df, out.b[i].data());
    hn::Store(hn::Sub(at_first, hn::Set(di, std::int32_t(kWholeFloatBits << kUnitBits))), di, out.at_first[i].data());
    hn::Store(hn::ShiftLeftSame(a[i], shift), di, out.per_column[i].data());
    hn::Store(hn::ShiftLeftSame(b[i], shift), di, out.per_row[i].data());
  }

  // The plane of keys goes through the rounded vertices: they are at most 1/512 pixel off.
  Floats px[3], py[3], key[3];
  for (int i = 0; i < 3; ++i) {
    px[i] = hn::Mul(hn::ConvertTo(df, x[i]), hn::Set(df, 1.0F / kSteps));
    py[i] = hn::Mul(hn::ConvertTo(df, y[i]), hn::Set(df, 1.0F / kSteps));
    key[i] = hn::GatherIndex(df, vertices.key.data(), index[i]);
  }
  const auto x1 = hn::Sub(px[1], px[0]), x2 = hn::Sub(px[2], px[0]), y1 = hn::Sub(py[1], py[0]), y2 = hn::Sub(py[2], py[0]);
  const auto k1 = hn::Sub(key[1], key[0]), k2 = hn::Sub(key[2], key[0]);
  const auto per_area = hn::Div(hn::Set(df, float(kSteps) * float(kSteps)), hn::ConvertTo(df, area));
  const auto slope_x = hn::Mul(hn::Sub(hn::Mul(k1, y2), hn::Mul(k2, y1)), per_area);
  const auto slope_y = hn::Mul(hn::Sub(hn::Mul(k2, x1), hn::Mul(k1, x2)), per_area);
  hn::Store(slope_x, df, out.slope_x.data());
  hn::Store(slope_y, df, out.slope_y.data());
  hn::Store(hn::Sub(hn::Sub(key[0], hn::Mul(slope_x, px[0])), hn::Mul(slope_y, py[0])), df, out.key.data());
  hn::Store(hn::Min(hn::Min(key[0], key[1]), key[2]), df, out.least.data());
  hn::Store(hn::Max(hn::Max(key[0], key[1]), key[2]), df, out.most.data());
}

void DrawPiece(const ShapeScene& scene, const SceneShape& shape, std::uint32_t number, TileSamples& samples, std::vector<ShapeHit>* hits,
               PartList& large) {
  const ShapePiece& piece = shape.view.pieces[number - shape.first_piece];
  large.count = 0;
  Vertices vertices;
  if (!Transform(scene, shape, piece, samples.pixels(), vertices)) {
    for (std::uint32_t part = 0; part < piece.parts; ++part) large.part[large.count++] = std::uint8_t(part);
    return;
  }
  const IntTag di;
  const FloatTag df;
  constexpr std::size_t kLanes = hn::MaxLanes(IntTag());
  constexpr std::size_t kVectors = kCellSamples / kLanes;
  const TileSamples::CellPoints& points = samples.cell_points();
  alignas(64) Floats16 unit_x, unit_y;  // units of 32 steps
  for (std::size_t i = 0; i < kCellSamples; ++i) {
    unit_x[i] = points.x[i] * (kSteps >> kUnitBits);
    unit_y[i] = points.y[i] * (kSteps >> kUnitBits);
  }
  const std::int32_t side = samples.cell_side();
  const std::uint8_t* corners = shape.view.corners.data() + std::size_t{3} * piece.first_part;
  Triangles t;
  for (std::uint32_t first = 0; first < piece.parts; first += kLanes, corners += 3 * kLanes) {
    SetUp(samples, vertices, corners, piece.parts - first, t);
    for (std::uint32_t lanes = t.large; lanes != 0; lanes &= lanes - 1) {
      large.part[large.count++] = std::uint8_t(first + std::uint32_t(std::countr_zero(lanes)));
    }
    for (std::uint32_t lanes = t.drawn; lanes != 0; lanes &= lanes - 1) {
      const auto lane = std::size_t(std::countr_zero(lanes));
      const auto element = Element(number << 8 | (first + std::uint32_t(lane)));
      const auto elements = hn::Set(di, std::int32_t(element));
      const auto slope_x = hn::Set(df, t.slope_x[lane]), slope_y = hn::Set(df, t.slope_y[lane]);
      const auto least = hn::Set(df, t.least[lane]), most = hn::Set(df, t.most[lane]);
      Ints edge[3][kVectors];
      Floats slope[kVectors];
      for (std::size_t v = 0; v < kVectors; ++v) {
        const auto sx = hn::Load(df, &unit_x[v * kLanes]), sy = hn::Load(df, &unit_y[v * kLanes]);
        for (std::size_t i = 0; i < 3; ++i) {
          const auto a = hn::Set(df, t.a[i][lane]), b = hn::Set(df, t.b[i][lane]);
          edge[i][v] = hn::ShiftLeft<kUnitBits>(hn::BitCast(di, hn::MulAdd(a, sx, hn::MulAdd(b, sy, hn::Set(df, kWholeFloat)))));
        }
        slope[v] = hn::Add(hn::Mul(slope_x, hn::Load(df, &points.x[v * kLanes])), hn::Mul(slope_y, hn::Load(df, &points.y[v * kLanes])));
      }
      std::uint32_t at_row[3];
      for (std::size_t i = 0; i < 3; ++i) at_row[i] = std::uint32_t(t.at_first[i][lane]);
      for (std::int32_t row = t.first_row[lane]; row <= t.last_row[lane]; ++row) {
        std::uint32_t at_cell[3] = {at_row[0], at_row[1], at_row[2]};
        for (std::size_t i = 0; i < 3; ++i) at_row[i] += std::uint32_t(t.per_row[i][lane]);
        for (std::int32_t column = t.first_column[lane]; column <= t.last_column[lane]; ++column) {
          const std::int32_t x = column * side, y = row * side;
          Ints at[3];
          for (std::size_t i = 0; i < 3; ++i) {
            at[i] = hn::Set(di, std::int32_t(at_cell[i]));
            at_cell[i] += std::uint32_t(t.per_column[i][lane]);
          }
          const float key_at = t.key[lane] + (t.slope_x[lane] * float(x) + t.slope_y[lane] * float(y));
          const std::size_t cell = samples.Cell(column, row);
          std::uint32_t hit = 0;
          alignas(64) Floats16 hit_keys;
          for (std::size_t v = 0; v < kVectors; ++v) {
            const auto outside = hn::Or3(hn::Add(at[0], edge[0][v]), hn::Add(at[1], edge[1][v]), hn::Add(at[2], edge[2][v]));
            const auto covered = hn::Gt(outside, hn::Set(di, -1));
            if (kVectors > 1 && hn::AllFalse(di, covered)) continue;  // one vector is drawn sooner than guessed
            const auto key = hn::Min(hn::Max(hn::Add(hn::Set(df, key_at), slope[v]), least), most);
            float* const keys = samples.keys() + cell + v * kLanes;
            auto* const seen = reinterpret_cast<std::int32_t*>(samples.elements() + cell + v * kLanes);
            const auto there = hn::Load(df, keys);
            // Elements are compared as the unsigned numbers that they are.
            const auto first_one = hn::Set(di, std::numeric_limits<std::int32_t>::min());
            const auto before = hn::Lt(hn::Xor(elements, first_one), hn::Xor(hn::Load(di, seen), first_one));
            const auto nearer = hn::Or(hn::Lt(key, there), hn::And(hn::Eq(key, there), hn::RebindMask(df, before)));
            const auto mask = hn::And(nearer, hn::RebindMask(df, covered));
            if (hits == nullptr) {
              hn::BlendedStore(key, mask, df, keys);
              hn::BlendedStore(elements, hn::RebindMask(di, mask), di, seen);
            } else {
              hn::Store(key, df, &hit_keys[v * kLanes]);
              hit |= BitsOf(hn::RebindMask(di, mask)) << (v * kLanes);
            }
          }
          if (hit != 0) AddHits(samples, column, row, hit, hit_keys, element, *hits);
        }
      }
    }
  }
}

}  // namespace slabstream::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace slabstream {
HWY_EXPORT(DrawPiece);

void DrawMeshPiece(const ShapeScene& scene, const SceneShape& shape, std::uint32_t piece, TileSamples& samples, std::vector<ShapeHit>* hits,
                   PartList& large) {
  HWY_DYNAMIC_DISPATCH(DrawPiece)(scene, shape, piece, samples, hits, large);
}

}  // namespace slabstream
#endif
