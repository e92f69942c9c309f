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
#include "data/isosurface/surface_maker.h"
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

class Work {
 public:
  Work(VolumeSource& source, const IsosurfaceOptions& options, const LevelInMemory* whole, const VolumeDescription& level, MeshFile& file)
      : source_(source),
        options_(options),
        whole_(whole),
        level_(level),
        reach_(kSurfaceReach + (options.label ? 1 : 0)),
        pieces_(Columns(source.info(), source.info().levels[std::size_t(options.level)])),
        maker_(options.label ? VolumeDescription{level.geometry, ScalarType::kUint8, {}} : level, options.label ? kHalf : options.isovalue,
               options.caps),
        file_(file) {}

  Status Make() {
    std::vector<Box> boxes = pieces_;
    for (Box& box : boxes) {
      const Box grown = Grown(box, reach_, level_.geometry.bounds());
      box = {{grown.begin.x, grown.begin.y, box.begin.z}, {grown.end.x, grown.end.y, box.end.z}};
    }
    const std::uint64_t all_bytes = std::uint64_t(level_.voxel_bytes());
    std::uint64_t done_bytes = 0;
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

 private:
  Status Take(const VoxelBlock& read, const Box& piece) {
    if (read.box.begin.z == 0) {
      window_ = {read.box, read.type, {}};
      window_.box.end.z = 0;
      done_ = maker_.domain().begin.z;
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
    if (block.end.z <= block.begin.z) return Status::Ok();
    for (const Axis axis : {Axis::kX, Axis::kY}) {
      if (block.begin[axis] == 0) block.begin[axis] = domain.begin[axis];
      if (block.end[axis] == size[axis]) block.end[axis] = domain.end[axis];
    }
    const Result<SurfacePart> part =
        options_.label ? maker_.Add(Membership(window_, *options_.label, Grown(block, kSurfaceReach, level_.geometry.bounds())), block)
                       : maker_.Add(window_, block);
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
  const std::vector<Box> pieces_;
  SurfaceMaker maker_;
  MeshFile& file_;
  VoxelBlock window_;      // the slices of a column that blocks still need
  std::int32_t done_ = 0;  // where the next block of the column begins, along z
};

}  // namespace

Result<MeshCounts> MakeIsosurface(VolumeSource& source, const IsosurfaceOptions& options, const std::string& path) {
  const SourceInfo& info = source.info();
  std::optional<LevelInMemory> whole;
  if (info.slices && (info.slices->along != Axis::kZ || info.slices->from_end)) {
    Result<LevelInMemory> read = source.ReadLevel(options.level);
    if (!read.ok()) return read.status();
    whole = *std::move(read);
  }
  const VolumeDescription level = whole ? whole->volume->description : info.levels[std::size_t(options.level)].description;
  Result<MeshFile> file = MeshFile::Create(path);
  if (!file.ok()) return file.status();
  Work work(source, options, whole ? &*whole : nullptr, level, *file);
  if (Status status = work.Make(); !status.ok()) return status;
  if (file->triangles() == 0) {
    if (options.label)
      return Status::InvalidArgument(fmt::format("--label {}: no surface; no voxel has it, or it is too thin", *options.label));
    const Result<Survey> survey = SurveySource(source);
    if (!survey.ok()) return survey.status();
    const ValueRange& range = survey->summary->range;
    return Status::InvalidArgument(fmt::format("--isovalue {}: no surface; values are {} to {}", options.isovalue, range.min, range.max));
  }
  const std::uint64_t bytes = std::uint64_t(level.voxel_bytes());
  const std::string about = options.label ? fmt::format("label {}", *options.label) : fmt::format("isovalue {}", options.isovalue);
  const Status status = file->Finish(about, level.geometry, [&] { return options.progress(bytes, bytes); });
  if (!status.ok()) return status;
  return MeshCounts{file->vertices(), file->triangles()};
}

}  // namespace slabstream
