#include "worker/renderers/shear/shear_tile.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "worker/renderers/shear/shear_tile.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>

#include "worker/rays/ray_sums-inl.h"

#ifndef SLABSTREAM_WORKER_RENDERERS_SHEAR_TILE_ROOM
#define SLABSTREAM_WORKER_RENDERERS_SHEAR_TILE_ROOM
namespace slabstream::shear {

inline constexpr std::int32_t kSlots = 4;  // slices that a kernel reads
inline constexpr std::int32_t kBlockRows = 8, kBlocks = kTileRows / kBlockRows;

inline constexpr std::int32_t kNoSlice = std::numeric_limits<std::int32_t>::max();

// One part of each ray that clipping leaves.
struct PartRoom {
  alignas(64) float begin[kTileRows][kTileColumns], end[kTileRows][kTileColumns];   // samples that the box owns
  alignas(64) float first[kTileRows][kTileColumns], last[kTileRows][kTileColumns];  // EndSamples
  alignas(64) float first_excess[kTileRows][kTileColumns], last_excess[kTileRows][kTileColumns];
  alignas(64) float face[3][kTileRows][kTileColumns], face_end[kTileRows][kTileColumns];  // if the volume is clipped
};

// A chunk of kBlockRows rows.
struct BlockState {
  bool alive = false;                    // a ray may have samples left
  std::int32_t z_first = 0, z_last = 0;  // intervals between slices that hold its samples, if it was ever alive
  bool resampled[kSlots] = {};
  std::int32_t gradients_of[2] = {kNoSlice, kNoSlice};  // slices of the volume whose gradients are there
};

// Lattice points of a slice.
struct SliceRoom {
  alignas(64) float values[kTileRows][kTileColumns];
  alignas(64) float low[kTileRows][kChunks], high[kTileRows][kChunks];  // of the chunk's values
};

// Central differences of the volume's samples, over two voxels, at lattice points of a slice of the volume.
struct GradientRoom {
  alignas(64) float along[3][kTileRows][kTileColumns];  // x, y and z
};

struct TileRoom {
  SliceRoom slots[kSlots];
  GradientRoom gradients[2];
  AlignedVector<float> beams;  // after pass 1, of a chunk: [beam][column], or [beam][x, y, z][column] of gradients
  std::int32_t slot_z[kSlots];
  BlockState blocks[kBlocks][kChunks];
  alignas(64) float z_of_first[kTileRows][kTileColumns];  // z of sample 0 of each ray
  alignas(64) float red[kTileRows][kTileColumns], green[kTileRows][kTileColumns], blue[kTileRows][kTileColumns],
      alpha[kTileRows][kTileColumns];
  PartRoom parts[2];
  AlignedVector<float> between, between_slices[kSlots];  // beams between those of the volume
};

}  // namespace slabstream::shear
#endif

HWY_BEFORE_NAMESPACE();
namespace slabstream::HWY_NAMESPACE {
namespace {

using namespace slabstream::shear;  // NOLINT(google-build-using-namespace): one namespace for each instruction set

constexpr std::int32_t kVector = std::int32_t(kLanes);
static_assert(kChunk % kVector == 0);
constexpr float kLargest = std::numeric_limits<float>::max();

// The four weights of CubicKernel.
struct Weights {
  Floats before, at, next, behind;
};
HWY_INLINE Weights WeightsAt(const CubicKernel& kernel, Floats t) {
  const auto polynomial = [&](const std::array<float, 4>& c) SLABSTREAM_INLINED {
    return hn::Add(Set(c[0]), hn::Mul(t, hn::Add(Set(c[1]), hn::Mul(t, hn::Add(Set(c[2]), hn::Mul(t, Set(c[3])))))));
  };
  Weights w;
  w.before = polynomial(kernel.before);
  w.at = polynomial(kernel.at);
  w.behind = polynomial(kernel.behind);
  w.next = hn::Sub(Set(1), hn::Add(hn::Add(w.before, w.behind), w.at));
  return w;
}

// Not finite if one of the samples is not.
HWY_INLINE Floats Reconstruct(const Weights& w, Floats a, Floats b, Floats c, Floats d) {
  const auto sum = hn::Add(hn::Add(hn::Mul(w.before, a), hn::Mul(w.at, b)), hn::Add(hn::Mul(w.next, c), hn::Mul(w.behind, d)));
  const auto low = hn::Min(hn::Min(a, b), hn::Min(c, d)), high = hn::Max(hn::Max(a, b), hn::Max(c, d));
  const auto finite = hn::Le(hn::Abs(sum), Set(kLargest));
  return hn::IfThenElse(finite, hn::Min(hn::Max(sum, low), high), sum);
}

// The four samples of a beam from sample `at` on, lane by lane.
struct Four {
  Floats a, b, c, d;
};
HWY_INLINE Four LoadFour(const std::uint8_t* beam, Ints at) {
  const FloatTag df;
  const auto word = hn::GatherOffset(IntTag(), reinterpret_cast<const std::int32_t*>(beam), at);
  const auto byte = SetInt(0xFF);
  return {hn::ConvertTo(df, hn::And(word, byte)), hn::ConvertTo(df, hn::And(hn::ShiftRight<8>(word), byte)),
          hn::ConvertTo(df, hn::And(hn::ShiftRight<16>(word), byte)), hn::ConvertTo(df, hn::And(hn::ShiftRight<24>(word), byte))};
}
HWY_INLINE Four LoadFour(const std::uint16_t* beam, Ints at) {
  const FloatTag df;
  const auto offset = hn::Add(at, at), low = SetInt(0xFFFF);
  const auto* const words = reinterpret_cast<const std::int32_t*>(beam);
  const auto first = hn::GatherOffset(IntTag(), words, offset), second = hn::GatherOffset(IntTag(), words + 1, offset);
  return {hn::ConvertTo(df, hn::And(first, low)), hn::ConvertTo(df, hn::And(hn::ShiftRight<16>(first), low)),
          hn::ConvertTo(df, hn::And(second, low)), hn::ConvertTo(df, hn::And(hn::ShiftRight<16>(second), low))};
}
HWY_INLINE Four LoadFour(const float* beam, Ints at) {
  const FloatTag df;
  return {hn::GatherIndex(df, beam, at), hn::GatherIndex(df, beam + 1, at), hn::GatherIndex(df, beam + 2, at),
          hn::GatherIndex(df, beam + 3, at)};
}

template <class T>
class TilePasses {
 public:
  TilePasses(const ShearWork& work, const TilePixels& tile, TileRoom& room)
      : work_(work),
        passes_(*work.passes),
        rays_(*work.rays),
        tile_(tile),
        room_(room),
        centre_u_(passes_.turned ? rays_.centre_y : rays_.centre_x),
        centre_v_(passes_.turned ? rays_.centre_x : rays_.centre_y),
        scale_(work.supersampling),
        clipped_(!rays_.clip.empty()),
        parts_(rays_.clip.cut_away ? 2 : 1),
        gradients_(work.look->phong || !work.look->gradient_factors.empty()) {
    const std::size_t z_axis = std::size_t(Number(passes_.axes[2]));
    z_move_ = rays_.step * rays_.forward[z_axis];
    z_inverse_ = 1 / z_move_;
    for (std::size_t place = 0; place < 3; ++place) places_[std::size_t(Number(passes_.axes[place]))] = place;
  }

  std::uint64_t Run() {
    if (!SetUpRays()) return 0;
    const bool ascending = z_move_ > 0;
    std::int32_t z_first = std::numeric_limits<std::int32_t>::max(), z_last = std::numeric_limits<std::int32_t>::min();
    for (auto& row : room_.blocks) {
      for (const BlockState& block : row) {
        if (!block.alive) continue;
        z_first = std::min(z_first, block.z_first);
        z_last = std::max(z_last, block.z_last);
      }
    }
    if (z_first > z_last) return 0;  // all is clipped away
    std::fill_n(room_.slot_z, kSlots, kNoSlice);
    std::uint64_t shaded = 0;
    for (std::int32_t n = 0; n <= z_last - z_first; ++n) {
      const std::int32_t z = ascending ? z_first + n : z_last - n;
      if (!AnyAliveAt(z)) continue;
      for (std::int32_t slice = z - 1; slice <= z + 2; ++slice) ResampleSlice(slice);
      shaded += ComposeInterval(z, ascending);
    }
    if (shaded != 0) Write();
    return shaded;
  }

 private:
  static constexpr float kFar = 1e9F;

  float U(std::int32_t column) const { return float(tile_.u_begin + column) - centre_u_; }
  float V(std::int32_t row) const { return float(tile_.v_begin + row) - centre_v_; }
  static HWY_INLINE Floats Columns(float first) { return hn::Add(Set(first), hn::ConvertTo(FloatTag(), hn::Iota(IntTag(), 0))); }

  // The rays of lattice points, and which samples of them the box owns. False: none.
  bool SetUpRays() {
    const FloatTag df;
    bool any = false;
    for (std::int32_t row = 0; row < kTileRows; ++row) {
      for (std::int32_t column = 0; column < kTileColumns; column += kVector) {
        RayPacket packet;
        const auto u = Columns(U(column)), v = Set(V(row));
        const auto &from_x = passes_.turned ? v : u, &from_y = passes_.turned ? u : v;
        for (std::size_t i = 0; i < 3; ++i) {  // as RayOf
          const auto offset = hn::Add(hn::Mul(from_x, Set(rays_.right[i])), hn::Mul(from_y, Set(rays_.down[i])));
          packet.first[i] = hn::Add(Set(rays_.start[i]), offset);
          packet.move[i] = hn::Mul(Set(rays_.step), Set(rays_.forward[i]));
        }
        packet.valid = ValidPixels(row, column);
        const std::size_t z_axis = std::size_t(Number(passes_.axes[2]));
        hn::Store(packet.first[z_axis], df, &room_.z_of_first[row][column]);
        const auto zero = hn::Zero(df);
        for (auto* sums : {&room_.red, &room_.green, &room_.blue, &room_.alpha}) hn::Store(zero, df, &(*sums)[row][column]);
        SampleInterval owned = {zero, zero};
        if (!hn::AllFalse(df, packet.valid)) owned = SamplesInside(packet, work_.low, work_.high, work_.k_begin, work_.k_end);
        const bool none = hn::AllFalse(df, hn::Lt(owned.begin, owned.end));
        any = any || !none;
        StoreParts(packet, owned, none, row, column);
      }
    }
    if (any) SetUpBlocks();
    return any;
  }

  // Pixels of the tile that are not hidden.
  Mask ValidPixels(std::int32_t row, std::int32_t column) const {
    const FloatTag df;
    const std::int32_t v = tile_.v_begin + row;
    if (v >= tile_.v_end) return hn::Lt(Set(1), hn::Zero(df));
    const auto valid = hn::Lt(Columns(float(tile_.u_begin + column)), Set(float(tile_.u_end)));
    if (work_.hidden->empty()) return valid;
    alignas(64) float seen[kLanes];
    for (std::int32_t lane = 0; lane < kVector; ++lane) {
      const std::int32_t at = std::min(tile_.u_begin + column + lane, tile_.u_end - 1);
      seen[lane] = work_.hidden->Hides(passes_.turned ? v : at, passes_.turned ? at : v) ? 0.0F : 1.0F;
    }
    return hn::And(valid, hn::Gt(hn::Load(df, seen), hn::Zero(df)));
  }

  void StoreParts(const RayPacket& packet, const SampleInterval& owned, bool none, std::int32_t row, std::int32_t column) {
    const FloatTag df;
    PacketPart found[2];
    if (!none && clipped_) PartsOf(rays_.clip, packet, found);
    for (int i = 0; i < parts_; ++i) {
      PartRoom& part = room_.parts[i];
      if (none) {
        hn::Store(hn::Zero(df), df, &part.begin[row][column]);
        hn::Store(hn::Zero(df), df, &part.end[row][column]);
        continue;
      }
      const SampleInterval samples = clipped_ ? found[i].Of(owned) : owned;
      hn::Store(samples.begin, df, &part.begin[row][column]);
      hn::Store(samples.end, df, &part.end[row][column]);
      const EndSamples ends = EndSamplesOf(rays_, packet, LeapScalesOf(packet), clipped_ ? &found[i] : nullptr);
      hn::Store(ends.first, df, &part.first[row][column]);
      hn::Store(ends.last, df, &part.last[row][column]);
      hn::Store(ends.first_excess, df, &part.first_excess[row][column]);
      hn::Store(ends.last_excess, df, &part.last_excess[row][column]);
      if (!clipped_) continue;
      for (std::size_t axis = 0; axis < 3; ++axis) hn::Store(found[i].face[axis], df, &part.face[axis][row][column]);
      hn::Store(found[i].face_end, df, &part.face_end[row][column]);
    }
  }

  // z of sample k, in slices.
  HWY_INLINE Floats SliceOf(Floats z_of_first, Floats k) const {
    return hn::Mul(hn::Add(z_of_first, hn::Mul(k, Set(z_move_))), Set(float(scale_)));
  }

  void SetUpBlocks() {
    const FloatTag df;
    for (std::int32_t block = 0; block < kBlocks; ++block) {
      for (std::int32_t chunk = 0; chunk < kChunks; ++chunk) {
        auto low = Set(kFar), high = Set(-kFar);
        for (std::int32_t row = block * kBlockRows; row < (block + 1) * kBlockRows; ++row) {
          for (std::int32_t column = chunk * kChunk; column < (chunk + 1) * kChunk; column += kVector) {
            const auto first = hn::Load(df, &room_.z_of_first[row][column]);
            for (int i = 0; i < parts_; ++i) {
              const auto begin = hn::Load(df, &room_.parts[i].begin[row][column]), end = hn::Load(df, &room_.parts[i].end[row][column]);
              const auto some = hn::Lt(begin, end);
              const auto a = SliceOf(first, begin), b = SliceOf(first, hn::Sub(end, Set(1)));
              low = hn::IfThenElse(some, hn::Min(low, hn::Min(a, b)), low);
              high = hn::IfThenElse(some, hn::Max(high, hn::Max(a, b)), high);
            }
          }
        }
        const float least = hn::GetLane(hn::MinOfLanes(df, low)), greatest = hn::GetLane(hn::MaxOfLanes(df, high));
        BlockState& state = room_.blocks[block][chunk];
        state = {};
        state.alive = least <= greatest;
        if (!state.alive) continue;
        state.z_first = std::int32_t(std::floor(least));
        state.z_last = std::int32_t(std::floor(greatest));
      }
    }
  }

  bool AnyAliveAt(std::int32_t z) const {
    for (const auto& row : room_.blocks) {
      for (const BlockState& block : row) {
        if (block.alive && block.z_first <= z && z <= block.z_last) return true;
      }
    }
    return false;
  }

  // Passes 1 and 2, of a slice that is not there yet.
  void ResampleSlice(std::int32_t slice) {
    const auto slot = std::size_t(slice & (kSlots - 1));
    if (room_.slot_z[slot] == slice) return;
    room_.slot_z[slot] = slice;
    const double z = double(slice) / scale_;
    for (std::int32_t chunk = 0; chunk < kChunks; ++chunk) {
      std::int32_t first = kBlocks, last = -1;
      for (std::int32_t block = 0; block < kBlocks; ++block) {
        BlockState& state = room_.blocks[block][chunk];
        state.resampled[slot] = false;
        const bool wanted = state.alive && state.z_first - 1 <= slice && slice <= state.z_last + 2;
        if (!wanted || !IsActive(block, chunk, z)) continue;
        first = std::min(first, block);
        last = block;
      }
      if (last < 0) continue;
      ResampleValues(slot, slice, chunk, first * kBlockRows, (last + 1) * kBlockRows);
      for (std::int32_t block = first; block <= last; ++block) room_.blocks[block][chunk].resampled[slot] = true;
    }
  }

  bool IsActive(std::int32_t block, std::int32_t chunk, double z) const {
    // The corners of the block in the slice.
    float x_low = kFar, x_high = -kFar, y_low = kFar, y_high = -kFar;
    for (const std::int32_t column : {chunk * kChunk, (chunk + 1) * kChunk - 1}) {
      for (const std::int32_t row : {block * kBlockRows, (block + 1) * kBlockRows - 1}) {
        const double u = double(U(column)), v = double(V(row));
        const double y = passes_.y_0 + passes_.y_z * z + passes_.y_v * v + passes_.y_u * u;
        const auto x = float(passes_.x_0 + passes_.x_z * z + passes_.x_y * y + passes_.x_u * u);
        x_low = std::min(x_low, x);
        x_high = std::max(x_high, x);
        y_low = std::min(y_low, float(y));
        y_high = std::max(y_high, float(y));
      }
    }
    return work_.active->Any(x_low, x_high, y_low, y_high, float(z));
  }

  // The places of rows [row_begin, row_end) of a chunk of columns, in a slice.
  struct Strip {
    float u_first = 0;                          // of the chunk
    double z = 0;                               // of the slice
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
    float first, last;  // of the beams
  };
  HWY_INLINE Places PlacesOf(const Strip& strip, std::int32_t row, std::int32_t column, std::int32_t before, std::int32_t behind) const {
    const FloatTag df;
    const auto y = hn::Add(Set(strip.y_rows[row]), hn::Mul(Columns(strip.u_first + float(column)), Set(strip.y_step)));
    const auto floor = hn::Floor(y);
    const auto lowest = Set(float(strip.beam_begin)), highest = Set(float(strip.beam_end - 1 - before - behind));
    const auto beam = hn::Min(hn::Max(hn::Sub(floor, Set(float(before))), lowest), highest);
    return {beam, hn::Sub(y, floor), hn::GetLane(hn::MinOfLanes(df, beam)), hn::GetLane(hn::MaxOfLanes(df, beam))};
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

  // Rows [row_begin, row_end) of a chunk of columns.
  void ResampleValues(std::size_t slot, std::int32_t slice, std::int32_t chunk, std::int32_t row_begin, std::int32_t row_end) {
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
        // Of each lane: the beams of the first place, then of the others in turn.
        const float* from = room_.beams.data() + (std::int32_t(places.first) - strip.beam_begin) * kChunk + column;
        auto a = hn::Load(df, from), b = hn::Load(df, from + kChunk), c = hn::Load(df, from + 2 * kChunk),
             d = hn::Load(df, from + 3 * kChunk);
        for (float at = places.first + 1; at <= places.last; ++at) {
          from += kChunk;
          const auto here = hn::Eq(places.beam, Set(at));
          a = hn::IfThenElse(here, hn::Load(df, from), a);
          b = hn::IfThenElse(here, hn::Load(df, from + kChunk), b);
          c = hn::IfThenElse(here, hn::Load(df, from + 2 * kChunk), c);
          d = hn::IfThenElse(here, hn::Load(df, from + 3 * kChunk), d);
        }
        const auto value = Reconstruct(WeightsAt(work_.kernel, places.t), a, b, c, d);
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
  void ResampleGradients(std::int32_t slice, std::int32_t chunk, std::int32_t row_begin, std::int32_t row_end) {
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
        const float* from = room_.beams.data() + 3 * (std::int32_t(places.first) - strip.beam_begin) * kChunk + column;
        Floats a[3], b[3];
        const auto load = [&](std::int32_t i) SLABSTREAM_INLINED { return hn::Load(df, from + i * kChunk); };
        for (std::int32_t i = 0; i < 3; ++i) {
          a[i] = load(i);
          b[i] = load(3 + i);
        }
        for (float at = places.first + 1; at <= places.last; ++at) {
          from += 3 * kChunk;
          const auto here = hn::Eq(places.beam, Set(at));
          for (std::int32_t i = 0; i < 3; ++i) {
            a[i] = hn::IfThenElse(here, load(i), a[i]);
            b[i] = hn::IfThenElse(here, load(3 + i), b[i]);
          }
        }
        for (std::int32_t i = 0; i < 3; ++i) hn::Store(Lerp(places.t, a[i], b[i]), df, &to.along[i][row][chunk * kChunk + column]);
      }
    }
  }

  void Reserve(std::size_t floats) {
    if (room_.beams.size() < floats) room_.beams.resize(floats);
  }

  // A beam between those of the volume, interpolated along y and then along z. Only what lattice points from `low` to `high` need is
  // written.
  const float* BeamBetween(std::int32_t beam, std::int32_t slice, const Strip& strip) {
    const TurnedVoxels& voxels = *work_.voxels;
    // Of the beam, as numbers of its samples.
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

  static std::int32_t FloorDiv(std::int32_t a, std::int32_t b) { return a >= 0 ? a / b : -((b - 1 - a) / b); }

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

  // Samples between slices z and z + 1.
  std::uint64_t ComposeInterval(std::int32_t z, bool ascending) {
    std::uint64_t shaded = 0;
    for (std::int32_t chunk = 0; chunk < kChunks; ++chunk) {
      bool shows[kTileRows];  // a sample in the row may be visible
      bool any = false;
      for (std::int32_t block = 0; block < kBlocks; ++block) {
        BlockState& state = room_.blocks[block][chunk];
        const bool here =
            state.alive && state.z_first <= z && z <= state.z_last && std::ranges::all_of(state.resampled, [](bool is) { return is; });
        for (std::int32_t row = block * kBlockRows; row < (block + 1) * kBlockRows; ++row) {
          shows[row] = here && Shows(row, chunk);
          any = any || shows[row];
        }
      }
      if (any) {
        if (gradients_) {
          for (std::int32_t slice = FloorDiv(z, scale_); slice <= FloorDiv(z, scale_) + 1; ++slice) FindGradients(slice, chunk, shows);
        }
        for (std::int32_t row = 0; row < kTileRows; ++row) {
          if (shows[row]) shaded += ComposeRow(z, row, chunk);
        }
      }
      for (std::int32_t block = 0; block < kBlocks; ++block) {
        BlockState& state = room_.blocks[block][chunk];
        const bool* const rows = shows + block * kBlockRows;
        if (std::any_of(rows, rows + kBlockRows, [](bool is) { return is; })) state.alive = Transmits(block, chunk);
        if (z == (ascending ? state.z_last : state.z_first)) state.alive = false;
      }
    }
    return shaded;
  }

  // Whether values between the four slices that are there may be visible.
  bool Shows(std::int32_t row, std::int32_t chunk) const {
    float low = kLargest, high = -kLargest;
    for (const SliceRoom& slice : room_.slots) {
      low = std::min(low, slice.low[row][chunk]);
      high = std::max(high, slice.high[row][chunk]);
    }
    return work_.visible->AnyBetween(low, high);
  }

  // Gradients of the blocks with rows that show.
  void FindGradients(std::int32_t slice, std::int32_t chunk, const bool* shows) {
    std::int32_t first = kBlocks, last = -1;
    for (std::int32_t block = 0; block < kBlocks; ++block) {
      const bool* const rows = shows + block * kBlockRows;
      if (room_.blocks[block][chunk].gradients_of[slice & 1] == slice) continue;
      if (std::none_of(rows, rows + kBlockRows, [](bool is) { return is; })) continue;
      first = std::min(first, block);
      last = block;
    }
    if (last < 0) return;
    ResampleGradients(slice, chunk, first * kBlockRows, (last + 1) * kBlockRows);
    for (std::int32_t block = first; block <= last; ++block) room_.blocks[block][chunk].gradients_of[slice & 1] = slice;
  }

  // Whether a ray of the block transmits enough to go on.
  bool Transmits(std::int32_t block, std::int32_t chunk) const {
    const FloatTag df;
    const auto opaque = Set(1 - work_.termination);
    for (std::int32_t row = block * kBlockRows; row < (block + 1) * kBlockRows; ++row) {
      for (std::int32_t column = chunk * kChunk; column < (chunk + 1) * kChunk; column += kVector) {
        if (!hn::AllFalse(df, hn::Lt(hn::Load(df, &room_.alpha[row][column]), opaque))) return true;
      }
    }
    return false;
  }

  std::uint64_t ComposeRow(std::int32_t z, std::int32_t row, std::int32_t chunk) {
    std::uint64_t shaded = 0;
    for (std::int32_t column = chunk * kChunk; column < (chunk + 1) * kChunk; column += kVector) {
      for (int i = 0; i < parts_; ++i) {
        const PartRoom& part = room_.parts[i];
        shaded += clipped_ ? ComposeVector<true>(z, row, column, part) : ComposeVector<false>(z, row, column, part);
      }
    }
    return shaded;
  }

  template <bool kClipped>
  HWY_INLINE std::uint64_t ComposeVector(std::int32_t z, std::int32_t row, std::int32_t column, const PartRoom& part) {
    const FloatTag df;
    const RayLook& look = *work_.look;
    const auto zero = hn::Zero(df), one = Set(1), opaque = Set(1 - work_.termination), z_floor = Set(float(z));
    const auto z_of_first = hn::Load(df, &room_.z_of_first[row][column]);
    const auto end = hn::Load(df, &part.end[row][column]);
    Sums sums = {hn::Load(df, &room_.red[row][column]), hn::Load(df, &room_.green[row][column]), hn::Load(df, &room_.blue[row][column]),
                 hn::Load(df, &room_.alpha[row][column])};
    // The first sample of each ray here.
    const bool ascending = z_move_ > 0;
    const float edge = float(ascending ? z : z + 1) / float(scale_);
    const auto estimate = hn::Sub(hn::Ceil(hn::Mul(hn::Sub(Set(edge), z_of_first), Set(z_inverse_))), one);
    auto k = hn::Max(hn::Load(df, &part.begin[row][column]), estimate);
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
        // Of these alone: no ray depends on those beside it, which other boxes need not have.
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

  void Write() const {
    for (std::int32_t v = tile_.v_begin; v < tile_.v_end; ++v) {
      const std::int32_t row = v - tile_.v_begin;
      float* to = tile_.first + (v - tile_.v_begin) * tile_.along_v;
      for (std::int32_t column = 0; column < tile_.u_end - tile_.u_begin; ++column, to += tile_.along_u) {
        to[0] = room_.red[row][column];
        to[1] = room_.green[row][column];
        to[2] = room_.blue[row][column];
        to[3] = room_.alpha[row][column];
      }
    }
  }

  const ShearWork& work_;
  const ShearPasses& passes_;
  const ViewRays& rays_;
  const TilePixels& tile_;
  TileRoom& room_;
  const float centre_u_, centre_v_;
  const int scale_;  // beams, and slices, for each of the volume
  const bool clipped_;
  const int parts_;
  const bool gradients_;
  float z_move_ = 1, z_inverse_ = 1;  // voxels along z from sample to sample
  std::size_t places_[3] = {};        // in GradientRoom, by axis of the volume
};

std::uint64_t ShearAny(const ShearWork& work, const TilePixels& tile, TileRoom& room) {
  switch (work.voxels->type) {
    case ScalarType::kUint8: return TilePasses<std::uint8_t>(work, tile, room).Run();
    case ScalarType::kUint16: return TilePasses<std::uint16_t>(work, tile, room).Run();
    case ScalarType::kFloat32: break;
  }
  return TilePasses<float>(work, tile, room).Run();
}

}  // namespace
}  // namespace slabstream::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace slabstream::shear {
HWY_EXPORT(ShearAny);

void DeleteTileRoom::operator()(TileRoom* room) const { delete room; }
TileRoomPtr MakeTileRoom() { return TileRoomPtr(new TileRoom); }

std::uint64_t ShearTile(const ShearWork& work, const TilePixels& tile, TileRoom& room) {
  return HWY_DYNAMIC_DISPATCH(ShearAny)(work, tile, room);
}

}  // namespace slabstream::shear
#endif
