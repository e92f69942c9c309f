#include "worker/renderers/splat/splat_band.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <optional>
#include <span>

#include "common/image/local_image.h"
#include "worker/kernels/normal_code.h"
#include "worker/shapes/fragment_order.h"

namespace slabstream {
namespace {

// Number of occupied voxels of an octet, by its mask: the basic x86-64 instruction set has no instruction for it.
constexpr auto kOctetCount = [] {
  std::array<std::uint8_t, 1 << kOctet> counts{};
  for (std::size_t mask = 0; mask < counts.size(); ++mask) counts[mask] = std::uint8_t(std::popcount(mask));
  return counts;
}();

constexpr std::int32_t kBrickOctets = kBrick / kOctet;

// Non-empty octets of up to 16 cells: bit i is octet i.
constexpr std::int32_t kSetCells = 64 / kCellOctets;
std::uint64_t OccupiedOctets(const std::uint32_t* masks, std::int32_t count) {
  std::uint64_t set = 0;
  for (std::int32_t cell = 0; cell < count; ++cell) {
    // The high bit of every byte that is not 0; a multiplication moves these four bits together.
    const std::uint32_t high = (((masks[cell] & 0x7F7F7F7FU) + 0x7F7F7F7FU) | masks[cell]) & 0x80808080U;
    set |= std::uint64_t{(high >> 7) * 0x10204080U >> 28} << (cell * kCellOctets);
  }
  return set;
}

}  // namespace

SplatBand::SplatBand(const SplatPass& pass, std::int32_t y_begin, std::int32_t y_end, LocalImage& image, RankReport& report)
    : pass_(pass),
      y_begin_(y_begin),
      y_end_(y_end),
      image_(image),
      report_(report),
      clock_(report),
      segments_(pass.bounds.width() / kSegment),
      words_(SegmentWords(segments_)),
      first_tile_row_(y_begin / kOcclusionTile),
      clipped_(!pass.clip.empty()),
      open_(std::size_t(y_end - y_begin) * std::size_t(words_)),
      owned_(std::size_t(words_)),
      nothing_(std::size_t(words_)) {
  static_assert(kOcclusionTile % kSegment == 0);
  const RayEnds ends(pass.setup.termination);
  const auto segment_x = [&](std::int32_t segment) { return pass.bounds.x_begin + segment * kSegment; };
  opaque_alpha_.assign(std::size_t((y_end - 1) / kOcclusionTile + 1 - first_tile_row_) * RowSegments(), kNeverOpaque);
  for (std::int32_t row = y_begin; row < y_end; ++row) {
    Insert(Open(row), 0, segments_);
    float* const opaque_alpha = OpaqueAlpha(row);
    for (std::int32_t segment = 0; segment < segments_; ++segment) {
      if (pass.setup.termination > 0) opaque_alpha[segment] = 1 - ends[pass.hidden.StepsAt(segment_x(segment), row)];
      if (pass.hidden.Hides(segment_x(segment), row)) Remove(Open(row), segment, segment + 1);
    }
  }
  if (pass.shapes != nullptr) FindFragments();
}

void SplatBand::FindFragments() {
  const Axis c = pass_.cells.axes.c;
  const bool ascending = pass_.setup.camera.ascending;
  const Box& box = pass_.box;
  const FragmentOrder order(pass_.setup);
  fragments_.resize(pass_.own.size());
  for (std::int32_t y = y_begin_; y < y_end_; ++y) {
    for (std::int32_t x = pass_.bounds.x_begin; x < pass_.bounds.x_end; ++x) {
      const ShapeTile& tile = pass_.shapes->TileForBoxes(x, y);
      if (tile.empty()) {
        x = tile.pixels.x_end - 1;
        continue;
      }
      for (const ShapeFragment& fragment : tile.At(x, y)) {
        const bool opaque = fragment.rgba[3] == 1;
        const FragmentOrder::Side side = order.Of(x, y, fragment.depth).side;
        if (side == FragmentOrder::Side::kBehind || (side == FragmentOrder::Side::kFront && !opaque)) continue;
        const double behind = std::ceil(double(fragment.depth));
        std::int32_t number = std::int32_t(ascending ? behind : -behind) - box.begin[c];
        // One in front of the box ends its rays before the first slice.
        if (opaque && ascending) number = std::max(number, 0);
        if (opaque && !ascending) number = std::min(number, box.size()[c] - 1);
        if (number < 0 || number >= std::int32_t(fragments_.size())) continue;
        if (!opaque && !pass_.own[std::size_t(number)].Contains({x, y, x + 1, y + 1})) continue;
        const std::size_t pixel =
            std::size_t(y - image_.bounds.y_begin) * std::size_t(image_.bounds.width()) + std::size_t(x - image_.bounds.x_begin);
        fragments_[std::size_t(number)].push_back({pixel, fragment.rgba});
      }
    }
  }
}

void SplatBand::AddFragments(std::int32_t k) {
  if (fragments_.empty()) return;
  for (const PixelFragment& fragment : fragments_[std::size_t(k - pass_.box.begin[pass_.cells.axes.c])]) {
    float* const at = &image_.rgba[4 * fragment.pixel];
    if (fragment.rgba[3] == 1) {
      PixelFragment& ended = ended_.emplace_back(PixelFragment{fragment.pixel});
      std::copy_n(at, 4, ended.rgba.begin());
      std::fill_n(at, 3, 0.0F);
      at[3] = 1;
      continue;
    }
    const float through = 1 - at[3];
    for (std::size_t i = 0; i < 4; ++i) at[i] += through * fragment.rgba[i];
  }
}

void SplatBand::Finish() {
  for (const PixelFragment& ended : ended_) std::ranges::copy(ended.rgba, &image_.rgba[4 * ended.pixel]);
}

bool SplatBand::finished() const {
  return std::ranges::all_of(open_, [](SegmentWord word) { return word == 0; });
}

void SplatBand::AddSlice(std::int32_t k) {
  slice_ = k;
  slopes_ = pass_.opacity.SlopesIn(k);
  const SliceSamples clipped = clipped_ ? ClipSlice(pass_.Slice(k)) : SliceSamples{};
  const SliceSamples& slice = clipped_ ? clipped : pass_.Slice(k);
  if (!PlaceBeams(slice)) return;
  FindNeeded(slice);
  clock_.Charge(Stage::kTransform);
  if (octets_.empty()) return;
  if (clipped_) LightCuts();
  if (pass_.light) LightOctets(*pass_.light, pass_.cells.axes, slice_, octet_places_, octets_, shares_);
  ShadeAndFilter(slice);
  CompositeRows(slice);
  clock_.Charge(Stage::kComposite);
}

// Finds what clipping leaves of the band's rows. The result's rectangle holds it.
SliceSamples SplatBand::ClipSlice(const SliceSamples& slice) {
  SliceSamples clipped = slice;
  clipped.owned = {};
  left_.resize(std::size_t(y_end_ - y_begin_));
  const PixelBounds owned = Intersection(slice.owned, {slice.owned.x_begin, y_begin_, slice.owned.x_end, y_end_});
  for (std::int32_t row = owned.y_begin; row < owned.y_end; ++row) {
    std::array<ColumnInterval, 2>& left = left_[std::size_t(row - y_begin_)];
    left = pass_.clip.ColumnsLeft(slice_, row);
    for (ColumnInterval& columns : left) {
      columns = {std::max(columns.begin, owned.x_begin), std::min(columns.end, owned.x_end)};
      if (!columns.empty()) clipped.owned = Union(clipped.owned, {columns.begin, row, columns.end, row + 1});
    }
  }
  return clipped;
}

// Gives voxels near a cut its normal.
void SplatBand::LightCuts() {
  cut_.clear();
  cut_.reserve(octets_.size());  // octets refer to the records
  for (std::size_t i = 0; i < octets_.size(); ++i) {
    OctetWork& octet = octets_[i];
    std::array<std::uint16_t, std::size_t{kOctet}> normals;
    normals.fill(kNormalCodes);
    if (!pass_.clip.LightCuts(slice_, octet_places_[i].v, octet_places_[i].u, kOctet, normals.data())) continue;
    auto& records = cut_.emplace_back();
    std::size_t record = 0;
    for (std::size_t voxel = 0; voxel < normals.size(); ++voxel) {
      if ((octet.occupied >> voxel & 1) == 0) continue;
      records[record] = octet.records[record];
      if (normals[voxel] != kNormalCodes) records[record].normal = normals[voxel];
      ++record;
    }
    octet.records = records.data();
  }
}

// Finds the rows and beams of the slice that meet, and makes room for them. False if there are none.
bool SplatBand::PlaceBeams(const SliceSamples& slice) {
  const Axis v = pass_.cells.axes.v;
  rows_ = {std::max(y_begin_, slice.owned.y_begin), std::min(y_end_, slice.owned.y_end)};
  if (rows_.begin >= rows_.end || slice.owned.empty()) return false;
  first_beam_ = std::max(pass_.cells.occupied.begin[v], Lattice::First(slice.rows.At(rows_.begin)));
  beam_count_ = std::min(pass_.cells.occupied.end[v], Lattice::First(slice.rows.At(rows_.end - 1)) + slice.along_v->taps) - first_beam_;
  if (beam_count_ <= 0) return false;

  // A segment's taps reach this far beyond the octet that needs the segment.
  const auto segment_voxels = std::int32_t(kSegment * slice.columns.step >> 32) + 1;
  margin_ = std::max(margin_, (slice.along_u->padded_taps + segment_voxels + kOctet - 1) / kOctet * kOctet);
  const std::int32_t voxels = pass_.octet_count * kOctet + 2 * margin_;
  if (voxels != shaded_voxels_) {
    shaded_voxels_ = voxels;
    shaded_.assign(4 * std::size_t{kShadedBeams} * std::size_t(voxels), 0.0F);
  }
  const auto beams = std::size_t(beam_count_);
  if (filtered_.size() < 4 * beams * std::size_t(pass_.bounds.width())) filtered_.resize(4 * beams * std::size_t(pass_.bounds.width()));
  needed_.assign((beams + 1) * std::size_t(words_), 0);  // and one more word after the last beam's, for spans
  filled_.assign(needed_.size(), 0);
  any_filled_.assign(beams, 0);
  return true;
}

// For each beam: the segments that are needed, and the octets that reach them.
void SplatBand::FindNeeded(const SliceSamples& slice) {
  const std::int32_t next_slice = pass_.setup.camera.ascending ? slice_ + 1 : slice_ - 1;
  octets_.clear();
  octet_places_.clear();
  octets_before_.clear();
  std::ranges::fill(owned_, 0);
  Insert(owned_.data(), (slice.owned.x_begin - pass_.bounds.x_begin) / kSegment,
         (slice.owned.x_end - pass_.bounds.x_begin + kSegment - 1) / kSegment);
  // Rows that the beam reaches: those whose taps begin at most `taps` - 1 beams before it.
  Rows reached = {rows_.begin, rows_.begin};
  const auto first_tap = [&](std::int32_t row) { return Lattice::First(slice.rows.At(row)); };
  for (std::int32_t beam = first_beam_; beam < first_beam_ + beam_count_; ++beam) {
    octets_before_.push_back(octets_.size());
    while (reached.begin < rows_.end && first_tap(reached.begin) <= beam - slice.along_v->taps) ++reached.begin;
    while (reached.end < rows_.end && first_tap(reached.end) <= beam) ++reached.end;
    const std::size_t number = pass_.cells.Beam(slice_, beam);
    PrefetchCells(next_slice, beam);
    if (pass_.cells.first_record[number] == pass_.cells.first_record[number + 1]) continue;
    SegmentWord* needed = &needed_[BeamWord(beam)];
    SegmentWord any = 0;
    for (std::int32_t word = 0; word < words_; ++word) {
      const SegmentWord owned = owned_[std::size_t(word)];
      SegmentWord open = 0;
      for (std::int32_t row = reached.begin; row < reached.end && open != owned; ++row) open |= Open(row)[word] & owned;
      any |= needed[word] = open;
    }
    if (any != 0) FindOctets(beam);
  }
  octets_before_.push_back(octets_.size());
}

void SplatBand::FindOctets(std::int32_t beam) {
  const OccupiedVoxels& cells = pass_.cells;
  const std::size_t number = cells.Beam(slice_, beam);
  const std::int32_t cell_count = pass_.octet_count / kCellOctets;
  // Cells of the occupied box: there is nothing before them.
  const std::uint32_t* masks = cells.Masks(number) + (pass_.first_octet / kCellOctets - cells.first_cell);
  const VoxelRecord* record = &cells.records[cells.first_record[number]];
  const OctetReach* const reached = pass_.Reached(slice_);
  const SegmentSpan* const reached_by_cells = pass_.ReachedByCells(slice_);
  const SegmentWord* needed = &needed_[BeamWord(beam)];
  SegmentWord* filled = &filled_[BeamWord(beam)];
  float* shaded = ShadedBeam(beam) + 4 * std::ptrdiff_t{margin_};
  const float along_v = slopes_.AlongV(beam), across = 1 + along_v * along_v;
  constexpr std::uint32_t kAll = (1U << kOctet) - 1;
  constexpr std::uint64_t kCellBits = (1U << kCellOctets) - 1;
  std::uint64_t drawn = 0;
  Index3 brick;
  brick[cells.axes.c] = slice_ / kBrick;
  brick[cells.axes.v] = beam / kBrick;
  std::optional<BrickRecords::Row> bricks;  // none: all records are there
  if (cells.to_make != nullptr) bricks = cells.to_make->RowAt(brick.y, brick.z);
  for (std::int32_t first_cell = 0; first_cell < cell_count; first_cell += kSetCells) {
    const std::int32_t set_cells = std::min(kSetCells, cell_count - first_cell);
    std::uint64_t left = OccupiedOctets(masks + first_cell, set_cells);
    while (left != 0) {
      const std::int32_t cell_of_set = std::countr_zero(left) / kCellOctets, cell = first_cell + cell_of_set;
      const std::uint64_t in_cell = left & (kCellBits << cell_of_set * kCellOctets);
      left ^= in_cell;
      const std::uint32_t mask = masks[cell];
      if (reached_by_cells != nullptr && !AnyOf(needed, reached_by_cells[cell])) {
        for (std::int32_t octet = 0; octet < kCellOctets; ++octet) record += kOctetCount[mask >> octet * kOctet & kAll];
        continue;
      }
      for (std::uint64_t rest = in_cell; rest != 0; rest &= rest - 1) {
        const std::int32_t octet = first_cell * kCellOctets + std::countr_zero(rest);
        const std::uint32_t occupied = mask >> (octet % kCellOctets * kOctet) & kAll;
        const VoxelRecord* const records = record;
        record += kOctetCount[occupied];
        SegmentSpan span = reached[octet].whole;
        if (!AnyOf(needed, span)) continue;
        if (occupied != kAll) {
          span = reached[octet].Of(occupied);
          if (!AnyOf(needed, span)) continue;
        }
        brick[cells.axes.u] = (pass_.first_octet + octet) / kBrickOctets;
        if (bricks && !bricks->Has(brick.x)) MakeRecords(brick);
        __builtin_prefetch(records);  // used for shading only after the slice's other octets
        Insert(filled, span);
        octets_.push_back(
            {records, shaded + 4 * std::ptrdiff_t{octet * kOctet}, occupied, slopes_.AlongU((pass_.first_octet + octet) * kOctet), across});
        if (clipped_ || pass_.light) octet_places_.push_back({(pass_.first_octet + octet) * kOctet, beam});
        drawn += kOctetCount[occupied];
      }
    }
  }
  report_.drawn_voxels += drawn;
  SegmentWord any = 0;
  for (std::int32_t word = 0; word < words_; ++word) any |= filled[word] &= needed[word];
  any_filled_[std::size_t(beam - first_beam_)] = any != 0;
}

void SplatBand::MakeRecords(const Index3& brick) {
  clock_.Charge(Stage::kTransform);
  pass_.cells.to_make->Need(brick);
  clock_.Charge(Stage::kPrepare);
}

// Beams of a slice are contiguous in memory; those of the next slice are elsewhere.
void SplatBand::PrefetchCells(std::int32_t slice, std::int32_t beam) const {
  const OccupiedVoxels& cells = pass_.cells;
  if (slice < cells.occupied.begin[cells.axes.c] || slice >= cells.occupied.end[cells.axes.c]) return;
  const std::size_t number = cells.Beam(slice, beam);
  __builtin_prefetch(&cells.first_record[number]);
  constexpr std::int32_t kLineCells = 64 / sizeof(std::uint32_t);
  for (std::int32_t cell = 0; cell < cells.cell_count; cell += kLineCells) __builtin_prefetch(cells.Masks(number) + cell);
}

void SplatBand::ShadeAndFilter(const SliceSamples& slice) {
  for (std::int32_t begin = 0; begin < beam_count_; begin += kShadedBeams) {
    const std::int32_t end = std::min(begin + kShadedBeams, beam_count_);
    const std::size_t first = octets_before_[std::size_t(begin)];
    const auto octets = std::span<const OctetWork>(octets_).subspan(first, octets_before_[std::size_t(end)] - first);
    if (octets.empty()) continue;
    ShadeOctets(pass_.tables, slopes_.u_step, octets);
    clock_.Charge(Stage::kShade);
    for (std::int32_t beam = first_beam_ + begin; beam < first_beam_ + end; ++beam) {
      if (any_filled_[std::size_t(beam - first_beam_)] == 0) continue;
      const float* voxel_0 = ShadedBeam(beam) + 4 * std::ptrdiff_t{margin_ - pass_.first_octet * kOctet};
      FilterBeam(*slice.along_u, slice.columns, {voxel_0, FilteredBeam(beam), &filled_[BeamWord(beam)], words_, pass_.bounds.x_begin});
      ClearForeignSamples(slice, beam);
    }
    ClearOctets(octets);
    clock_.Charge(Stage::kSplat);
  }
}

// Segments at the box's sides hold samples that belong to other boxes. The beam is cleared there, so that rows stay as they are.
void SplatBand::ClearForeignSamples(const SliceSamples& slice, std::int32_t beam) {
  const SegmentWord* filled = &filled_[BeamWord(beam)];
  const auto clear = [&](std::int32_t begin, std::int32_t end) {  // pixels of one segment, from `bounds` on
    if (begin == end || !AnyOf(filled, begin / kSegment, begin / kSegment + 1)) return;
    std::fill(FilteredBeam(beam) + 4 * std::ptrdiff_t{begin}, FilteredBeam(beam) + 4 * std::ptrdiff_t{end}, 0.0F);
  };
  const std::int32_t left = slice.owned.x_begin - pass_.bounds.x_begin, right = slice.owned.x_end - pass_.bounds.x_begin;
  clear(left / kSegment * kSegment, left);
  clear(right, (right + kSegment - 1) / kSegment * kSegment);
}

void SplatBand::CompositeRows(const SliceSamples& slice) {
  const std::int32_t taps = slice.along_v->taps, end_beam = first_beam_ + beam_count_;
  row_beams_.resize(std::size_t(taps));
  row_filled_.resize(std::size_t(taps));
  for (std::int32_t row = rows_.begin; row < rows_.end; ++row) {
    const std::int64_t at = slice.rows.At(row);
    const std::int32_t first = Lattice::First(at);
    bool any = false;
    for (std::int32_t n = 0; n < taps; ++n) {
      const std::int32_t beam = first + n;
      const bool is_filled = beam >= first_beam_ && beam < end_beam && any_filled_[std::size_t(beam - first_beam_)] != 0;
      row_beams_[std::size_t(n)] = is_filled ? FilteredBeam(beam) : filtered_.data();
      row_filled_[std::size_t(n)] = is_filled ? &filled_[BeamWord(beam)] : nothing_.data();
      any |= is_filled;
    }
    if (!any) continue;
    const RowWork work = {.taps = taps,
                          .weights = &slice.along_v->weights[Lattice::Phase(at) * std::size_t(taps)],
                          .beams = row_beams_.data(),
                          .filled = row_filled_.data(),
                          .accumulated = &image_.rgba[4 * std::size_t(row - pass_.bounds.y_begin) * std::size_t(pass_.bounds.width())],
                          .open = Open(row),
                          .words = words_,
                          .opaque_alpha = OpaqueAlpha(row)};
    if (clipped_) {
      CompositeClipped(work, row);
    } else {
      CompositeRow(work);
    }
  }
}

// Composites the samples that clipping leaves of a row: whole segments at once, then those that a cut divides. The latter stay open.
void SplatBand::CompositeClipped(RowWork work, std::int32_t row) {
  const std::array<ColumnInterval, 2>& left = left_[std::size_t(row - y_begin_)];
  SegmentWord* const open = work.open;
  open_whole_.assign(std::size_t(words_), 0);
  open_part_.assign(std::size_t(words_), 0);
  for (const ColumnInterval& columns : left) {
    if (columns.empty()) continue;
    const std::int32_t begin = columns.begin - pass_.bounds.x_begin, end = columns.end - pass_.bounds.x_begin;
    Insert(open_part_.data(), begin / kSegment, (end + kSegment - 1) / kSegment);
    if ((begin + kSegment - 1) / kSegment < end / kSegment) {
      Insert(open_whole_.data(), (begin + kSegment - 1) / kSegment, end / kSegment);
    }
  }
  for (std::size_t word = 0; word < open_whole_.size(); ++word) {
    open_whole_[word] &= open[word];
    open_part_[word] &= open[word] & ~open_whole_[word];
    open[word] &= ~open_whole_[word];
  }
  work.open = open_whole_.data();
  CompositeRow(work);
  for (std::size_t word = 0; word < open_whole_.size(); ++word) open[word] |= open_whole_[word];

  open_one_.assign(std::size_t(words_), 0);
  work.open = open_one_.data();
  for (std::int32_t word = 0; word < words_; ++word) {
    for (SegmentWord rest = open_part_[std::size_t(word)]; rest != 0; rest &= rest - 1) {
      open_one_[std::size_t(word)] = rest & ~(rest - 1);
      const std::int32_t first = FirstSegment(rest, word) * kSegment;
      float* const pixels = work.accumulated + 4 * std::ptrdiff_t{first};
      std::array<float, 4 * std::size_t{kSegment}> before;
      std::copy_n(pixels, before.size(), before.begin());
      CompositeRow(work);
      for (std::int32_t i = 0; i < kSegment; ++i) {
        const std::int32_t column = first + i + pass_.bounds.x_begin;
        const auto holds = [column](const ColumnInterval& columns) { return column >= columns.begin && column < columns.end; };
        if (std::ranges::none_of(left, holds)) std::copy_n(&before[4 * std::size_t(i)], 4, pixels + 4 * i);
      }
    }
    open_one_[std::size_t(word)] = 0;
  }
}

}  // namespace slabstream
