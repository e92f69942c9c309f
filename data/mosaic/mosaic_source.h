// A volume whose voxels lie in several sources: the pieces that the processes of a simulation wrote, or the patches of an adaptive mesh.
// A box is read from those that have some of it. Sources are opened when they are first needed, so a worker opens those of its own boxes.
//
// A level but the coarsest may have voxels that lie in no part, as those of an adaptive mesh do. They are interpolated between the voxels
// of the next coarser level, linearly along each axis, so a field that is linear stays linear.
#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "common/base/status.h"
#include "data/sources/volume_source.h"

namespace slabstream {

// Reads the parts of all levels.
class PartReader {
 public:
  PartReader() = default;
  virtual ~PartReader() = default;
  PartReader(const PartReader&) = delete;
  PartReader& operator=(const PartReader&) = delete;

  // Fills in `box`, which lies in the part with this number of a level, at `out`. Calls `done` once, perhaps before this returns. Waits for
  // disks, not for other reads. Any thread. Parts of a box are asked for in ascending order.
  virtual void Read(int level, std::size_t part, const Box& box, const BoxRoom& out, std::stop_token stop, VolumeSource::ReadDone done) = 0;
  virtual VolumeSource::Counts counts() = 0;
};

// By level and number: where the voxels of a part lie in the level. Not null.
using PartBoxes = std::vector<std::shared_ptr<const std::vector<Box>>>;

// A part that is a source.
struct MosaicPart {
  std::string name;  // for messages, such as its file
  Box box;           // where its voxels lie in the level. Its source has these and no others, in this order
  std::function<Result<std::shared_ptr<VolumeSource>>()> open;  // waits; called again if the source was closed meanwhile
};

inline constexpr std::size_t kMaxMosaicParts = 1 << 18;  // of a level

// `info`: of the volume, complete but for where levels are refined. With several levels, exact samples are float32 or float64. Parts of a
// level may overlap where they have the same samples, as pieces do that meet at their points. InvalidArgument, naming `name`: no part or
// more than kMaxMosaicParts, or voxels of the coarsest level that lie in none; other samples. Of a read: errors of PartReader::Read.
Result<std::shared_ptr<VolumeSource>> MakeMosaic(const std::string& name, SourceInfo info, const PartBoxes& boxes,
                                                 std::shared_ptr<PartReader> reader);

// The same of parts that are sources. What these say of their samples (type, mapping, exact) is the same. Opens the first part, of which
// info.whole and the levels' blocks become those of the volume. Of the first part, or of a read: errors of MosaicPart::open;
// InvalidArgument: its source has another size or samples.
Result<std::shared_ptr<VolumeSource>> MakeMosaic(const std::string& name, SourceInfo info, std::vector<std::vector<MosaicPart>> levels);

}  // namespace slabstream
