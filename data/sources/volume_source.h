// VolumeSource: a volume at one or more levels of resolution, which is read box by box. Nobody needs to hold all of it. Every format is
// one, also those that can only be read in one order (SourceInfo::slices) or as a whole (SourceInfo::whole).
//
//   Store (bytes by key)  ->  ChunkedArray (decoded chunks)  ->  VolumeSource (boxes of voxels)
//
// Level 0 is the finest one. A level need not have half as many voxels as the one before it along every axis. Positions in the world are
// the same at all levels: the geometry of each says where its voxels lie.
//
// Any thread may call a source. It answers on threads of its own (ReadContext).
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <stop_token>
#include <string>
#include <utility>
#include <vector>

#include "common/base/status.h"
#include "common/volume/field_info.h"
#include "common/volume/summary.h"
#include "common/volume/volume.h"
#include "data/volume_io/exact_samples.h"
#include "data/volume_io/read_progress.h"
#include "data/volume_io/stated_label.h"
#include "data/volume_io/uneven_axis.h"

namespace slabstream {

class GridCells;  // common/mesh/mesh_part.h
struct FileStamp;

struct SourceLevel {
  VolumeDescription description;  // type, mapping and axes are the same at all levels
  // Voxels along each axis of what one read of the source brings at least. Such blocks lie at multiples of it. Whoever cuts boxes there
  // reads no voxel twice.
  Index3 block;
  // Of an adaptive mesh: where the level has voxels of its own. The others are interpolated between those of the next coarser level. Null:
  // it has all of them.
  std::shared_ptr<const std::vector<Box>> refined = {};
  std::shared_ptr<const OwnedBoxes> owned = {};  // as VolumeSummary::owned
};

// The order of slices in which a stream gives its voxels.
struct SliceOrder {
  Axis along = Axis::kZ;
  bool from_end = false;  // the last slice first
};

// How a file stores its voxels, before they are turned to the axes of the world.
struct StoredAxes {
  Index3 size;                // voxels along each axis
  std::array<Vec3, 3> steps;  // from a voxel to the next one along it, in the world
  bool slanted = false;       // they are not at right angles, so that the voxels are straightened
};

struct SourceInfo {
  std::vector<SourceLevel> levels;       // at least one
  std::string format;                    // "OME-Zarr 0.5"
  std::string file_type;                 // the type of samples as they are stored: "int16"
  ExactType exact = {};                  // the type of exact samples (BoxRoom::exact)
  bool labels = false;                   // samples are numbers of structures, not measurements
  bool hollow = false;                   // it has no values (hollow_source.h)
  std::vector<StatedLabel> looks = {};   // looks of labels, by ascending values, as far as the source says it
  std::vector<FieldInfo> channels = {};  // empty: there is one, of which the source says nothing
  int channel = 0;                       // which of them it shows; of a luminance: 0
  int components = 1;                    // above 1: the channels are components of a voxel, such as red, green and blue
  TimeAxis times = TimeAxis();           // those that the source holds
  int time = 0;                          // which of them it shows
  // A sentence each, for people, of what the reader chose or applied where the file leaves it open, such as which of two matrices.
  std::vector<std::string> notes = {};
  std::vector<std::string> files = {};  // whose time of change tells that it is another volume now (FileStamp)
  std::uint64_t version = 0;            // the version of these files when it was opened (VersionOf); only an opened source has one
  // Where more times may come: the state of the folder of such files before they were counted, or of a store behind an address. Null:
  // `files` tell.
  std::shared_ptr<const FileStamp> growth = {};
  bool on_demand = false;                 // others make its voxels when somebody asks for them, and drop them (VolumeSource::Make)
  std::string owned = {};                 // others hold its voxels (data/owned): the text by which any process opens it, to keep no copy
  std::string folder = {};                // whose other files hold the chunks, an object each; empty: `files` hold them
  std::optional<StoredAxes> stored = {};  // none: a source does not tell
  // Of a rectilinear grid, before its voxels are placed (rectilinear_source.h) or made even (even_source.h): its coordinates along each
  // uneven axis of the world, rising. The level's spacing is then their mean distance.
  UnevenAxes uneven = {};
  // Boxes are read fast only in this order, since what lies in front of a box is read, too (data/positional/slice_stream.h).
  std::optional<SliceOrder> slices = {};
  bool whole = false;  // whoever reads a box first decodes all, and the source holds it (data/positional/decoded_source.h)

  const VolumeDescription& finest() const { return levels.front().description; }
  bool in_parts() const { return !slices && !whole; }
};

// A whole level in memory.
struct LevelInMemory {
  std::shared_ptr<const Volume> volume;
  // As they are stored, turned as the volume's, as far as they are wanted; null: those of the volume are exact or were not wanted.
  std::shared_ptr<const ExactSamples> exact = {};
  std::string rounding = {};                         // what float32 has rounded, for people (RoundingText); "": nothing
  std::shared_ptr<const GridCells> cells = nullptr;  // of an unstructured grid, if they do not fit the memory; else the volume has them
  // Summarize(*volume), if it was wanted and could be made while the voxels came; else null.
  std::shared_ptr<const VolumeSummary> summary = nullptr;
};
struct LevelWanted {
  bool all_exact = false;  // exact samples of each type that float32 may round; else of whole numbers of which it rounds one
  // What `info` says to be float32 becomes uint16 if that holds all samples after a shift. What is decoded as a whole always does.
  bool narrow = false;
  bool summary = false;  // LevelInMemory::summary
};

// Where the samples of a box go: x fastest.
struct BoxRoom {
  // Without gaps between rows or slices. `out` has room for all samples of the box.
  static BoxRoom Dense(const Box& box, std::byte* out, bool exact = false) {
    const Index3 size = box.size();
    return {out, size.x, std::int64_t{size.x} * size.y, false, exact};
  }

  std::byte* first = nullptr;       // the sample of the box's first voxel
  std::int64_t row = 0, slice = 0;  // samples from a voxel to the next along y and z
  bool zeroed = false;              // all samples are 0 already, so that zeros need not be written
  bool exact = false;               // samples are those of SourceInfo::exact, not of the level's type
};

// Whether a process gets voxels of a source that others hold (data/owned).
enum class VoxelReach : std::uint8_t { kNever, kOnceMade, kNow };

class VolumeSource {
 public:
  VolumeSource() = default;
  virtual ~VolumeSource() = default;
  VolumeSource(const VolumeSource&) = delete;
  VolumeSource& operator=(const VolumeSource&) = delete;

  virtual const SourceInfo& info() const = 0;

  // Another time and channel of what is open, as `info` counts them. Reads nothing, so what has been read of it counts for this one, too.
  // Null: it must be opened for itself, since its format has metadata of each; or there is no such.
  virtual std::shared_ptr<VolumeSource> At(int /*time*/, int /*channel*/) { return nullptr; }

  // Whether Read gets the voxels of this box. If not, of what others hold (data/owned): another process must be asked.
  virtual VoxelReach Reaches(int /*level*/, const Box& /*box*/) const { return VoxelReach::kNow; }

  using ReadDone = std::function<void(Status)>;
  // Of a source that is made on demand: has all voxels of the box made, each where it is held. Some may be dropped again before the others
  // are made. Calls `done` exactly once, on any thread, perhaps before this returns. Errors of who makes them.
  virtual void Make(const Box& /*box*/, ReadDone done) { done(Status::Ok()); }
  // Fills `out` with the samples of `box`, of the level's type or, if out.exact, as they are stored, and writes nothing between its rows.
  // `box` is not empty and lies inside the level. Calls `done` exactly once, on any thread, perhaps before this returns; `out` must stay
  // until then. Once `stop` is told to stop, what has not begun is left out, and the end is Cancelled. Unavailable, DataLoss: as of
  // ChunkedArray::ReadChunk; ResourceExhausted.
  virtual void Read(int level, const Box& box, const BoxRoom& out, std::stop_token stop, ReadDone done) = 0;

  // The same without gaps: `out` has exactly box.voxel_count() samples.
  void Read(int level, const Box& box, std::span<std::byte> out, std::stop_token stop, ReadDone done);

  // These wait, so not on a thread that decodes.
  Status ReadNow(int level, const Box& box, const BoxRoom& out, std::stop_token stop = {});
  Status ReadNow(int level, const Box& box, std::span<std::byte> out, std::stop_token stop = {});

  // A whole level. `progress`, if any, counts samples, unless the source does (`slices`, `whole`: ReadOptions::progress). Waits.
  // ResourceExhausted: it does not fit the memory. Errors of Read.
  Result<LevelInMemory> ReadLevel(int level, ReadProgress* progress = nullptr, const LevelWanted& wanted = {}) {
    return DoReadLevel(level, progress, wanted);
  }

  // Since it was opened: bytes that were read as they are stored, and chunks that were decoded.
  struct Counts {
    std::uint64_t stored_bytes = 0, chunks = 0;

    Counts& operator+=(const Counts& other) {
      stored_bytes += other.stored_bytes;
      chunks += other.chunks;
      return *this;
    }
  };
  virtual Counts counts() const = 0;
  // The part of counts().stored_bytes that no call before has returned.
  std::uint64_t TakeStoredBytes();

 protected:
  virtual Result<LevelInMemory> DoReadLevel(int level, ReadProgress* progress, const LevelWanted& wanted);

 private:
  BoxRoom RoomFor(int level, const Box& box, std::span<std::byte> out) const;

  std::atomic<std::uint64_t> taken_bytes_ = 0;
};

// Another source, with another description.
class DescribedSource : public VolumeSource {
 public:
  DescribedSource(std::shared_ptr<VolumeSource> source, SourceInfo info) : source_(std::move(source)), info_(std::move(info)) {}

  const SourceInfo& info() const override { return info_; }
  Counts counts() const override { return source_->counts(); }
  std::shared_ptr<VolumeSource> At(int time, int channel) final;
  using VolumeSource::Read;
  void Read(int level, const Box& box, const BoxRoom& out, std::stop_token stop, ReadDone done) override {
    source_->Read(level, box, out, std::move(stop), std::move(done));
  }

 protected:
  // `source`: another time or channel of source_; `info`: of this one, which shows those. Null: such a source has no others.
  virtual std::shared_ptr<VolumeSource> Around(std::shared_ptr<VolumeSource> /*source*/, SourceInfo /*info*/) const { return nullptr; }

  const std::shared_ptr<VolumeSource> source_;
  const SourceInfo info_;
};

}  // namespace slabstream
