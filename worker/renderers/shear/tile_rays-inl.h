// TileRays: the rays of a tile's lattice points, what shapes have on them, and which samples of them the box owns. Included once for each
// instruction set, hence the unusual include guard.
#include <hwy/highway.h>

#include <algorithm>
#include <cmath>

#include "worker/rays/ray_sums-inl.h"
#include "worker/renderers/shear/tile_context-inl.h"

#if defined(SLABSTREAM_WORKER_RENDERERS_SHEAR_TILE_RAYS_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef SLABSTREAM_WORKER_RENDERERS_SHEAR_TILE_RAYS_INL_H_
#undef SLABSTREAM_WORKER_RENDERERS_SHEAR_TILE_RAYS_INL_H_
#else
#define SLABSTREAM_WORKER_RENDERERS_SHEAR_TILE_RAYS_INL_H_
#endif

HWY_BEFORE_NAMESPACE();
namespace slabstream::HWY_NAMESPACE {
namespace {

class TileRays : TileContext {
 public:
  explicit TileRays(const TileContext& context) : TileContext(context) {}

  // False: the box owns no sample of the tile.
  bool SetUp() {
    const FloatTag df;
    FindFragments();
    bool any = false;
    for (std::int32_t row = 0; row < kTileRows; ++row) {
      for (std::int32_t column = 0; column < kTileColumns; column += kVector) {
        RayPacket packet;
        const auto u = Columns(U(column)), v = Set(V(row));
        const auto &from_x = passes_.turned ? v : u, &from_y = passes_.turned ? u : v;
        for (std::size_t i = 0; i < 3; ++i) {  // as PacketAt
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

 private:
  void FindFragments() {
    room_.fragments.clear();
    if (work_.fragments == nullptr) return;
    std::fill_n(room_.next_fragment_k[0], kTileRows * kTileColumns, kRayEnd);
    std::fill_n(room_.ray_ends[0], kTileRows * kTileColumns, kRayEnd);
    work_.fragments->ForEachIn(tile_.pixels, [&](std::int32_t x, std::int32_t y, const ShapeFragment& fragment, float at) {
      const std::int32_t row = (passes_.turned ? x : y) - tile_.v_begin, column = (passes_.turned ? y : x) - tile_.u_begin;
      if (fragment.rgba[3] == 1) {
        room_.ray_ends[row][column] = at;
        return;
      }
      float& next = room_.next_fragment_k[row][column];
      if (next == kRayEnd) {
        next = std::ceil(at);
        room_.next_fragment[row][column] = std::uint32_t(room_.fragments.size());
      }
      room_.fragments.push_back({row, column, std::ceil(at), fragment.rgba});
    });
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
    const bool cut = clipped_ || work_.fragments != nullptr;
    if (!none && cut) PartsOf(rays_.clip, packet, found);
    for (int i = 0; i < parts_; ++i) {
      PartRoom& part = room_.parts[i];
      if (none) {
        hn::Store(hn::Zero(df), df, &part.begin[row][column]);
        hn::Store(hn::Zero(df), df, &part.end[row][column]);
        continue;
      }
      if (work_.fragments != nullptr) found[i] = Between(found[i], Set(-kRayEnd), hn::Load(df, &room_.ray_ends[row][column]));
      const SampleInterval samples = cut ? found[i].Of(owned) : owned;
      hn::Store(samples.begin, df, &part.begin[row][column]);
      hn::Store(samples.end, df, &part.end[row][column]);
      const EndSamples ends = EndSamplesOf(rays_, packet, LeapScalesOf(packet), cut ? &found[i] : nullptr);
      hn::Store(ends.first, df, &part.first[row][column]);
      hn::Store(ends.last, df, &part.last[row][column]);
      hn::Store(ends.first_excess, df, &part.first_excess[row][column]);
      hn::Store(ends.last_excess, df, &part.last_excess[row][column]);
      if (!clipped_) continue;
      for (std::size_t axis = 0; axis < 3; ++axis) hn::Store(found[i].face[axis], df, &part.face[axis][row][column]);
      hn::Store(found[i].face_end, df, &part.face_end[row][column]);
    }
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
};

}  // namespace
}  // namespace slabstream::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
