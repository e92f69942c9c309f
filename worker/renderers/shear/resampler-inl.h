// Resampler: passes 1 and 2 of a tile, from the voxels of a slice to its lattice points. Included once for each instruction set, hence the
// unusual include guard.
#include <hwy/highway.h>

#include <algorithm>
#include <cmath>

#include "worker/renderers/shear/reconstruct-inl.h"
#include "worker/renderers/shear/tile_context-inl.h"

#if defined(SLABSTREAM_WORKER_RENDERERS_SHEAR_RESAMPLER_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef SLABSTREAM_WORKER_RENDERERS_SHEAR_RESAMPLER_INL_H_
#undef SLABSTREAM_WORKER_RENDERERS_SHEAR_RESAMPLER_INL_H_
#else
#define SLABSTREAM_WORKER_RENDERERS_SHEAR_RESAMPLER_INL_H_
#endif

HWY_BEFORE_NAMESPACE();
namespace slabstream::HWY_NAMESPACE {
namespace {

template <class T>
class Resampler : TileContext {
 public:
  explicit Resampler(const TileContext& context) : TileContext(context) {}

  // Values at rows [row_begin, row_end) of a chunk of columns.
  void Values(std::size_t slot, std::int32_t slice, std::int32_t chunk, std::int32_t row_begin, std::int32_t row_end) {
    const FloatTag df;
    const Strip strip = StripOf(slice, scale_, chunk, row_begin, row_end, 1, 2);
    Reserve(std::size_t(strip.beam_end - strip.beam_begin) * kChunk);

    // Pass 1: beams of x.
    float* beams = room_.beams.data();
    for (std::int32_t beam = strip.beam_begin; beam < strip.beam_end; ++beam, beams += kChunk) {
      if (scale_ == 1) {
        ResampleBeam(work_.voxels->Beam<T>(beam, slice), strip, beam, beams);
      } else {
        ResampleBeam(BeamBetween(beam, slice, strip), strip, beam, beams);
      }
    }

    // Pass 2: across beams, along y.
    SliceRoom& to = room_.slots[slot];
    for (std::int32_t row = row_begin; row < row_end; ++row) {
      auto least = Set(kLargest), greatest = Set(-kLargest);
      for (std::int32_t column = 0; column < kChunk; column += kVector) {
        const Places places = PlacesOf(strip, row, column, 1, 2);
        Floats beam[kSlots];
        LoadBeams<1>(strip, places, column, beam);
        const auto value = Reconstruct(WeightsAt(work_.kernel, places.t), beam[0], beam[1], beam[2], beam[3]);
        hn::Store(value, df, &to.values[row][chunk * kChunk + column]);
        if constexpr (std::is_same_v<T, float>) {  // values that are not finite tell nothing of their range
          const auto finite = hn::Le(hn::Abs(value), Set(kLargest));
          least = hn::Min(least, hn::IfThenElse(finite, value, Set(-kLargest)));
          greatest = hn::Max(greatest, hn::IfThenElse(finite, value, Set(kLargest)));
        } else {
          least = hn::Min(least, value);
          greatest = hn::Max(greatest, value);
        }
      }
      to.low[row][chunk] = hn::GetLane(hn::MinOfLanes(df, least));
      to.high[row][chunk] = hn::GetLane(hn::MaxOfLanes(df, greatest));
    }
  }

  // The same of gradients, by linear interpolation. `slice`: of the volume.
  void Gradients(std::int32_t slice, std::int32_t chunk, std::int32_t row_begin, std::int32_t row_end) {
    const FloatTag df;
    const Strip strip = StripOf(slice, 1, chunk, row_begin, row_end, 0, 1);
    Reserve(3 * std::size_t(strip.beam_end - strip.beam_begin) * kChunk);
    float* beams = room_.beams.data();
    const TurnedVoxels& voxels = *work_.voxels;
    for (std::int32_t beam = strip.beam_begin; beam < strip.beam_end; ++beam, beams += 3 * kChunk) {
      const T* const here = voxels.Beam<T>(beam, slice);
      const T* const sides[2][2] = {{voxels.Beam<T>(beam - 1, slice), voxels.Beam<T>(beam + 1, slice)},
                                    {voxels.Beam<T>(beam, slice - 1), voxels.Beam<T>(beam, slice + 1)}};
      for (std::int32_t column = 0; column < kChunk; column += kVector) {
        const XPlaces places = XPlacesOf(strip, beam, column);
        const Four four = LoadFour(here, places.from);
        hn::Store(Lerp(places.t, hn::Sub(four.c, four.a), hn::Sub(four.d, four.b)), df, beams + column);
        for (std::int32_t side = 0; side < 2; ++side) {
          const Four low = LoadFour(sides[side][0], places.from), high = LoadFour(sides[side][1], places.from);
          hn::Store(Lerp(places.t, hn::Sub(high.b, low.b), hn::Sub(high.c, low.c)), df, beams + (side + 1) * kChunk + column);
        }
      }
    }
    GradientRoom& to = room_.gradients[slice & 1];
    for (std::int32_t row = row_begin; row < row_end; ++row) {
      for (std::int32_t column = 0; column < kChunk; column += kVector) {
        const Places places = PlacesOf(strip, row, column, 0, 1);
        Floats along[6];  // x, y and z of one beam, and of the next
        LoadBeams<3>(strip, places, column, along);
        for (std::int32_t i = 0; i < 3; ++i)
          hn::Store(Lerp(places.t, along[i], along[3 + i]), df, &to.along[i][row][chunk * kChunk + column]);
      }
    }
  }

 private:
  // The places of rows [row_begin, row_end) of a chunk of columns, in a slice.
  struct Strip {
    float u_first = 0;                          // u of the chunk's first column
    double z = 0;                               // z of the slice
    int scale = 1;                              // beams for each of the volume
    float y_rows[kTileRows], y_step = 0;        // lattice points lie at y_rows + y_step u, in beams
    std::int32_t beam_begin = 0, beam_end = 0;  // beams that they are made from
  };

  // Lattice points are made from beams `before` ... `behind` of that at or before them.
  Strip StripOf(std::int32_t slice, int scale, std::int32_t chunk, std::int32_t row_begin, std::int32_t row_end, std::int32_t before,
                std::int32_t behind) const {
    Strip strip;
    strip.u_first = U(chunk * kChunk);
    strip.z = double(slice) / scale;
    strip.scale = scale;
    strip.y_step = float(scale * passes_.y_u);
    float low = kFar, high = -kFar;
    for (std::int32_t row = row_begin; row < row_end; ++row) {
      const auto y = float(scale * (passes_.y_0 + passes_.y_z * strip.z + passes_.y_v * double(V(row))));
      const float first = y + strip.u_first * strip.y_step, last = y + (strip.u_first + float(kChunk - 1)) * strip.y_step;
      strip.y_rows[row] = y;
      low = std::min({low, first, last});
      high = std::max({high, first, last});
    }
    // No sample of the box reads a beam farther outside.
    constexpr std::int32_t kBeyond = 8;  // voxels
    const auto begin = float(scale * (work_.voxels->begin[1] - kBeyond)), end = float(scale * (work_.voxels->end[1] + kBeyond));
    strip.beam_begin = std::int32_t(std::clamp(std::floor(low) - float(before), begin, end - kSlots));
    strip.beam_end = std::int32_t(std::clamp(std::floor(high) + float(behind + 1), float(strip.beam_begin + kSlots), end));
    return strip;
  }

  // The lattice points of a vector of columns in a row: the first beam that each is made from, and how far behind beam `before` it lies.
  struct Places {
    Floats beam, t;
    float first, last;  // the first and the last beam
  };
  HWY_INLINE Places PlacesOf(const Strip& strip, std::int32_t row, std::int32_t column, std::int32_t before, std::int32_t behind) const {
    const FloatTag df;
    const auto y = hn::Add(Set(strip.y_rows[row]), hn::Mul(Columns(strip.u_first + float(column)), Set(strip.y_step)));
    const auto floor = hn::Floor(y);
    const auto lowest = Set(float(strip.beam_begin)), highest = Set(float(strip.beam_end - 1 - before - behind));
    const auto beam = hn::Min(hn::Max(hn::Sub(floor, Set(float(before))), lowest), highest);
    return {beam, hn::Sub(y, floor), hn::GetLane(hn::MinOfLanes(df, beam)), hn::GetLane(hn::MaxOfLanes(df, beam))};
  }

  // What pass 1 made, lane by lane, of the beams that `places` are made from. A beam has kLines lines in room_.beams.
  template <std::int32_t kLines, std::size_t kCount>
  HWY_INLINE void LoadBeams(const Strip& strip, const Places& places, std::int32_t column, Floats (&lines)[kCount]) const {
    const FloatTag df;
    // The beams of the first place, then of the others in turn.
    const float* from = room_.beams.data() + kLines * (std::int32_t(places.first) - strip.beam_begin) * kChunk + column;
    for (std::size_t i = 0; i < kCount; ++i) lines[i] = hn::Load(df, from + i * kChunk);
    for (float at = places.first + 1; at <= places.last; ++at) {
      from += kLines * kChunk;
      const auto here = hn::Eq(places.beam, Set(at));
      for (std::size_t i = 0; i < kCount; ++i) lines[i] = hn::IfThenElse(here, hn::Load(df, from + i * kChunk), lines[i]);
    }
  }

  // Lattice points u_first + column ... at x along a beam, in samples of TurnedVoxels::Beam from a lattice point's first one on.
  struct XPlaces {
    Ints from;
    Floats t;
  };
  HWY_INLINE XPlaces XPlacesOf(const Strip& strip, double beam, std::int32_t column) const {
    const auto x_0 = float(passes_.x_0 + passes_.x_y * (beam / strip.scale) + passes_.x_z * strip.z);
    const auto x = hn::Add(Set(x_0), hn::Mul(Columns(strip.u_first + float(column)), Set(float(passes_.x_u))));
    const auto floor = hn::Floor(x), lowest = Set(LowestFloor());
    return {hn::ConvertTo(IntTag(), hn::Sub(hn::Min(hn::Max(floor, lowest), Set(HighestFloor())), lowest)), hn::Sub(x, floor)};
  }

  void Reserve(std::size_t floats) {
    if (room_.beams.size() < floats) room_.beams.resize(floats);
  }

  // A beam between those of the volume, interpolated along y and then along z. Only what lattice points from `low` to `high` need is
  // written.
  const float* BeamBetween(std::int32_t beam, std::int32_t slice, const Strip& strip) {
    const TurnedVoxels& voxels = *work_.voxels;
    // The beam's position, in numbers of its samples.
    const double x_0 = passes_.x_0 + passes_.x_y * (double(beam) / scale_) + passes_.x_z * strip.z;
    const auto sample = [&](float u, double slack) {
      const double floor = std::floor(x_0 + passes_.x_u * double(u)) + slack;
      return std::int32_t(std::clamp(float(floor), LowestFloor(), HighestFloor()) - LowestFloor());
    };
    const float ends[2] = {strip.u_first, strip.u_first + float(kChunk - 1)};
    const bool rises = passes_.x_u > 0;
    const std::int32_t begin = sample(ends[rises ? 0 : 1], -1), end = sample(ends[rises ? 1 : 0], 1) + kSlots;  // rounding: one more
    if (room_.between.size() < std::size_t(voxels.beam) + kChunk) {
      for (auto* line :
           {&room_.between, &room_.between_slices[0], &room_.between_slices[1], &room_.between_slices[2], &room_.between_slices[3]}) {
        line->resize(std::size_t(voxels.beam) + kChunk);
      }
    }
    const std::int32_t y = FloorDiv(beam, scale_), z = FloorDiv(slice, scale_);
    const float* slices[kSlots];
    for (std::int32_t i = 0; i < kSlots; ++i) {
      float* const line = room_.between_slices[i].data();
      const T* const beams[kSlots] = {voxels.Beam<T>(y - 1, z - 1 + i), voxels.Beam<T>(y, z - 1 + i), voxels.Beam<T>(y + 1, z - 1 + i),
                                      voxels.Beam<T>(y + 2, z - 1 + i)};
      Blend(beams, float(beam - y * scale_) / float(scale_), begin, end, line);
      slices[i] = line;
    }
    Blend(slices, float(slice - z * scale_) / float(scale_), begin, end, room_.between.data());
    return room_.between.data();
  }

  // Samples [begin, end) of four lines, reconstructed at place t between the middle two. Up to kChunk more may be written.
  template <class Sample>
  void Blend(const Sample* const (&lines)[kSlots], float t, std::int32_t begin, std::int32_t end, float* HWY_RESTRICT to) {
    const FloatTag df;
    const Weights weights = WeightsAt(work_.kernel, Set(t));
    for (std::int32_t i = begin; i < end; i += kVector) {
      alignas(64) float samples[kSlots][kLanes];
      for (std::size_t line = 0; line < kSlots; ++line) {
        for (std::int32_t lane = 0; lane < kVector; ++lane) samples[line][lane] = float(lines[line][std::min(i + lane, end - 1)]);
      }
      const auto load = [&](std::size_t line) SLABSTREAM_INLINED { return hn::Load(df, samples[line]); };
      hn::StoreU(Reconstruct(weights, load(0), load(1), load(2), load(3)), df, to + i);
    }
  }

  // Places whose kernel lies within a beam. Farther out all samples are the same.
  float LowestFloor() const { return float(work_.voxels->begin[0] - (kBeamPad - 1)); }
  float HighestFloor() const { return float(work_.voxels->end[0] + kBeamPad - 3); }

  // A chunk of one beam. `samples`: of that beam.
  template <class Sample>
  HWY_INLINE void ResampleBeam(const Sample* samples, const Strip& strip, double beam, float* HWY_RESTRICT to) const {
    const FloatTag df;
    for (std::int32_t column = 0; column < kChunk; column += kVector) {
      const XPlaces places = XPlacesOf(strip, beam, column);
      const Four four = LoadFour(samples, places.from);
      hn::Store(Reconstruct(WeightsAt(work_.kernel, places.t), four.a, four.b, four.c, four.d), df, to + column);
    }
  }
};

}  // namespace
}  // namespace slabstream::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
