// Composer: pass 3 of a tile, from resampled slices to samples of rays, which are shaded and composed among fragments of shapes. Included
// once for each instruction set, hence the unusual include guard.
#include <hwy/highway.h>

#include "worker/rays/ray_sums-inl.h"
#include "worker/renderers/shear/reconstruct-inl.h"
#include "worker/renderers/shear/tile_context-inl.h"

#if defined(SLABSTREAM_WORKER_RENDERERS_SHEAR_COMPOSER_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef SLABSTREAM_WORKER_RENDERERS_SHEAR_COMPOSER_INL_H_
#undef SLABSTREAM_WORKER_RENDERERS_SHEAR_COMPOSER_INL_H_
#else
#define SLABSTREAM_WORKER_RENDERERS_SHEAR_COMPOSER_INL_H_
#endif

HWY_BEFORE_NAMESPACE();
namespace slabstream::HWY_NAMESPACE {
namespace {

class Composer : TileContext {
 public:
  explicit Composer(const TileContext& context) : TileContext(context) {}

  // The samples of a row of a chunk between slices z and z + 1, and the fragments before them. Returns how many were shaded.
  std::uint64_t Row(std::int32_t z, std::int32_t row, std::int32_t chunk) {
    const FloatTag df;
    std::uint64_t shaded = 0;
    for (std::int32_t column = chunk * kChunk; column < (chunk + 1) * kChunk; column += kVector) {
      auto from = Set(-kRayEnd), to = Set(kRayEnd);  // samples of each ray
      do {
        if (!room_.fragments.empty()) to = hn::Load(df, &room_.next_fragment_k[row][column]);
        for (int i = 0; i < parts_; ++i) {
          const PartRoom& part = room_.parts[i];
          shaded += clipped_ ? ComposeVector<true>(z, row, column, part, from, to) : ComposeVector<false>(z, row, column, part, from, to);
        }
      } while (!room_.fragments.empty() && AddFragments(z, row, column, to, from));
    }
    return shaded;
  }

  // Behind all samples.
  void AddFragmentsLeft() {
    for (std::size_t i = 0; i < room_.fragments.size(); ++i) {
      const auto& [row, column, k, rgba] = room_.fragments[i];
      if (i == room_.next_fragment[row][column]) AddFragment(row, column);
    }
  }

 private:
  // Adds the next fragment of each ray whose next sample does not lie behind the interval. Returns whether there is any; these rays go on
  // at `from`, and the others have no samples left here. `to`: next_fragment_k.
  HWY_NOINLINE bool AddFragments(std::int32_t z, std::int32_t row, std::int32_t column, Floats to, Floats& from) {
    const FloatTag df;
    const auto at = hn::Floor(SliceOf(hn::Load(df, &room_.z_of_first[row][column]), to));
    const auto here = z_move_ > 0 ? hn::Le(at, Set(float(z))) : hn::Ge(at, Set(float(z)));
    if (hn::AllFalse(df, here)) return false;
    from = hn::IfThenElse(here, to, Set(kRayEnd));
    alignas(64) float lanes[kLanes];
    hn::Store(from, df, lanes);
    for (std::int32_t lane = 0; lane < kVector; ++lane) {
      if (lanes[lane] < kRayEnd) AddFragment(row, column + lane);
    }
    return true;
  }

  void AddFragment(std::int32_t row, std::int32_t column) {
    const std::size_t number = room_.next_fragment[row][column]++;
    AddBehind(room_.fragments[number].rgba, room_.red[row][column], room_.green[row][column], room_.blue[row][column],
              room_.alpha[row][column]);
    const bool more =
        number + 1 < room_.fragments.size() && room_.fragments[number + 1].row == row && room_.fragments[number + 1].column == column;
    room_.next_fragment_k[row][column] = more ? room_.fragments[number + 1].k : kRayEnd;
  }

  // Samples [from, to) of the rays.
  template <bool kClipped>
  HWY_INLINE std::uint64_t ComposeVector(std::int32_t z, std::int32_t row, std::int32_t column, const PartRoom& part, Floats from,
                                         Floats to) {
    const FloatTag df;
    const RayLook& look = *work_.look;
    const auto zero = hn::Zero(df), one = Set(1), opaque = Set(1 - work_.termination), z_floor = Set(float(z));
    const auto z_of_first = hn::Load(df, &room_.z_of_first[row][column]);
    const auto end = hn::Min(hn::Load(df, &part.end[row][column]), to);
    Sums sums = {hn::Load(df, &room_.red[row][column]), hn::Load(df, &room_.green[row][column]), hn::Load(df, &room_.blue[row][column]),
                 hn::Load(df, &room_.alpha[row][column])};
    // The first sample of each ray here.
    const bool ascending = z_move_ > 0;
    const float edge = float(ascending ? z : z + 1) / float(scale_);
    const auto estimate = hn::Sub(hn::Ceil(hn::Mul(hn::Sub(Set(edge), z_of_first), Set(z_inverse_))), one);
    auto k = hn::Max(hn::Max(hn::Load(df, &part.begin[row][column]), from), estimate);
    for (int step = 0; step < 2; ++step) {
      const auto floor = hn::Floor(SliceOf(z_of_first, k));
      k = hn::Add(k, hn::IfThenElseZero(ascending ? hn::Lt(floor, z_floor) : hn::Gt(floor, z_floor), one));
    }
    const SliceRoom* slots[kSlots];  // slices z - 1 to z + 2
    for (std::int32_t i = 0; i < kSlots; ++i) slots[i] = &room_.slots[(z - 1 + i) & (kSlots - 1)];
    const auto load = [&](std::size_t i) SLABSTREAM_INLINED { return hn::Load(df, &slots[i]->values[row][column]); };
    const std::int32_t slice = FloorDiv(z, scale_);
    const GradientRoom &near = room_.gradients[slice & 1], &far = room_.gradients[(slice + 1) & 1];

    std::uint64_t shaded = 0;
    for (;; k = hn::Add(k, one)) {
      const auto at = SliceOf(z_of_first, k);
      const auto sampled = hn::And(hn::And(hn::Lt(k, end), hn::Eq(hn::Floor(at), z_floor)), hn::Lt(sums.alpha, opaque));
      if (hn::AllFalse(df, sampled)) break;
      const auto t = hn::Sub(at, z_floor);
      const auto s0 = load(0), s1 = load(1), s2 = load(2), s3 = load(3);
      const auto value = Reconstruct(WeightsAt(work_.kernel, t), s0, s1, s2, s3);
      const auto finite = hn::Le(hn::Abs(value), Set(kLargest));
      const auto entry = EntryOf(look, value, finite);
      auto opacity = hn::GatherIndex(df, look.entries.data() + 3, entry);
      auto visible = hn::And(hn::And(sampled, finite), hn::Gt(opacity, zero));
      if (hn::AllFalse(df, visible)) continue;

      Gradient gradient = {zero, zero, zero};
      if (gradients_) {
        const auto between = scale_ == 1 ? t : hn::Sub(hn::Mul(at, Set(1 / float(scale_))), Set(float(slice)));
        const auto component = [&](std::size_t place) SLABSTREAM_INLINED {
          return Lerp(between, hn::Load(df, &near.along[place][row][column]), hn::Load(df, &far.along[place][row][column]));
        };
        gradient = {component(places_[0]), component(places_[1]), component(places_[2])};
        if (!look.gradient_factors.empty()) {
          opacity = OpacityByGradient(look, opacity, gradient);
          visible = hn::And(visible, hn::Gt(opacity, zero));
        }
      }
      shaded += hn::CountTrue(df, visible);

      const auto is_first = hn::Eq(k, hn::Load(df, &part.first[row][column])), is_last = hn::Eq(k, hn::Load(df, &part.last[row][column]));
      const auto is_end = hn::Or(is_first, is_last);
      if (!hn::AllFalse(df, hn::And(visible, is_end))) {
        const auto steps_of_first = hn::Add(one, hn::IfThenElseZero(is_first, hn::Load(df, &part.first_excess[row][column])));
        const auto power = hn::Add(steps_of_first, hn::IfThenElseZero(is_last, hn::Load(df, &part.last_excess[row][column])));
        // Only the samples at ends are changed: no ray depends on those beside it, which other boxes need not have.
        opacity = hn::IfThenElse(is_end, hn::Sub(one, PowerOfFraction(hn::Sub(one, opacity), power)), opacity);
      }
      Light light = {one, zero};
      if (look.phong) {
        if constexpr (kClipped) {
          const auto on_face = hn::Lt(k, hn::Load(df, &part.face_end[row][column]));
          gradient = Choose(on_face,
                            {hn::Load(df, &part.face[0][row][column]), hn::Load(df, &part.face[1][row][column]),
                             hn::Load(df, &part.face[2][row][column])},
                            gradient);
        }
        light = LightOf(look, gradient);
      }
      sums.Add(visible, opacity, look.entries.data(), entry, light);
    }
    if (shaded == 0) return 0;
    hn::Store(sums.red, df, &room_.red[row][column]);
    hn::Store(sums.green, df, &room_.green[row][column]);
    hn::Store(sums.blue, df, &room_.blue[row][column]);
    hn::Store(sums.alpha, df, &room_.alpha[row][column]);
    return shaded;
  }
};

}  // namespace
}  // namespace slabstream::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
