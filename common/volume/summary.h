// VolumeSummary: what the planner, the automatic transfer function and `info` know about a volume without its voxels.
//
// The volume is divided into bricks (kBrick; the last ones cut off by the volume's border). Each brick keeps the range
// of data values of its voxels, so bricks tell whether a box can hold anything visible under a transfer function. A
// volume that nobody has read has no ranges: a terabyte would have a gigabyte of them.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "common/volume/labels.h"
#include "common/volume/owned_box.h"
#include "common/volume/sample_types.h"
#include "common/volume/stored_at.h"
#include "common/volume/volume.h"

namespace slabstream {

inline constexpr int kHistogramBins = 256;

struct ValueRange {
  float min = 0;
  float max = 0;
  friend bool operator==(const ValueRange&, const ValueRange&) = default;
};

// The range of a brick without any finite value: min > max.
inline constexpr ValueRange kNoFiniteValue = {1, 0};

// Ranges of bricks, x fastest.
using BrickRangeList = std::vector<ValueRange>;

// The bin of a data value, in [0, kHistogramBins): equal bins over `range`; the last one includes range.max, and values outside go to the
// nearest bin. If the range is one value, everything is in bin 0.
inline int HistogramBin(const ValueRange& range, double value) {
  const double width = double(range.max) - double(range.min);
  if (!(width > 0)) return 0;
  return int(std::clamp((value - double(range.min)) * (kHistogramBins / width), 0.0, kHistogramBins - 1.0));
}

struct ShapeInfo;  // common/shapes/packed_shape.h

struct VolumeSummary {
  VolumeDescription description;
  ValueRange range;                                       // the range of finite data values; {0, 0} if there is none
  std::array<std::uint64_t, kHistogramBins> histogram{};  // numbers of finite data values, by HistogramBin(range, value)
  Index3 brick_counts;                                    // bricks along each axis
  BrickRangeList bricks;        // ranges of finite values; kNoFiniteValue: there is none. Empty: any value everywhere
  std::int64_t non_finite = 0;  // voxels that are NaN or infinite: never visible
  int times = 1;                // of how many of the dataset's times range and histogram are (OverTimes)
  std::shared_ptr<const LabelTable> labels = nullptr;  // of a field of labels, else null
  // Nobody holds the voxels, but they can be read there. None: they are held.
  std::optional<StoredAt> stored = {};
  // What an index knows of the bricks of a stored level, in place of `bricks`. It says which voxels need not be read,
  // and nothing else: no picture may depend on whether there is an index. Null: there is none.
  std::shared_ptr<const BrickRangeList> indexed = nullptr;
  // Who holds which voxels, where that is known: processes, or the pieces that they wrote. The boxes tile the volume. Null: not known.
  std::shared_ptr<const OwnedBoxes> owned = nullptr;
  bool on_demand = false;                       // owners make their boxes when somebody asks for them
  std::vector<std::uint64_t> owner_hosts = {};  // by owner that is a process: who can read its memory (SharedMemoryScope); 0: nobody
  std::string missing = {};                     // one line: what the volume lacks, since owners are gone or late; else empty
  std::vector<std::uint32_t> cells;             // for an unstructured grid, by brick: cells with their centres there; empty: it is no grid

  std::shared_ptr<const ShapeInfo> shape = nullptr;  // the dataset is a shape, and these voxels are its bytes; null: it is a volume

  SampleTypes types() const { return {description.type, !cells.empty()}; }

  friend bool operator==(const VolumeSummary&, const VolumeSummary&) = default;
};

// The range of all values that samples of this type can stand for: of a brick of which nothing is known.
ValueRange AnyValue(const VolumeDescription& description);

// What is known of a level of which nobody has read all voxels: the statistics of the survey (of another one), and no bricks.
VolumeSummary UnreadSummary(const VolumeDescription& description, const VolumeSummary& surveyed);

// With range and histogram over its own time and others: the range of all finite values, and the mean of the histograms, in which each time
// has the same weight, however many voxels of it were read. Bins of another range are spread evenly over those that they overlap.
VolumeSummary OverTimes(VolumeSummary own, std::span<const VolumeSummary> others);

// With range and histogram of `statistics`.
VolumeSummary WithStatistics(VolumeSummary summary, const VolumeSummary& statistics);

// The range of data values that belongs to a range of stored samples: kNoFiniteValue stays what it is.
ValueRange DataRange(const VolumeDescription& description, const ValueRange& samples);

// The ranges of stored samples of the bricks of a piece of a volume, into the places of these bricks in `bricks`, which has all
// `brick_counts` bricks of the volume. The piece is as for PiecewiseSummary::Add. Parallel.
void FindBrickRanges(const VoxelBlock& piece, const Index3& brick_counts, BrickRangeList& bricks);

// The summary of a volume that is given piece by piece, and is never in memory as a whole.
class PiecewiseSummary {
 public:
  explicit PiecewiseSummary(const VolumeDescription& description);
  ~PiecewiseSummary();

  // A piece is the part of a block in this box, which begins at multiples of kBrick, and ends at such or at the volume's border. No voxel
  // is given twice.
  void Add(const VoxelBlock& block, const Box& piece);
  void Add(const VoxelBlock& piece) { Add(piece, piece.box); }
  // Counts for range and histogram alone; the piece may begin and end anywhere.
  void AddSample(const VoxelBlock& piece);
  // True: the same pieces must be given once more.
  bool EndOfPieces();
  void AddAgain(const VoxelBlock& piece);
  // Bricks outside all pieces have any value. There are none if there were samples alone.
  VolumeSummary Take();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

// The statistics of the survey, and the bricks of the volume. Parallel.
VolumeSummary SummaryOfBricks(const Volume& volume, const VolumeSummary& surveyed);

// Reads every voxel once; those of float volumes a second time for the histogram. Parallel; the result is the same for any number of
// threads.
VolumeSummary Summarize(const Volume& volume);

}  // namespace slabstream
