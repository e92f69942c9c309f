#include "data/cell_store/cell_passes.h"

#include <algorithm>
#include <filesystem>
#include <optional>
#include <span>
#include <utility>

#include "common/mesh/cell_runs.h"
#include "common/mesh/lattice.h"
#include "common/mesh/point_gradients.h"
#include "common/volume/memory_budget.h"

namespace slabstream {
namespace {

// Calls function(part) for all parts. What is told is a share between `from` and `to`.
template <class Function>
Status VisitParts(const CellPasses& passes, double from, double to, Function&& function) {
  const std::uint64_t cells = passes.cells->cells.size();
  for (std::uint64_t begin = 0; begin < cells; begin += passes.part) {
    const Result<CellArrays::Part> part = passes.cells->Read(begin, std::min(begin + passes.part, cells));
    if (!part.ok()) return part.status();
    if (Status status = function(*part); !status.ok()) return status;
    if (Status status = passes.progress(from + double(begin) / double(cells) * (to - from)); !status.ok()) return status;
  }
  return Status::Ok();
}

// The means of all points, in a file of this name: add(part, means) adds the cells of a part.
template <class Sum, class Add>
Result<Records<Sum>> Means(const CellPasses& passes, const std::string& name, double from, double to, Add&& add) {
  auto file = Records<Sum>::Create(passes.folder + "/" + name);
  if (!file.ok()) return file.status();
  const std::uint64_t points = passes.cells->points.size();
  const std::uint64_t window = std::max(passes.memory / (sizeof(Sum) + sizeof(double)), passes.part);
  for (std::uint64_t begin = 0; begin < points; begin += window) {
    const std::uint64_t end = std::min(begin + window, points);
    MeansOfCells<Sum> means{PointNumber(begin), PointNumber(end)};
    const double share = (to - from) / double(points);
    const Status visited = VisitParts(passes, from + share * double(begin), from + share * double(end),
                                      [&](const CellArrays::Part& part) { return add(part, means); });
    if (!visited.ok()) return visited;
    const std::vector<Sum> taken = means.Take();
    if (Status status = file->Append(std::span<const Sum>(taken)); !status.ok()) return status;
  }
  if (Status status = file->Flush(); !status.ok()) return status;
  return file;
}

// Calls function(block) for all records of a file.
template <class T, class Function>
Status VisitRecords(const Records<T>& file, Function&& function) {
  std::vector<T> block;
  for (std::uint64_t begin = 0; begin < file.size(); begin += kBlockRecords) {
    block.resize(std::size_t(std::min<std::uint64_t>(kBlockRecords, file.size() - begin)));
    if (Status status = file.Read(begin, std::span(block)); !status.ok()) return status;
    if (Status status = function(block); !status.ok()) return status;
  }
  return Status::Ok();
}

// Of as many values as there are, in the file of this number.
template <class T, class Values>
Status WriteAll(const CellPasses& passes, CellFile number, const Values& values, CellStoreDigests& digests) {
  auto file = Records<T>::Create(PathOf(passes.folder, number));
  if (!file.ok()) return file.status();
  if (Status status = file->Append(std::span<const T>(values)); !status.ok()) return status;
  return EndCellFile(number, *file, digests);
}

}  // namespace

Status WriteLattice(const CellPasses& passes, CellStoreDigests& digests, ValueRange& whole) {
  const std::int64_t voxels = passes.lattice.bounds().voxel_count();
  if (Status fits = CheckFitsMemory(voxels * std::int64_t(sizeof(float)), "the lattice of a grid"); !fits.ok()) return fits;
  Volume volume = EmptyLattice(passes.lattice);
  std::vector<CellBounds> runs;
  std::optional<CellRanges> ranges;
  const Status visited = VisitParts(passes, 0, 1, [&](const CellArrays::Part& part) {
    const CellRuns of_part(part.mesh);
    FillLattice(part.mesh, of_part, volume);
    CellRanges found = RangesOf(part.mesh, passes.lattice.size);
    if (ranges) {
      ranges->Add(found);
    } else {
      ranges = std::move(found);
    }
    runs.insert(runs.end(), of_part.bounds().begin(), of_part.bounds().end());
    return Status::Ok();
  });
  if (!visited.ok()) return visited;
  whole = ranges->whole;
  std::vector<BrickOfCells> bricks;
  for (std::size_t brick = 0; brick < ranges->bricks.size(); ++brick) bricks.push_back({ranges->bricks[brick], ranges->counts[brick]});
  if (Status status = WriteAll<CellBounds>(passes, CellFile::kRuns, runs, digests); !status.ok()) return status;
  if (Status status = WriteAll<BrickOfCells>(passes, CellFile::kBricks, bricks, digests); !status.ok()) return status;
  return WriteAll<float>(passes, CellFile::kVoxels, std::span(volume.block.samples<float>(), std::size_t(voxels)), digests);
}

Status WriteGradients(const CellPasses& passes, CellStoreDigests& digests) {
  std::optional<Records<double>> values;  // at points, of cells
  if (passes.cells->at == ValuesAt::kCells) {
    auto means = Means<double>(passes, "means", 0, 0.5, [](const CellArrays::Part& part, MeansOfCells<double>& sums) {
      AddValues(part.mesh, part.numbers, sums);
      return Status::Ok();
    });
    if (!means.ok()) return means.status();
    values.emplace(*std::move(means));
  }
  const auto gradients = Means<Vec3>(passes, "slopes", values ? 0.5 : 0, 1, [&](const CellArrays::Part& part, MeansOfCells<Vec3>& sums) {
    std::vector<double> at_points(part.mesh.values.begin(), part.mesh.values.end());
    if (values) {
      at_points.resize(part.numbers.size());
      if (Status status = values->ReadSome(part.numbers, std::span(at_points)); !status.ok()) return status;
    }
    AddGradients(part.mesh, part.numbers, at_points, sums);
    return Status::Ok();
  });
  if (!gradients.ok()) return gradients.status();
  double longest = 0;
  const Status found = VisitRecords(*gradients, [&](const std::vector<Vec3>& block) {
    for (const Vec3& gradient : block) longest = std::max(longest, Length(gradient));
    return Status::Ok();
  });
  if (!found.ok()) return found;
  auto shares = Records<Vector3<float>>::Create(PathOf(passes.folder, CellFile::kGradients));
  if (!shares.ok()) return shares.status();
  const Status written = VisitRecords(*gradients, [&](const std::vector<Vec3>& block) {
    std::vector<Vector3<float>> of_block(block.size());
    std::ranges::transform(block, of_block.begin(), [&](const Vec3& gradient) { return ShareOf(gradient, longest); });
    return shares->Append(std::span<const Vector3<float>>(of_block));
  });
  if (!written.ok()) return written;
  for (const char* name : {"means", "slopes"}) {
    std::error_code ignored;
    std::filesystem::remove(passes.folder + "/" + name, ignored);
  }
  return EndCellFile(CellFile::kGradients, *shares, digests);
}

}  // namespace slabstream
