// SplatBand: some rows of the image, from the first slice to the last. Bands share no data that changes, so they are the tasks of the
// render threads. Voxels between two bands are shaded for both.
//
// For each slice: find the octets of voxels whose footprints reach pixels of the band that are not opaque yet; shade them; filter their
// beams to the columns of the frame; composite rows. Open segments of a row, visible octets and filled segments of a beam are sets of bits
// (segment_set.h).
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "common/memory/pooled_vector.h"
#include "worker/kernels/splat.h"
#include "worker/renderers/splat/splat_pass.h"
#include "worker/renderers/stage_clock.h"

namespace slabstream {

class SplatBand {
 public:
  // Rows [y_begin, y_end) of `image`, which has the bounds of the pass. Both must outlive the band. Stage times and counts go to `report`.
  SplatBand(const SplatPass& pass, std::int32_t y_begin, std::int32_t y_end, LocalImage& image, RankReport& report);

  // Slices come nearest first, each with the fragments in front of it. AddSlice: one with occupied voxels.
  void AddFragments(std::int32_t k);
  void AddSlice(std::int32_t k);
  bool finished() const;  // all is opaque: nothing behind shows
  void Finish();          // after the last slice

 private:
  // Beams that are shaded before they are filtered: few, so that they are still in the first-level cache when they are filtered.
  static constexpr std::int32_t kShadedBeams = 16;

  struct Rows {
    std::int32_t begin = 0, end = 0;
  };

  // A fragment of a pixel of the image. An opaque one ends its ray.
  struct PixelFragment {
    std::size_t pixel = 0;
    std::array<float, 4> rgba{};
  };
  void FindFragments();
  SliceSamples ClipSlice(const SliceSamples& slice);
  void LightCuts();
  void CompositeClipped(RowWork work, std::int32_t row);
  bool PlaceBeams(const SliceSamples& slice);
  void FindNeeded(const SliceSamples& slice);
  void FindOctets(std::int32_t beam);
  void MakeRecords(const Index3& brick);
  void PrefetchCells(std::int32_t slice, std::int32_t beam) const;
  void ShadeAndFilter(const SliceSamples& slice);
  void ClearForeignSamples(const SliceSamples& slice, std::int32_t beam);
  void CompositeRows(const SliceSamples& slice);

  static constexpr float kNeverOpaque = 2;
  std::size_t RowSegments() const { return std::size_t(words_) * std::size_t{kWordSegments}; }
  float* OpaqueAlpha(std::int32_t row) { return &opaque_alpha_[std::size_t(row / kOcclusionTile - first_tile_row_) * RowSegments()]; }
  SegmentWord* Open(std::int32_t row) { return &open_[std::size_t(row - y_begin_) * std::size_t(words_)]; }
  std::size_t BeamWord(std::int32_t beam) const { return std::size_t(beam - first_beam_) * std::size_t(words_); }
  // Beams take turns in kShadedBeams places.
  float* ShadedBeam(std::int32_t beam) {
    return &shaded_[4 * std::size_t((beam - first_beam_) % kShadedBeams) * std::size_t(shaded_voxels_)];
  }
  float* FilteredBeam(std::int32_t beam) { return &filtered_[4 * std::size_t(beam - first_beam_) * std::size_t(pass_.bounds.width())]; }

  const SplatPass& pass_;
  const std::int32_t y_begin_, y_end_;
  LocalImage& image_;
  RankReport& report_;
  StageClock clock_;
  const std::int32_t segments_, words_;  // segments and words of a row
  const std::int32_t first_tile_row_;    // the first row of tiles, counted in the frame
  const bool clipped_;
  std::vector<float> opaque_alpha_;                    // [row of tiles][segment]: alpha of the box at which nothing behind shows
  std::vector<SegmentWord> open_;                      // [row][word]: not opaque yet
  std::vector<std::vector<PixelFragment>> fragments_;  // in front of each slice of the box; empty: there are none
  std::vector<PixelFragment> ended_;                   // what pixels have gathered whose rays have ended; they are opaque until Finish

  // What follows belongs to the current slice.
  std::int32_t slice_ = 0;
  std::vector<std::array<ColumnInterval, 2>> left_;                // by row, of a clipped volume: columns of the slice
  std::vector<std::array<VoxelRecord, std::size_t{kOctet}>> cut_;  // records of octets near a cut
  std::vector<SegmentWord> open_whole_, open_part_, open_one_;     // [word]: scratch of CompositeClipped
  SheetOpacity::Slopes slopes_;
  Rows rows_;                                     // rows that the slice can touch
  std::int32_t first_beam_ = 0, beam_count_ = 0;  // beams whose footprints reach these rows
  std::vector<SegmentWord> owned_;                // [word]: segments with a column that the box owns
  const std::vector<SegmentWord> nothing_;        // [word]: 0
  std::vector<SegmentWord> needed_;               // [beam][word]: owned, and open in any row that the beam reaches
  std::vector<SegmentWord> filled_;               // [beam][word]: needed segments that the beam's voxels reach
  std::vector<std::uint8_t> any_filled_;          // [beam]: 1 if any segment is filled
  std::vector<OctetWork> octets_;                 // beam by beam
  std::vector<VoxelPlace> octet_places_;          // the first voxel of each octet, if the volume is clipped or there is a FrameLight
  std::vector<OctetShares> shares_;               // with a FrameLight: of octets_
  std::vector<std::size_t> octets_before_;        // [beam], and one more: where the beam's octets begin
  std::int32_t margin_ = 0, shaded_voxels_ = 0;   // voxels beside the occupied ones; voxels in a row of shaded_
  AlignedVector<float> shaded_;                   // [kShadedBeams][voxel][4]: zero except for the current octets
  PooledVector<float> filtered_;                  // [beam][column][4]: of `filled` segments
  std::vector<const float*> row_beams_;           // [tap]: scratch of CompositeRows
  std::vector<const SegmentWord*> row_filled_;
};

}  // namespace slabstream
