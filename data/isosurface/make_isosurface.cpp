#include "data/isosurface/make_isosurface.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <stop_token>
#include <tuple>
#include <utility>
#include <vector>

#include "common/parallel/parallel.h"
#include "common/volume/box_assembly.h"
#include "data/isosurface/mesh_file.h"
#include "data/isosurface/mesh_parts.h"
#include "data/isosurface/surface_maker.h"
#include "data/isosurface/surface_share.h"
#include "data/survey/pieces.h"
#include "data/survey/survey.h"

namespace slabstream {
namespace {

constexpr std::int64_t kBlockVoxels = std::int64_t{1} << 20;  // of most blocks of the surface
constexpr std::array<int, 3> kSpline = {1, 4, 1};             // 6 times the cubic B-spline at -1, 0 and 1
constexpr double kHalf = 6 * 6 * 6 / 2.0;

// 216 times how much of what lies around each voxel of `box` is of the label. Beyond the border, the voxels there go on.
VoxelBlock Membership(const VoxelBlock& labels, std::uint64_t label, const Box& box) {
  VoxelBlock out = MakeVoxelBlock(box, ScalarType::kUint8);
  const Index3 size = box.size(), last = labels.box.end - Uniform(1);
  VisitLabelType(labels.type, [&]<class T>(const T* samples) {
    samples = labels.samples<T>();
    ParallelFor(0, size.y * size.z, [&](int row) {
      const Index3 first = {box.begin.x, box.begin.y + row % size.y, box.begin.z + row / size.y};
      std::vector<int> sums(std::size_t(size.x) + 2);  // over y and z, from x = first.x - 1 on
      for (int i = 0; i < 9; ++i) {
        const Index3 beside = {0, i % 3 - 1, i / 3 - 1};
        const Index3 start = Max(Min({labels.box.begin.x, first.y + beside.y, first.z + beside.z}, last), labels.box.begin);
        const T* const its = samples + labels.Offset(start);
        for (std::int32_t x = 0; x < size.x + 2; ++x) {
          const std::int32_t from = std::clamp(first.x - 1 + x, labels.box.begin.x, last.x) - labels.box.begin.x;
          if (std::uint64_t(its[from]) == label) sums[std::size_t(x)] += kSpline.at(std::size_t(i % 3)) * kSpline.at(std::size_t(i / 3));
        }
      }
      std::uint8_t* const to = out.samples<std::uint8_t>() + out.Offset(first);
      for (std::size_t x = 0; x < std::size_t(size.x); ++x) to[x] = std::uint8_t(sums[x] + 4 * sums[x + 1] + sums[x + 2]);
    });
  });
  return out;
}

// The pieces of a level, those of a column along z one after the other. All columns are cut at the same places.
std::vector<Box> Columns(const SourceInfo& info, const SourceLevel& level) {
  const VolumeGeometry& geometry = level.description.geometry;
  std::vector<Box> pieces;
  if (info.slices) {  // whole slices, each once
    const std::int64_t slice = level.description.voxel_bytes() / geometry.size.z;
    pieces =
        CutAtBlocks(geometry.bounds(), {geometry.size.x, geometry.size.y, std::int32_t(std::max<std::int64_t>(1, kPieceBytes / slice))});
  } else {
    pieces = PiecesOf(level);
  }
  std::ranges::sort(pieces, {}, [](const Box& box) { return std::tuple(box.begin.y, box.begin.x, box.begin.z); });
  return pieces;
}

// The slices of a part: those of the cells' last corners.
struct Slices {
  std::int32_t begin, end;
};

// Parts are about as thick. Where blocks are thicker than what a part needs of its neighbours, it lies in one block with its border.
Slices SlicesOf(const SurfaceShare& share, std::int32_t block, std::int32_t slices, std::int32_t reach) {
  const auto begin_of = [&](int part) {
    auto at = std::int32_t(std::int64_t{slices} * part / share.parts);
    if (part == 0 || part == share.parts || block < 4 * reach) return at;
    const std::int32_t begin = at - at % block;
    return std::clamp(at, begin + reach + 1, begin + block - reach);
  };
  return {begin_of(share.part - 1), begin_of(share.part)};
}

class Work {
 public:
  Work(VolumeSource& source, const IsosurfaceOptions& options, const LevelInMemory* whole, const VolumeDescription& level, MeshFile& file)
      : source_(source),
        options_(options),
        whole_(whole),
        level_(level),
        reach_(kSurfaceReach + (options.label ? 1 : 0)),
        slices_(SlicesOf(options.share, source.info().levels[std::size_t(options.level)].block.z, level.geometry.size.z, reach_)),
        pieces_(Columns(source.info(), source.info().levels[std::size_t(options.level)])),
        maker_(options.label ? VolumeDescription{level.geometry, ScalarType::kUint8, {}} : level, options.label ? kHalf : options.isovalue,
               options.caps),
        file_(file) {
    // What is read: a part needs the slice before it, too.
    const std::int32_t begin = std::max(slices_.begin - (slices_.begin > 0 ? 1 + reach_ : 0), 0);
    const std::int32_t end = std::min(slices_.end + reach_, level.geometry.size.z);
    for (Box& piece : pieces_) {
      piece.begin.z = std::max(piece.begin.z, begin);
      piece.end.z = std::min(piece.end.z, end);
    }
    std::erase_if(pieces_, [](const Box& piece) { return piece.begin.z >= piece.end.z; });
  }

  Status Make() {
    std::vector<Box> boxes = pieces_;
    for (Box& box : boxes) {
      const Box grown = Grown(box, reach_, level_.geometry.bounds());
      box = {{grown.begin.x, grown.begin.y, box.begin.z}, {grown.end.x, grown.end.y, box.end.z}};
    }
    std::uint64_t all_bytes = 0, done_bytes = 0;
    for (const Box& piece : pieces_) all_bytes += std::uint64_t(piece.voxel_count()) * BytesPerSample(level_.type);
    std::size_t next = 0;
    std::stop_source stop;
    Status failure;
    const auto take = [&](const VoxelBlock& read) {
      if (!failure.ok()) return;  // this piece had been read before it was told to stop
      const Box& piece = pieces_[next++];
      failure = Take(read, piece);
      done_bytes += std::uint64_t(piece.voxel_count()) * BytesPerSample(level_.type);
      if (failure.ok() && !options_.progress(done_bytes, all_bytes)) failure = Status::Cancelled("was stopped");
      if (!failure.ok()) stop.request_stop();
    };
    Status status;
    if (whole_ != nullptr) {
      for (std::size_t i = 0; i < boxes.size() && failure.ok(); ++i) take(CutBlock(whole_->volume->block, boxes[i]));
    } else {
      // A stream that is read in two places at a time would begin anew.
      status = ReadPieces(source_, options_.level, boxes, source_.info().slices ? 0 : 2, take, stop.get_token());
    }
    return failure.ok() ? status : failure;
  }
  // What the next part must know.
  std::vector<std::int32_t> LastSlice() const { return maker_.LastSlice(); }

 private:
  Status Take(const VoxelBlock& read, const Box& piece) {
    if (piece.begin.z == pieces_.front().begin.z) {  // a column begins
      window_ = {read.box, read.type, {}};
      window_.box.end.z = piece.begin.z;
      done_ = slices_.begin > 0 ? slices_.begin : maker_.domain().begin.z;
    }
    const std::int64_t slice = std::int64_t(pieces_.front().size().x) * pieces_.front().size().y;
    const auto thickness = std::int32_t(std::clamp<std::int64_t>(kBlockVoxels / slice, 1, piece.size().z));
    for (std::int32_t z = piece.begin.z; z < piece.end.z; z += thickness) {
      if (Status status = MakeUpTo(read, piece, z, std::min(z + thickness, piece.end.z)); !status.ok()) return status;
    }
    return Status::Ok();
  }

  // Moves slices [z, end) of `read` into the window, and makes what they complete.
  Status MakeUpTo(const VoxelBlock& read, const Box& piece, std::int32_t z, std::int32_t end) {
    const std::size_t slice = read.bytes.size() / std::size_t(read.box.size().z);
    const auto bytes = [&](std::int32_t slices) { return std::ptrdiff_t(slice) * slices; };
    const auto from = read.bytes.begin() + bytes(z - read.box.begin.z);
    window_.bytes.insert(window_.bytes.end(), from, from + bytes(end - z));
    window_.box.end.z = end;

    const Box& domain = maker_.domain();
    const Index3 size = level_.geometry.size;
    Box block = {piece.begin, piece.end};
    block.begin.z = done_;
    block.end.z = end == size.z ? domain.end.z : end - reach_;
    if (slices_.end < size.z) block.end.z = std::min(block.end.z, slices_.end);
    if (block.end.z <= block.begin.z) return Status::Ok();
    for (const Axis axis : {Axis::kX, Axis::kY}) {
      if (block.begin[axis] == 0) block.begin[axis] = domain.begin[axis];
      if (block.end[axis] == size[axis]) block.end[axis] = domain.end[axis];
    }
    const auto with_samples = [&](const Box& of, auto&& make) {
      if (!options_.label) return make(window_, of);
      return make(Membership(window_, *options_.label, Grown(of, kSurfaceReach, level_.geometry.bounds())), of);
    };
    if (slices_.begin > 0 && done_ == slices_.begin) {
      const Box before = {{block.begin.x, block.begin.y, done_ - 1}, {block.end.x, block.end.y, done_}};
      with_samples(before, [this](const VoxelBlock& samples, const Box& of) { maker_.Follow(samples, of); });
    }
    const Result<SurfacePart> part =
        with_samples(block, [this](const VoxelBlock& samples, const Box& of) { return maker_.Add(samples, of); });
    if (!part.ok()) return part.status();
    file_.Add(*part);
    done_ = block.end.z;
    const std::int32_t behind = std::max(done_ - reach_, window_.box.begin.z) - window_.box.begin.z;
    window_.bytes.erase(window_.bytes.begin(), window_.bytes.begin() + bytes(behind));
    window_.box.begin.z += behind;
    return Status::Ok();
  }

  VolumeSource& source_;
  const IsosurfaceOptions& options_;
  const LevelInMemory* const whole_;  // null: the source is read in pieces
  const VolumeDescription level_;
  const std::int32_t reach_;  // voxels before and behind a block that it depends on
  const Slices slices_;       // that are made
  std::vector<Box> pieces_;   // that are read
  SurfaceMaker maker_;
  MeshFile& file_;
  VoxelBlock window_;      // the slices of a column that blocks still need
  std::int32_t done_ = 0;  // where the next block of the column begins, along z
};

std::string TextOf(const IsosurfaceOptions& options) {
  return options.label ? fmt::format("label {}", *options.label) : fmt::format("isovalue {}", options.isovalue);
}

Status NoSurface(VolumeSource& source, const IsosurfaceOptions& options) {
  if (options.label)
    return Status::InvalidArgument(fmt::format("--label {}: no surface; no voxel has it, or it is too thin", *options.label));
  const Result<Survey> survey = SurveySource(source);
  if (!survey.ok()) return survey.status();
  const ValueRange& range = survey->summary->range;
  return Status::InvalidArgument(fmt::format("--isovalue {}: no surface; values are {} to {}", options.isovalue, range.min, range.max));
}

}  // namespace

Result<MeshCounts> MakeIsosurface(VolumeSource& source, const IsosurfaceOptions& options, const std::string& path) {
  const SourceInfo& info = source.info();
  const VolumeDescription& described = info.levels[std::size_t(options.level)].description;
  const SurfaceShare& share = options.share;
  if (const std::int32_t most = std::max(described.geometry.size.z / kLeastPartSlices, 1); share.parts > most) {
    return Status::InvalidArgument(fmt::format("--part {}/{}: the level has {} slices along z, so it has at most {} parts", share.part,
                                               share.parts, described.geometry.size.z, most));
  }
  std::optional<LevelInMemory> whole;
  if (info.slices && (info.slices->along != Axis::kZ || info.slices->from_end)) {
    Result<LevelInMemory> read = source.ReadLevel(options.level);
    if (!read.ok()) return read.status();
    whole = *std::move(read);
  }
  const VolumeDescription level = whole ? whole->volume->description : described;
  const std::uint64_t bytes = std::uint64_t(level.voxel_bytes());
  const auto goes_on = [&] { return options.progress(bytes, bytes); };
  const MeshOf of = {TextOf(options), WorldText(level.geometry),
                     fmt::format("level {}{}, {} x {} x {} voxels of version {:x}", options.level, options.caps ? ", caps" : "",
                                 level.geometry.size.x, level.geometry.size.y, level.geometry.size.z, info.version)};
  const bool alone = share.parts == 1;
  MeshCounts counts;
  if (alone || !HasPart(path, of, share)) {
    Result<MeshFile> file = MeshFile::Create(alone ? path : PathOfPart(path, share));
    if (!file.ok()) return file.status();
    Work work(source, options, whole ? &*whole : nullptr, level, *file);
    Status status = work.Make();
    counts = {file->vertices(), file->triangles()};
    if (status.ok() && !alone) status = FinishPart(*file, of, share, work.LastSlice(), goes_on);
    if (status.ok() && alone && counts.triangles > 0) status = file->Finish(of, goes_on);
    if (!status.ok()) return status;
  }
  if (!alone) {
    const Result<MeshCounts> joined = JoinParts(path, of, share, goes_on);
    if (!joined.ok()) return joined.status();
    counts = *joined;
  }
  return counts.whole && counts.triangles == 0 ? Result<MeshCounts>(NoSurface(source, options)) : counts;
}

}  // namespace slabstream
