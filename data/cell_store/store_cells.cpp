// An external sort [Knuth, "The Art of Computer Programming", volume 3, section 5.4], then passes over the sorted cells:
//
//   1. Chunks of tetrahedra that fit the memory are sorted by their places along the curve of SortByPlace, each into a file.
//   2. The files are merged. Points are numbered by where they first occur.
//   3. Points and their values are written in their new order.
//   4. A pass over the cells fills the lattice and finds ranges and runs. Others sum up gradients, of as many points at a time as fit the
//      memory.
#include "data/cell_store/store_cells.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <optional>
#include <queue>
#include <span>
#include <utility>

#include "common/mesh/cell_runs.h"
#include "common/mesh/kept_points.h"
#include "common/parallel/parallel.h"
#include "common/volume/memory_budget.h"
#include "data/cell_store/cell_passes.h"
#include "data/cell_store/stored_cells.h"

namespace slabstream {
namespace {

namespace fs = std::filesystem;

// Cells, or points, that a step takes at a time, in whole runs.
std::uint64_t PartFor(std::uint64_t memory) {
  constexpr std::uint64_t kBytesACell = 1024, kMost = 1 << 18, kRun = CellRuns::kCells;
  return std::clamp(memory / kBytesACell / kRun * kRun, kRun, kMost);
}

struct SortedCell {
  std::uint32_t place;
  Tetrahedron points;  // numbers of the spool
  float value;         // of the cell, if values belong to cells
};

// Records of a file, one after the other.
template <class T>
class RecordStream {
 public:
  explicit RecordStream(Records<T> file) : file_(std::move(file)) {}
  // Null: there is no other, or it cannot be read.
  const T* Next() {
    if (at_ == buffer_.size()) {
      buffer_.resize(std::size_t(std::min<std::uint64_t>(kBlockRecords, file_.size() - read_)));
      status_ = file_.Read(read_, std::span(buffer_));
      if (!status_.ok()) return nullptr;
      read_ += buffer_.size();
      at_ = 0;
    }
    return buffer_.empty() ? nullptr : &buffer_[at_++];
  }
  const Status& status() const { return status_; }

 private:
  Records<T> file_;
  std::vector<T> buffer_;
  std::size_t at_ = 0;
  std::uint64_t read_ = 0;
  Status status_;
};

class CellStorer {
 public:
  CellStorer(CellSpool spool, const CellStoring& storing) : spool_(std::move(spool)), storing_(storing), part_(PartFor(storing.memory)) {
    facts_ = {.at = storing.at,
              .cells = spool_.cells.size(),
              .lattice = storing.lattice,
              .bounds = storing.bounds,
              .points_read = spool_.points.size(),
              .kinds = storing.kinds,
              .notes = storing.notes};
  }

  Status Store() {
    const std::uint64_t points = spool_.points.size();
    if (Status fits = CheckFitsMemory(std::int64_t(points * sizeof(PointNumber)), "the numbers of a grid's points"); !fits.ok())
      return fits;
    for (Status (CellStorer::*const step)() : {&CellStorer::SortChunks, &CellStorer::Merge, &CellStorer::WritePoints}) {
      if (Status status = (this->*step)(); !status.ok()) return status;
    }
    CellPasses passes = {spool_.folder, &*arrays_, storing_.lattice, part_, storing_.memory, [&](double done) { return Tell(3, done); }};
    if (Status status = WriteLattice(passes, digests_, facts_.whole); !status.ok()) return status;
    passes.progress = [&](double done) { return Tell(4, done); };
    if (Status status = WriteGradients(passes, digests_); !status.ok()) return status;
    return WriteCellStoreHeader(spool_.folder, facts_, digests_);
  }

 private:
  std::string InFolder(const std::string& name) const { return spool_.folder + "/" + name; }
  void Remove(const std::string& name) const {
    std::error_code ignored;
    fs::remove(InFolder(name), ignored);
  }
  // Steps take about the same time a cell.
  Status Tell(int step, double done) const { return storing_.progress((step + done) / kSteps); }

  // The points of the spool as those of a mesh in data space of the lattice.
  Status PlacePoints(std::span<const PointNumber> numbers, Mesh& mesh, std::vector<float>* values = nullptr) const {
    std::vector<MeshPoint> read(numbers.size());
    if (Status status = spool_.points.ReadSome(numbers, std::span(read)); !status.ok()) return status;
    const Vec3& low = storing_.bounds.low;
    mesh.points.resize(read.size());
    for (std::size_t i = 0; i < read.size(); ++i) {
      const auto& [x, y, z, value] = read[i];
      mesh.points[i] = {float(x - low.x), float(y - low.y), float(z - low.z)};
      if (values != nullptr) values->push_back(float(value));
    }
    MoveToLattice(storing_.lattice, mesh);
    return Status::Ok();
  }

  Status SortChunks() {
    constexpr std::uint64_t kBytesACell = 2 * sizeof(SortedCell) + sizeof(std::uint64_t);
    const std::uint64_t chunk = std::max(storing_.memory / kBytesACell, part_);
    for (std::uint64_t begin = 0; begin < facts_.cells; begin += chunk) {
      if (Status status = SortChunk(begin, std::min(begin + chunk, facts_.cells)); !status.ok()) return status;
    }
    Remove("spool-cells");
    Remove("spool-values");
    return Status::Ok();
  }

  // The order of those with one place is that of the spool: within a chunk by their numbers, and chunks are merged in their order.
  Status SortChunk(std::uint64_t begin, std::uint64_t end) {
    std::vector<SortedCell> cells(std::size_t(end - begin));
    std::vector<std::uint64_t> order(cells.size());
    std::vector<Tetrahedron> tetrahedra;
    std::vector<float> values;
    for (std::uint64_t first = begin; first < end; first += part_) {
      const auto count = std::size_t(std::min(part_, end - first));
      tetrahedra.resize(count);
      values.assign(count, 0);
      if (Status status = spool_.cells.Read(first, std::span(tetrahedra)); !status.ok()) return status;
      if (storing_.at == ValuesAt::kCells) {
        if (Status status = spool_.values.Read(first, std::span(values)); !status.ok()) return status;
      }
      Mesh mesh;
      mesh.tetrahedra = tetrahedra;
      const std::vector<PointNumber> numbers = NumberAnew(mesh.tetrahedra, std::size_t(spool_.points.size()));
      if (Status status = PlacePoints(numbers, mesh); !status.ok()) return status;
      const std::vector<std::uint32_t> places = PlacesOf(mesh, storing_.lattice);
      for (std::size_t i = 0; i < count; ++i) {
        const std::size_t in_chunk = std::size_t(first - begin) + i;
        cells[in_chunk] = {places[i], tetrahedra[i], values[i]};
        order[in_chunk] = std::uint64_t{places[i]} << 32 | in_chunk;
      }
      if (Status status = Tell(0, double(first) / double(facts_.cells)); !status.ok()) return status;
    }
    ParallelSort(order);
    auto file = Records<SortedCell>::Create(InFolder(fmt::format("sorted-{}", sorted_.size())));
    if (!file.ok()) return file.status();
    for (const std::uint64_t key : order) {
      if (Status status = file->Append(cells[key & 0xFFFFFFFF]); !status.ok()) return status;
    }
    if (Status status = file->Flush(); !status.ok()) return status;
    sorted_.emplace_back(*std::move(file));
    return Status::Ok();
  }

  Status Merge() {
    constexpr PointNumber kNone = ~PointNumber{0};
    auto cells = Records<Tetrahedron>::Create(PathOf(spool_.folder, CellFile::kCells));
    if (!cells.ok()) return cells.status();
    auto values = Records<float>::Create(PathOf(spool_.folder, CellFile::kValues));
    if (!values.ok()) return values.status();
    auto order = Records<PointNumber>::Create(InFolder("order"));
    if (!order.ok()) return order.status();
    std::vector<PointNumber> renumbered(std::size_t(spool_.points.size()), kNone);
    PointNumber points = 0;
    std::vector<const SortedCell*> front(sorted_.size());
    using Next = std::pair<std::uint32_t, std::size_t>;  // the place, and whose front it is
    std::priority_queue<Next, std::vector<Next>, std::greater<>> next;
    const auto take_next = [&](std::size_t chunk) {
      front[chunk] = sorted_[chunk].Next();
      if (front[chunk] != nullptr) next.emplace(front[chunk]->place, chunk);
      return sorted_[chunk].status();
    };
    for (std::size_t chunk = 0; chunk < sorted_.size(); ++chunk) {
      if (Status status = take_next(chunk); !status.ok()) return status;
    }
    for (std::uint64_t done = 0; !next.empty(); ++done) {
      const std::size_t chunk = next.top().second;
      next.pop();
      SortedCell cell = *front[chunk];
      for (PointNumber& point : cell.points) {
        if (renumbered[point] == kNone) {
          renumbered[point] = points++;
          if (Status status = order->Append(point); !status.ok()) return status;
        }
        point = renumbered[point];
      }
      if (Status status = cells->Append(cell.points); !status.ok()) return status;
      if (storing_.at == ValuesAt::kCells) {
        if (Status status = values->Append(cell.value); !status.ok()) return status;
      }
      if (Status status = take_next(chunk); !status.ok()) return status;
      if (done % part_ != 0) continue;
      if (Status status = Tell(1, double(done) / double(facts_.cells)); !status.ok()) return status;
    }
    facts_.points = points;
    if (Status status = EndCellFile(CellFile::kCells, *cells, digests_); !status.ok()) return status;
    if (Status status = order->Flush(); !status.ok()) return status;
    for (std::size_t chunk = 0; chunk < sorted_.size(); ++chunk) Remove(fmt::format("sorted-{}", chunk));
    sorted_.clear();
    cells_.emplace(*std::move(cells));
    values_.emplace(*std::move(values));
    order_.emplace(*std::move(order));
    return Status::Ok();
  }

  Status WritePoints() {
    auto points = Records<Vector3<float>>::Create(PathOf(spool_.folder, CellFile::kPoints));
    if (!points.ok()) return points.status();
    for (std::uint64_t begin = 0; begin < facts_.points; begin += part_) {
      std::vector<PointNumber> old(std::size_t(std::min(part_, facts_.points - begin)));
      if (Status status = order_->Read(begin, std::span(old)); !status.ok()) return status;
      std::vector<PointNumber> ascending = old;
      std::ranges::sort(ascending);
      Mesh mesh;
      std::vector<float> values;
      if (Status status = PlacePoints(ascending, mesh, &values); !status.ok()) return status;
      AlignedVector<Vector3<float>> in_order;
      std::vector<float> values_in_order;
      for (const PointNumber point : old) {
        const auto i = std::size_t(std::ranges::lower_bound(ascending, point) - ascending.begin());
        in_order.push_back(mesh.points[i]);
        values_in_order.push_back(values[i]);
      }
      if (Status status = points->Append(std::span<const Vector3<float>>(in_order)); !status.ok()) return status;
      if (storing_.at == ValuesAt::kPoints) {
        if (Status status = values_->Append(std::span<const float>(values_in_order)); !status.ok()) return status;
      }
      if (Status status = Tell(2, double(begin) / double(facts_.points)); !status.ok()) return status;
    }
    if (Status status = EndCellFile(CellFile::kPoints, *points, digests_); !status.ok()) return status;
    if (Status status = EndCellFile(CellFile::kValues, *values_, digests_); !status.ok()) return status;
    order_.reset();
    Remove("order");
    Remove("spool-points");
    arrays_.emplace(CellArrays{storing_.at, *std::move(points), *std::move(cells_), *std::move(values_), std::nullopt});
    return Status::Ok();
  }

  static constexpr double kSteps = 5;

  CellSpool spool_;
  const CellStoring& storing_;
  const std::uint64_t part_;
  CellStoreFacts facts_;
  CellStoreDigests digests_;
  std::vector<RecordStream<SortedCell>> sorted_;  // by chunk
  // While they are written.
  std::optional<Records<Tetrahedron>> cells_;
  std::optional<Records<float>> values_;
  std::optional<Records<PointNumber>> order_;  // numbers of the spool, in the order of the store
  std::optional<CellArrays> arrays_;           // all but gradients
};

}  // namespace

Status StoreCells(CellSpool spool, const CellStoring& storing) { return CellStorer(std::move(spool), storing).Store(); }

}  // namespace slabstream
