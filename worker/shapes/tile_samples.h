// TileSamples: what the samples of a tile see of opaque shapes. Samples lie in cells of kCellSamples, so that kernels take a cell at a
// time: four samples of 2 x 2 pixels, or one of 4 x 4 pixels.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "common/image/pixel_bounds.h"
#include "common/memory/pooled_vector.h"
#include "worker/shapes/frame_shapes.h"

namespace slabstream {

// A part of a shape in one number: 256 times the number of the piece, plus that of the part in it. Shapes are in order.
using Element = std::uint32_t;
inline constexpr Element kNoElement = std::numeric_limits<Element>::max();

inline constexpr int kMostSamples = 4;  // of a pixel
inline constexpr std::size_t kCellSamples = 16;
inline constexpr std::int32_t kSteps = 256;  // of a pixel's side: vertices are rounded to them
struct SamplePoint {
  std::int32_t x, y;  // steps
};
// The rotated grid: no two samples in one column or row.
inline constexpr std::array<SamplePoint, 4> kRotatedGrid = {{{96, 32}, {224, 96}, {32, 160}, {160, 224}}};
inline constexpr std::array<SamplePoint, 4> kCentre = {{{128, 128}}};

// What a pixel sees of a translucent element.
struct ShapeHit {
  std::uint32_t pixel = 0;  // row by row
  float key = 0;            // mean of its samples
  Element element = 0;
  std::uint32_t mask = 0;  // of samples
};

class TileSamples {
 public:
  // Where the samples of a cell lie from its corner, in pixels.
  struct CellPoints {
    alignas(64) std::array<float, kCellSamples> x, y;
  };

  // `count` of each pixel, 1 or 4.
  TileSamples(const PixelBounds& pixels, int count)
      : pixels_(pixels),
        count_(count),
        cell_side_(count == 4 ? 2 : 4),
        keys_(kPixels * std::size_t(count), std::numeric_limits<float>::infinity()),
        elements_(kPixels * std::size_t(count), kNoElement) {
    // Beyond the frame's border, nothing is drawn.
    for (std::int32_t y = 0; y < kShapeTile; ++y) {
      for (std::int32_t x = y < pixels.height() ? pixels.width() : 0; x < kShapeTile; ++x) {
        std::fill_n(keys_.begin() + std::ptrdiff_t(First(x, y)), count, -std::numeric_limits<float>::infinity());
      }
    }
    stale_ = ~std::uint64_t{0};
    for (std::size_t i = 0; i < kCellSamples; ++i) {
      const std::size_t pixel = i / std::size_t(count), side = std::size_t(cell_side_);
      const SamplePoint& point = points()[i % std::size_t(count)];
      cell_points_.x[i] = float(pixel % side) + float(point.x) / kSteps;
      cell_points_.y[i] = float(pixel / side) + float(point.y) / kSteps;
    }
  }

  const PixelBounds& pixels() const { return pixels_; }
  int count() const { return count_; }
  std::int32_t cell_side() const { return cell_side_; }  // pixels
  const std::array<SamplePoint, 4>& points() const { return count_ == 4 ? kRotatedGrid : kCentre; }
  const CellPoints& cell_points() const { return cell_points_; }
  // The first sample of a cell; cells are in rows.
  std::size_t Cell(std::int32_t column, std::int32_t row) const {
    return kCellSamples * std::size_t(row * (kShapeTile / cell_side_) + column);
  }
  // The first sample of a pixel of the tile.
  std::size_t First(std::int32_t x, std::int32_t y) const {
    const std::int32_t in_cell = (y & (cell_side_ - 1)) * cell_side_ + (x & (cell_side_ - 1));
    return Cell(x / cell_side_, y / cell_side_) + std::size_t(in_cell * count_);
  }
  float* keys() { return keys_.data(); }
  const float* keys() const { return keys_.data(); }
  Element* elements() { return elements_.data(); }
  const Element* elements() const { return elements_.data(); }

  // Whether all samples of these pixels of the tile see something nearer than `nearest`.
  bool Hides(const PixelBounds& area, float nearest) {
    return !AnyBlock(area, [&](std::int32_t column, std::int32_t row) {
      const int block = row * kBlocks + column;
      if ((stale_ >> block & 1) != 0) {
        farthest_[std::size_t(block)] = FarthestOf(column, row);
        stale_ &= ~(std::uint64_t{1} << block);
      }
      return farthest_[std::size_t(block)] >= nearest;
    });
  }
  // After something was drawn there.
  void Changed(const PixelBounds& area) {
    AnyBlock(area, [&](std::int32_t column, std::int32_t row) {
      stale_ |= std::uint64_t{1} << (row * kBlocks + column);
      return false;
    });
  }

 private:
  static constexpr std::size_t kPixels = std::size_t{kShapeTile} * kShapeTile;
  static constexpr std::int32_t kBlock = 8;  // pixels a side
  static constexpr std::int32_t kBlocks = kShapeTile / kBlock;
  static_assert(kBlocks * kBlocks == 64);

  template <class Visit>
  static bool AnyBlock(const PixelBounds& area, Visit&& visit) {
    for (std::int32_t row = area.y_begin / kBlock; row * kBlock < area.y_end; ++row) {
      for (std::int32_t column = area.x_begin / kBlock; column * kBlock < area.x_end; ++column) {
        if (visit(column, row)) return true;
      }
    }
    return false;
  }
  float FarthestOf(std::int32_t column, std::int32_t row) const {
    const std::int32_t cells = kBlock / cell_side_;
    std::array<float, kCellSamples> farthest;
    farthest.fill(-std::numeric_limits<float>::infinity());
    for (std::int32_t y = row * cells; y < (row + 1) * cells; ++y) {
      const float* const key = &keys_[Cell(column * cells, y)];
      for (std::int32_t x = 0; x < cells; ++x) {
        for (std::size_t i = 0; i < kCellSamples; ++i) farthest[i] = std::max(farthest[i], key[std::size_t(x) * kCellSamples + i]);
      }
    }
    return *std::ranges::max_element(farthest);
  }

  const PixelBounds pixels_;
  const int count_;
  const std::int32_t cell_side_;
  UnwrittenVector<float> keys_;  // by sample
  UnwrittenVector<Element> elements_;
  CellPoints cell_points_;
  std::uint64_t stale_ = 0;           // bits of blocks whose farthest_ is unknown
  std::array<float, 64> farthest_{};  // keys, by block
};

// What the samples in `mask`, bits of the cell's samples, show of a translucent element.
void AddHits(const TileSamples& samples, std::int32_t column, std::int32_t row, std::uint32_t mask,
             const std::array<float, kCellSamples>& keys, Element element, std::vector<ShapeHit>& hits);

// Leaves the nearest kMostShapeHits hits of each pixel, sorted by pixel, nearest first.
void KeepNearest(std::vector<ShapeHit>& hits);

}  // namespace slabstream
