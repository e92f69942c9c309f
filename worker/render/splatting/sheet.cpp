#include "worker/render/splatting/sheet.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace slabstream {
namespace {

// Beyond this, marking a tile would cost more than what it lets be skipped.
constexpr std::int32_t kMaxReachTiles = 4;

std::int32_t RoundDown(std::int32_t x) { return x & ~(kTile - 1); }
static_assert((kTile & (kTile - 1)) == 0);

// Whole tiles, and an odd number of them in a row: with rows a multiple of 4 KiB apart, the rows of a footprint would lie at addresses that
// loads and stores take for one another (20 taps on 512 pixels: ten times slower).
PixelBounds SheetBounds(const PixelBounds& wanted) {
  PixelBounds bounds = {RoundDown(wanted.x_begin), RoundDown(wanted.y_begin), RoundDown(wanted.x_end + kTile - 1),
                        RoundDown(wanted.y_end + kTile - 1)};
  if (bounds.width() / kTile % 2 == 0) bounds.x_end += kTile;
  return bounds;
}

}  // namespace

SheetBuffer::SheetBuffer(const PixelBounds& wanted, double termination, double largest_footprint)
    : bounds_(SheetBounds(wanted)),
      saturated_alpha_(termination > 0 ? float(1 - termination) : 2.0F),
      tiles_x_(bounds_.width() / kTile),
      tiles_y_(bounds_.height() / kTile),
      reach_tiles_(std::int32_t(std::ceil(std::min(largest_footprint, 1e6) / kTile))),
      culls_voxels_(termination > 0 && reach_tiles_ <= kMaxReachTiles),
      touched_(std::size_t(tiles_x_) * std::size_t(tiles_y_)),
      saturated_(touched_.size()),
      hidden_(touched_.size()),
      touched_rows_begin_(tiles_y_),
      sheet_(4 * std::size_t(bounds_.pixel_count())),
      accumulated_(sheet_.size()) {}

// Along the ray of a pixel, physical direction d, sheets are spacing / |cos(d, axis)| apart; spacing cancels.
void SheetBuffer::SetDistanceRatios(const Camera& camera) {
  distance_ratio_.resize(std::size_t(bounds_.pixel_count()));
  const Axis c = camera.traversal_axis;
  const Vec3 first = camera.spacing * camera.RayAt(0, 0).direction;
  const Vec3 by_x = (1.0 / camera.width) * (camera.spacing * camera.RayAt(camera.width, 0).direction - first);
  const Vec3 by_y = (1.0 / camera.height) * (camera.spacing * camera.RayAt(0, camera.height).direction - first);
  const double along_axis = std::abs(camera.view_direction[c]);
  std::size_t i = 0;
  for (std::int32_t y = bounds_.y_begin; y < bounds_.y_end; ++y) {
    const Vec3 row = first + (y + 0.5) * by_y;
    for (std::int32_t x = bounds_.x_begin; x < bounds_.x_end; ++x, ++i) {
      const Vec3 d = row + (x + 0.5) * by_x;
      // Rays along the sheets miss the volume; the limit keeps them finite.
      distance_ratio_[i] = float(std::min(std::sqrt(Dot(d, d)) * along_axis / std::max(std::abs(d[c]), 1e-30), 1e6));
    }
  }
}

SheetBuffer::TileRange SheetBuffer::TilesOf(const PixelBounds& pixels) const {
  const PixelBounds inside = Intersection(pixels, bounds_);
  return {(inside.x_begin - bounds_.x_begin) / kTile, (inside.y_begin - bounds_.y_begin) / kTile,
          (inside.x_end - bounds_.x_begin + kTile - 1) / kTile, (inside.y_end - bounds_.y_begin + kTile - 1) / kTile};
}

bool SheetBuffer::Saturated(const PixelBounds& pixels) const { return AllSaturated(TilesOf(pixels)); }

bool SheetBuffer::AllSaturated(const TileRange& tiles) const {
  for (std::int32_t y = tiles.y_begin; y < tiles.y_end; ++y) {
    const std::uint8_t* row = &saturated_[std::size_t(y) * std::size_t(tiles_x_)];
    for (std::int32_t x = tiles.x_begin; x < tiles.x_end; ++x) {
      if (row[x] == 0) return false;
    }
  }
  return true;
}

void SheetBuffer::MarkSaturated(std::int32_t tile_x, std::int32_t tile_y) {
  std::uint8_t& saturated = saturated_[std::size_t(tile_y) * std::size_t(tiles_x_) + std::size_t(tile_x)];
  if (saturated != 0) return;
  saturated = 1;
  if (!culls_voxels_) return;
  for (std::int32_t y = std::max(0, tile_y - reach_tiles_); y <= tile_y; ++y) {
    for (std::int32_t x = std::max(0, tile_x - reach_tiles_); x <= tile_x; ++x) {
      const TileRange reached = {x, y, std::min(x + reach_tiles_ + 1, tiles_x_), std::min(y + reach_tiles_ + 1, tiles_y_)};
      hidden_[std::size_t(y) * std::size_t(tiles_x_) + std::size_t(x)] = AllSaturated(reached);
    }
  }
}

void SheetBuffer::Touch(const PixelBounds& pixels) {
  const TileRange tiles = TilesOf(pixels);
  touched_rows_begin_ = std::min(touched_rows_begin_, tiles.y_begin);
  touched_rows_end_ = std::max(touched_rows_end_, tiles.y_end);
  for (std::int32_t y = tiles.y_begin; y < tiles.y_end; ++y) {
    std::uint8_t* row = &touched_[std::size_t(y) * std::size_t(tiles_x_)];
    for (std::int32_t x = tiles.x_begin; x < tiles.x_end; ++x) row[x] = 1;
  }
}

void SheetBuffer::CompositeSlice(const Ownership& ownership) {
  std::array<ColumnInterval, kTile> owned_rows;
  std::array<std::int32_t, kTile> owned_begin, owned_end;
  for (std::int32_t tile_y = touched_rows_begin_; tile_y < touched_rows_end_; ++tile_y) {
    if (!ownership.owns_all()) {
      for (int j = 0; j < kTile; ++j) owned_rows[std::size_t(j)] = ownership.Row(bounds_.y_begin + tile_y * kTile + j);
    }
    for (std::int32_t tile_x = 0; tile_x < tiles_x_; ++tile_x) {
      const std::size_t tile = std::size_t(tile_y) * std::size_t(tiles_x_) + std::size_t(tile_x);
      if (touched_[tile] == 0) continue;
      touched_[tile] = 0;
      const std::size_t pixel = std::size_t(tile_y) * kTile * std::size_t(bounds_.width()) + std::size_t(tile_x) * kTile;
      TileWork work;
      work.sheet = &sheet_[4 * pixel];
      work.accumulated = &accumulated_[4 * pixel];
      work.row_pixels = bounds_.width();
      if (!distance_ratio_.empty()) work.distance_ratio = &distance_ratio_[pixel];
      if (!ownership.owns_all()) {
        const std::int32_t x = bounds_.x_begin + tile_x * kTile;
        for (std::size_t j = 0; j < kTile; ++j) {
          owned_begin[j] = std::clamp(owned_rows[j].begin - x, 0, kTile);
          owned_end[j] = std::clamp(owned_rows[j].end - x, 0, kTile);
        }
        work.owned_begin = owned_begin.data();
        work.owned_end = owned_end.data();
      }
      if (CompositeTile(work) >= saturated_alpha_) MarkSaturated(tile_x, tile_y);
    }
  }
  touched_rows_begin_ = tiles_y_;
  touched_rows_end_ = 0;
}

LocalImage SheetBuffer::TakeImage(const PixelBounds& frame) {
  const PixelBounds inside = Intersection(bounds_, frame);
  const std::size_t width = std::size_t(bounds_.width());
  const auto row_at = [&](std::int32_t y) { return &accumulated_[4 * std::size_t(y - bounds_.y_begin) * width]; };
  PixelBounds used = {inside.x_end, inside.y_end, inside.x_begin, inside.y_begin};
  for (std::int32_t y = inside.y_begin; y < inside.y_end; ++y) {
    const float* row = row_at(y);
    const auto empty = [&](std::int32_t x) { return row[4 * (x - bounds_.x_begin) + 3] == 0; };
    std::int32_t begin = inside.x_begin, end = inside.x_end;
    while (begin < end && empty(begin)) ++begin;
    if (begin == end) continue;
    while (empty(end - 1)) --end;
    used = {std::min(used.x_begin, begin), std::min(used.y_begin, y), std::max(used.x_end, end), y + 1};
  }
  if (used.empty()) used = {};
  LocalImage image = MakeLocalImage(PixelFormat::kRgba, used);
  for (std::int32_t y = used.y_begin; y < used.y_end; ++y) {
    std::copy_n(row_at(y) + 4 * (used.x_begin - bounds_.x_begin), 4 * used.width(),
                &image.rgba[4 * std::size_t(y - used.y_begin) * std::size_t(used.width())]);
  }
  return image;
}

}  // namespace slabstream
