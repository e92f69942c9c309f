// An external sort [Knuth, "The Art of Computer Programming", volume 3, section 5.4], then passes over the sorted cells:
//
//   1. Chunks of tetrahedra that fit the memory are sorted by their places along the curve of SortByPlace, each into a file.
//   2. The files are merged. Points are numbered by where they first occur.
//   3. Points are written in their new order, then values.
//   4. A pass over the cells fills the lattice and finds ranges and runs. Others sum up gradients, of as many points at a time as fit the
//      memory.
//
// If another store has the same mesh, as of another time, the first steps give what that one has, but for values.
#include "data/cell_store/store_cells.h"

#include <fmt/format.h>
#include <xxhash.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <queue>
#include <span>
#include <utility>
#include <vector>

#include "common/mesh/cell_runs.h"
#include "common/mesh/kept_points.h"
#include "common/parallel/parallel.h"
#include "common/volume/memory_budget.h"
#include "data/cell_store/cell_passes.h"
#include "data/cell_store/record_file.h"
#include "data/cell_store/stored_cells.h"

namespace slabstream {
namespace {

namespace fs = std::filesystem;

// The records of a file, one after the other.
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

// Cells, or points, that a step takes at a time, in whole runs.
std::uint64_t PartFor(std::uint64_t memory) {
  constexpr std::uint64_t kBytesACell = 1024, kMost = 1 << 18, kRun = CellRuns::kCells;
  return std::clamp(memory / kBytesACell / kRun * kRun, kRun, kMost);
}

struct SortedCell {
  std::uint32_t place;
  Tetrahedron points;    // numbers of the spool
  std::uint32_t number;  // of the cell there
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
    if (Status status = FindGeometry(); !status.ok()) return status;
    if (LinkSame()) {
      const Status status = Finish();
      if (status.code() != StatusCode::kDataLoss) return status;
      for (const CellFile file : kOfGeometry) Remove(kCellFileNames[std::size_t(file)]);  // the other store is damaged
      order_.reset();
    }
    const std::uint64_t points = spool_.points.size();
    if (Status fits = CheckFitsMemory(std::int64_t(points * sizeof(PointNumber)), "the numbers of a grid's points"); !fits.ok())
      return fits;
    for (Status (CellStorer::*const step)() : {&CellStorer::SortChunks, &CellStorer::Merge, &CellStorer::WritePoints}) {
      if (Status status = (this->*step)(); !status.ok()) return status;
    }
    return Finish();
  }

 private:
  std::string InFolder(const std::string& name) const { return spool_.folder + "/" + name; }
  void Remove(const std::string& name) const {
    std::error_code ignored;
    fs::remove(InFolder(name), ignored);
  }
  // Steps take about the same time a cell. Those that are taken once more tell nothing new.
  Status Tell(int step, double done) {
    told_ = std::max(told_, (step + done) / kSteps);
    return storing_.progress(told_);
  }

  // A digest of all but values.
  Status FindGeometry() {
    std::uint64_t digest = std::uint64_t(storing_.at);
    const auto add = [&](const auto& numbers) { digest = XXH3_64bits_withSeed(numbers.data(), std::span(numbers).size_bytes(), digest); };
    const Bounds3& b = storing_.bounds;
    const Index3& size = storing_.lattice.size;
    add(std::array{b.low.x, b.low.y, b.low.z, b.high.x, b.high.y, b.high.z, double(size.x), double(size.y), double(size.z)});
    add(std::array{spool_.points.size(), spool_.cells.size()});
    add(spool_.cells.digests());
    RecordStream<MeshPoint> points(spool_.points);
    while (const MeshPoint* const point = points.Next()) add(std::span(*point).first<3>());
    facts_.geometry = digest;
    return points.status();
  }

  // Whether another store has the same mesh: then its files are this one's, too.
  bool LinkSame() {
    for (const std::string& folder : storing_.others) {
      const Result<CellStoreHeader> other = ReadCellStoreHeader(folder);
      if (!other.ok() || other->facts.geometry != facts_.geometry) continue;
      std::error_code error;
      for (const CellFile file : kOfGeometry) {
        if (!error) fs::create_hard_link(PathOf(folder, file), PathOf(spool_.folder, file), error);
        digests_[std::size_t(file)] = other->digests[std::size_t(file)];
      }
      facts_.points = other->facts.points;
      const auto open = [&]<class T>(CellFile file, std::uint64_t count, std::optional<Records<T>>& to) {
        auto opened = Records<T>::Open(PathOf(spool_.folder, file), count, digests_[std::size_t(file)]);
        if (opened.ok()) to.emplace(*std::move(opened));
        return opened.ok();
      };
      if (!error && open(CellFile::kPoints, facts_.points, points_) && open(CellFile::kCells, facts_.cells, cells_) &&
          open(CellFile::kOrder, storing_.at == ValuesAt::kPoints ? facts_.points : facts_.cells, order_)) {
        return true;
      }
      for (const CellFile file : kOfGeometry) Remove(kCellFileNames[std::size_t(file)]);
    }
    return false;
  }

  // The points of the spool as those of a mesh in data space of the lattice.
  Status PlacePoints(std::span<const PointNumber> numbers, Mesh& mesh) const {
    std::vector<MeshPoint> read(numbers.size());
    if (Status status = spool_.points.ReadSome(numbers, std::span(read)); !status.ok()) return status;
    const Vec3& low = storing_.bounds.low;
    mesh.points.resize(read.size());
    for (std::size_t i = 0; i < read.size(); ++i) {
      mesh.points[i] = {float(read[i][0] - low.x), float(read[i][1] - low.y), float(read[i][2] - low.z)};
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
    return Status::Ok();
  }

  // The order of those with one place is that of the spool: within a chunk by their numbers, and chunks are merged in their order.
  Status SortChunk(std::uint64_t begin, std::uint64_t end) {
    std::vector<SortedCell> cells(std::size_t(end - begin));
    std::vector<std::uint64_t> order(cells.size());
    std::vector<Tetrahedron> tetrahedra;
    for (std::uint64_t first = begin; first < end; first += part_) {
      const auto count = std::size_t(std::min(part_, end - first));
      tetrahedra.resize(count);
      if (Status status = spool_.cells.Read(first, std::span(tetrahedra)); !status.ok()) return status;
      Mesh mesh;
      mesh.tetrahedra = tetrahedra;
      const std::vector<PointNumber> numbers = NumberAnew(mesh.tetrahedra, std::size_t(spool_.points.size()));
      if (Status status = PlacePoints(numbers, mesh); !status.ok()) return status;
      const std::vector<std::uint32_t> places = PlacesOf(mesh, storing_.lattice);
      for (std::size_t i = 0; i < count; ++i) {
        const std::size_t in_chunk = std::size_t(first - begin) + i;
        cells[in_chunk] = {places[i], tetrahedra[i], std::uint32_t(first + i)};
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
    auto of_cells = Records<std::uint32_t>::Create(InFolder("order-of-cells")),
         of_points = Records<PointNumber>::Create(InFolder("order-of-points"));
    if (!of_cells.ok()) return of_cells.status();
    if (!of_points.ok()) return of_points.status();
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
          if (Status status = of_points->Append(point); !status.ok()) return status;
        }
        point = renumbered[point];
      }
      if (Status status = cells->Append(cell.points); !status.ok()) return status;
      if (storing_.at == ValuesAt::kCells) {
        if (Status status = of_cells->Append(cell.number); !status.ok()) return status;
      }
      if (Status status = take_next(chunk); !status.ok()) return status;
      if (done % part_ != 0) continue;
      if (Status status = Tell(1, double(done) / double(facts_.cells)); !status.ok()) return status;
    }
    facts_.points = points;
    if (Status status = EndCellFile(CellFile::kCells, *cells, digests_); !status.ok()) return status;
    if (Status status = of_points->Flush(); !status.ok()) return status;
    if (Status status = of_cells->Flush(); !status.ok()) return status;
    for (std::size_t chunk = 0; chunk < sorted_.size(); ++chunk) Remove(fmt::format("sorted-{}", chunk));
    sorted_.clear();
    cells_.emplace(*std::move(cells));
    point_order_.emplace(*of_points);
    order_.emplace(storing_.at == ValuesAt::kPoints ? *std::move(of_points) : *std::move(of_cells));
    digests_[std::size_t(CellFile::kOrder)] = order_->digests();
    std::error_code error;
    fs::rename(InFolder(storing_.at == ValuesAt::kPoints ? "order-of-points" : "order-of-cells"), PathOf(spool_.folder, CellFile::kOrder),
               error);
    return error ? Status::Unavailable(fmt::format("cannot write '{}': {}", InFolder("order"), error.message())) : Status::Ok();
  }

  // Writes a record for each number of `order`: find(ascending numbers) gives those of numbers.
  template <class T, class Find>
  Result<Records<T>> WriteInOrder(CellFile number, const Records<std::uint32_t>& order, Find&& find) {
    auto file = Records<T>::Create(PathOf(spool_.folder, number));
    if (!file.ok()) return file.status();
    std::vector<std::uint32_t> numbers;
    for (std::uint64_t begin = 0; begin < order.size(); begin += part_) {
      numbers.resize(std::size_t(std::min(part_, order.size() - begin)));
      if (Status status = order.Read(begin, std::span(numbers)); !status.ok()) return status;
      std::vector<std::uint32_t> ascending = numbers;
      std::ranges::sort(ascending);
      const auto found = find(ascending);
      if (!found.ok()) return found.status();
      for (const std::uint32_t each : numbers) {
        const auto at = std::size_t(std::ranges::lower_bound(ascending, each) - ascending.begin());
        if (Status status = file->Append(T((*found)[at])); !status.ok()) return status;
      }
      if (Status status = Tell(number == CellFile::kPoints ? 2 : 3, double(begin) / double(order.size())); !status.ok()) return status;
    }
    if (Status status = EndCellFile(number, *file, digests_); !status.ok()) return status;
    return file;
  }

  Status WritePoints() {
    auto points = WriteInOrder<Vector3<float>>(CellFile::kPoints, *point_order_, [&](const std::vector<PointNumber>& numbers) {
      Mesh mesh;
      const Status placed = PlacePoints(numbers, mesh);
      return placed.ok() ? Result(std::move(mesh.points)) : placed;
    });
    if (!points.ok()) return points.status();
    points_.emplace(*std::move(points));
    return Status::Ok();
  }

  // All that depends on values.
  Status Finish() {
    auto values =
        WriteInOrder<float>(CellFile::kValues, *order_, [&](const std::vector<std::uint32_t>& numbers) -> Result<std::vector<float>> {
          std::vector<float> found(numbers.size());
          if (storing_.at == ValuesAt::kCells) {
            const Status read = spool_.values.ReadSome(numbers, std::span(found));
            return read.ok() ? Result(std::move(found)) : read;
          }
          std::vector<MeshPoint> points(numbers.size());
          if (Status read = spool_.points.ReadSome(numbers, std::span(points)); !read.ok()) return read;
          std::ranges::transform(points, found.begin(), [](const MeshPoint& point) { return float(point[3]); });
          return found;
        });
    if (!values.ok()) return values.status();
    const CellArrays arrays = {storing_.at, *points_, *cells_, *std::move(values), std::nullopt};
    CellPasses passes = {spool_.folder, &arrays, storing_.lattice, part_, storing_.memory, [&](double done) { return Tell(4, done); }};
    if (Status status = WriteLattice(passes, digests_, facts_.whole); !status.ok()) return status;
    passes.progress = [&](double done) { return Tell(5, done); };
    if (Status status = WriteGradients(passes, digests_); !status.ok()) return status;
    for (const char* name : {"spool-points", "spool-cells", "spool-values", "order-of-points", "order-of-cells"}) Remove(name);
    return WriteCellStoreHeader(spool_.folder, facts_, digests_);
  }

  static constexpr double kSteps = 6;
  static constexpr std::array kOfGeometry = {CellFile::kPoints, CellFile::kCells, CellFile::kOrder};

  CellSpool spool_;
  const CellStoring& storing_;
  const std::uint64_t part_;
  CellStoreFacts facts_;
  CellStoreDigests digests_;
  double told_ = 0;
  std::vector<RecordStream<SortedCell>> sorted_;  // by chunk
  // Once they are written, or linked.
  std::optional<Records<Vector3<float>>> points_;
  std::optional<Records<Tetrahedron>> cells_;
  std::optional<Records<PointNumber>> point_order_;  // numbers of the spool
  std::optional<Records<std::uint32_t>> order_;      // of points or of cells: CellFile::kOrder
};

}  // namespace

Status StoreCells(CellSpool spool, const CellStoring& storing) { return CellStorer(std::move(spool), storing).Store(); }

}  // namespace slabstream
