#include "worker/renderers/shear/shear_tile.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "worker/renderers/shear/shear_tile.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <algorithm>
#include <limits>

#include "worker/renderers/shear/composer-inl.h"
#include "worker/renderers/shear/resampler-inl.h"
#include "worker/renderers/shear/tile_rays-inl.h"

HWY_BEFORE_NAMESPACE();
namespace slabstream::HWY_NAMESPACE {
namespace {

// All passes of a tile, slice by slice.
template <class T>
class TilePasses : TileContext {
 public:
  TilePasses(const ShearWork& work, const TilePixels& tile, TileRoom& room)
      : TileContext(work, tile, room), resampler_(*this), composer_(*this) {}

  std::uint64_t Run() {
    const std::uint64_t shaded = TileRays(*this).SetUp() ? ComposeSlices() : 0;
    composer_.AddFragmentsLeft();
    if (shaded != 0 || !room_.fragments.empty()) Write();
    return shaded;
  }

 private:
  std::uint64_t ComposeSlices() {
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
    return shaded;
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
      resampler_.Values(slot, slice, chunk, first * kBlockRows, (last + 1) * kBlockRows);
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
          if (shows[row]) shaded += composer_.Row(z, row, chunk);
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
    resampler_.Gradients(slice, chunk, first * kBlockRows, (last + 1) * kBlockRows);
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

  Resampler<T> resampler_;
  Composer composer_;
};

std::uint64_t ShearAny(const ShearWork& work, const TilePixels& tile, TileRoom& room) {
  switch (work.voxels->type) {
    case ScalarType::kUint8: return TilePasses<std::uint8_t>(work, tile, room).Run();
    case ScalarType::kUint16: return TilePasses<std::uint16_t>(work, tile, room).Run();
    default: break;
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
