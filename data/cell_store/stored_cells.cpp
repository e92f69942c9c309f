#include "data/cell_store/stored_cells.h"

#include <fmt/format.h>
#include <xxhash.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <numeric>
#include <utility>

#include "common/files/files.h"
#include "common/mesh/kept_points.h"
#include "common/mesh/lattice.h"
#include "common/volume/bricks.h"
#include "common/volume/memory_budget.h"

namespace slabstream {
namespace {

constexpr std::array<char, 8> kMagic = {'S', 'L', 'A', 'B',
                                        'C', 'E', 'L', '1'};  // the last one: to be raised when files are written otherwise
constexpr std::uint64_t kMostHeaderBytes = std::uint64_t{1} << 30, kMostNotesBytes = 1 << 20;
constexpr std::uint64_t kPartCells = 1 << 18;  // that Visit reads at a time

struct Header {
  std::array<char, 8> magic = kMagic;
  std::uint64_t points = 0, cells = 0;
  std::uint32_t at = 0;
  std::array<std::int32_t, 3> size = {};
  std::array<double, 3> spacing = {}, origin = {}, low = {}, high = {};
  std::uint64_t points_read = 0, geometry = 0;
  std::array<std::uint64_t, kMostKinds> kinds = {};
  ValueRange whole;
  std::uint64_t notes = 0;  // bytes
};
static_assert(sizeof(Header) == 296 && std::is_trivially_copyable_v<Header>);

std::uint64_t BlocksOf(std::uint64_t records) { return (records + kBlockRecords - 1) / kBlockRecords; }
std::uint64_t RunsOf(std::uint64_t cells) { return (cells + CellRuns::kCells - 1) / CellRuns::kCells; }

// Records of each file.
std::array<std::uint64_t, kCellFileNames.size()> CountsOf(const CellStoreFacts& facts) {
  const Index3& size = facts.lattice.size;
  return {facts.points,
          facts.points,
          facts.cells,
          facts.at == ValuesAt::kPoints ? facts.points : facts.cells,
          RunsOf(facts.cells),
          CountIn(CubesOver(size, kBrick)),
          std::uint64_t(Box{{0, 0, 0}, size}.voxel_count()),
          facts.at == ValuesAt::kPoints ? facts.points : facts.cells};
}

bool IsSound(const Header& header) {
  const auto in = [](auto value, auto least, auto most) { return value >= least && value <= most; };
  return header.magic == kMagic && in(header.points, std::uint64_t{4}, std::uint64_t(kMaxMeshPoints)) &&
         in(header.cells, std::uint64_t{1}, std::uint64_t(kMaxTetrahedra)) && header.at <= std::uint32_t(ValuesAt::kCells) &&
         std::ranges::all_of(header.size, [&](std::int32_t side) { return in(side, 1, kMaxLatticeSide); }) &&
         header.notes <= kMostNotesBytes;
}

template <class T>
Result<std::vector<T>> ReadAll(const Records<T>& file) {
  std::vector<T> all(std::size_t(file.size()));
  const Status read = file.Read(0, std::span(all));
  return read.ok() ? Result(std::move(all)) : read;
}

}  // namespace

Result<CellStoreHeader> ReadCellStoreHeader(const std::string& folder) {
  const std::string path = folder + "/header";
  const auto wrong = [&](const char* why) { return Status::DataLoss(fmt::format("'{}' {}", path, why)); };
  const Result<std::string> text = ReadTextFile(path, kMostHeaderBytes);
  if (!text.ok()) return wrong("cannot be read");
  std::uint64_t digest = 0;
  if (text->size() < sizeof(Header) + sizeof digest) return wrong("is truncated");
  const std::size_t end = text->size() - sizeof digest;
  std::memcpy(&digest, text->data() + end, sizeof digest);
  Header header;
  std::memcpy(&header, text->data(), sizeof header);
  if (XXH3_64bits(text->data(), end) != digest || !IsSound(header)) return wrong("is no header of a cell store of this version");
  CellStoreHeader read;
  read.digest = fmt::format("{:x}", digest);
  CellStoreFacts& facts = read.facts;
  facts.at = ValuesAt(header.at);
  facts.points = header.points;
  facts.cells = header.cells;
  for (int axis = 0; axis < 3; ++axis) {
    facts.lattice.size[axis] = header.size[std::size_t(axis)];
    facts.lattice.spacing[axis] = header.spacing[std::size_t(axis)];
    facts.lattice.orientation.origin[axis] = header.origin[std::size_t(axis)];
    facts.bounds.low[axis] = header.low[std::size_t(axis)];
    facts.bounds.high[axis] = header.high[std::size_t(axis)];
  }
  facts.lattice.orientation.world = World::kScene;
  facts.whole = header.whole;
  facts.points_read = header.points_read;
  facts.geometry = header.geometry;
  facts.kinds = header.kinds;
  std::size_t at = sizeof header;
  const auto counts = CountsOf(facts);
  for (std::size_t file = 0; file < counts.size(); ++file) {
    std::vector<std::uint64_t>& of_file = read.digests[file];
    const std::uint64_t bytes = BlocksOf(counts[file]) * sizeof(std::uint64_t);
    if (bytes > end - at) return wrong("is truncated");
    of_file.resize(bytes / sizeof(std::uint64_t));
    std::memcpy(of_file.data(), text->data() + at, bytes);
    at += bytes;
  }
  if (header.notes != end - at) return wrong("is truncated");
  for (std::size_t line; at < end; at = line + 1) {
    line = std::min(text->find('\n', at), end);
    facts.notes.push_back(text->substr(at, line - at));
  }
  return read;
}

Status WriteCellStoreHeader(const std::string& folder, const CellStoreFacts& facts, const CellStoreDigests& digests) {
  std::string notes;
  for (const std::string& note : facts.notes) notes += note + "\n";
  Header header = {.points = facts.points,
                   .cells = facts.cells,
                   .at = std::uint32_t(facts.at),
                   .points_read = facts.points_read,
                   .geometry = facts.geometry,
                   .kinds = facts.kinds,
                   .whole = facts.whole,
                   .notes = notes.size()};
  for (int axis = 0; axis < 3; ++axis) {
    header.size[std::size_t(axis)] = facts.lattice.size[axis];
    header.spacing[std::size_t(axis)] = facts.lattice.spacing[axis];
    header.origin[std::size_t(axis)] = facts.lattice.orientation.origin[axis];
    header.low[std::size_t(axis)] = facts.bounds.low[axis];
    header.high[std::size_t(axis)] = facts.bounds.high[axis];
  }
  std::string text(sizeof header, '\0');
  std::memcpy(text.data(), &header, sizeof header);
  for (const std::vector<std::uint64_t>& of_file : digests) {
    text.append(reinterpret_cast<const char*>(of_file.data()), of_file.size() * sizeof(std::uint64_t));
  }
  text += notes;
  const std::uint64_t digest = XXH3_64bits(text.data(), text.size());
  text.append(reinterpret_cast<const char*>(&digest), sizeof digest);
  return WritePrivateTextFile(folder + "/header", text);
}

Result<CellArrays::Part> CellArrays::Read(std::span<const std::uint32_t> numbers) const {
  const auto fits = [](std::size_t bytes) { return CheckFitsMemory(std::int64_t(bytes), "a box of cells"); };
  if (Status status = fits(numbers.size() * (sizeof(Tetrahedron) + sizeof(float))); !status.ok()) return status;
  Part part;
  Mesh& mesh = part.mesh;
  mesh.at = at;
  mesh.tetrahedra.resize(numbers.size());
  if (Status read = cells.ReadSome(numbers, std::span(mesh.tetrahedra)); !read.ok()) return read;
  part.numbers = NumberAnew(mesh.tetrahedra, std::size_t(points.size()));
  if (Status status = fits(part.numbers.size() * (2 * sizeof(Vector3<float>) + sizeof(float))); !status.ok()) return status;
  const std::span<const std::uint32_t> of_values = at == ValuesAt::kPoints ? std::span<const std::uint32_t>(part.numbers) : numbers;
  mesh.points.resize(part.numbers.size());
  mesh.values.resize(of_values.size());
  if (Status read = points.ReadSome(part.numbers, std::span(mesh.points)); !read.ok()) return read;
  if (Status read = values.ReadSome(of_values, std::span(mesh.values)); !read.ok()) return read;
  if (!gradients) return part;
  mesh.gradients.resize(part.numbers.size());
  const Status read = gradients->ReadSome(part.numbers, std::span(mesh.gradients));
  return read.ok() ? Result(std::move(part)) : read;
}

Result<CellArrays::Part> CellArrays::Read(std::uint64_t begin, std::uint64_t end) const {
  std::vector<std::uint32_t> numbers(std::size_t(end - begin));
  std::iota(numbers.begin(), numbers.end(), std::uint32_t(begin));
  return Read(numbers);
}

StoredCells::StoredCells(std::string folder, CellStoreFacts facts, std::string digest, CellArrays arrays, Records<float> voxels,
                         std::vector<CellBounds> runs, std::vector<BrickOfCells> bricks, std::shared_ptr<const void> in_use)
    : folder_(std::move(folder)),
      facts_(std::move(facts)),
      digest_(std::move(digest)),
      arrays_(std::move(arrays)),
      voxels_(std::move(voxels)),
      runs_(std::move(runs)),
      bricks_(std::move(bricks)),
      in_use_(std::move(in_use)) {}

Result<std::shared_ptr<StoredCells>> StoredCells::Open(const std::string& folder, std::shared_ptr<const void> in_use) {
  Result<CellStoreHeader> header = ReadCellStoreHeader(folder);
  if (!header.ok()) return header.status();
  auto& [facts, digests, digest] = *header;
  const auto counts = CountsOf(facts);
  const auto open = [&]<class T>(CellFile file, const T*) {
    return Records<T>::Open(PathOf(folder, file), counts[std::size_t(file)], std::move(digests[std::size_t(file)]));
  };
  constexpr const Vector3<float>* kVector = nullptr;
  constexpr const float* kFloat = nullptr;
  auto points = open(CellFile::kPoints, kVector), gradients = open(CellFile::kGradients, kVector);
  auto cells = open(CellFile::kCells, static_cast<const Tetrahedron*>(nullptr));
  auto values = open(CellFile::kValues, kFloat), voxels = open(CellFile::kVoxels, kFloat);
  auto runs = open(CellFile::kRuns, static_cast<const CellBounds*>(nullptr));
  auto bricks = open(CellFile::kBricks, static_cast<const BrickOfCells*>(nullptr));
  for (const Status& status :
       {points.status(), gradients.status(), cells.status(), values.status(), voxels.status(), runs.status(), bricks.status()}) {
    if (!status.ok()) return Status::DataLoss(status.message());
  }
  Result<std::vector<CellBounds>> all_runs = ReadAll(*runs);
  if (!all_runs.ok()) return all_runs.status();
  Result<std::vector<BrickOfCells>> all_bricks = ReadAll(*bricks);
  if (!all_bricks.ok()) return all_bricks.status();
  CellArrays arrays = {facts.at, *std::move(points), *std::move(cells), *std::move(values), *std::move(gradients)};
  return std::shared_ptr<StoredCells>(new StoredCells(folder, std::move(facts), std::move(digest), std::move(arrays), *std::move(voxels),
                                                      *std::move(all_runs), *std::move(all_bricks), std::move(in_use)));
}

Status StoredCells::Told(const Status& status) const {
  if (status.code() != StatusCode::kDataLoss) return status;
  return Status::DataLoss(fmt::format("{}; remove the folder '{}', and it is made again", status.message(), folder_));
}

Result<Volume> StoredCells::ReadLattice() const {
  const std::int64_t bytes = std::int64_t(voxels_.size() * sizeof(float));
  if (Status fits = CheckFitsMemory(bytes, "the lattice of a grid"); !fits.ok()) return fits;
  Volume volume;
  volume.description = {facts_.lattice, ScalarType::kFloat32, {}};
  volume.block = MakeVoxelBlock(facts_.lattice.bounds(), ScalarType::kFloat32);
  const Status read = voxels_.Read(0, std::span(volume.block.samples<float>(), std::size_t(voxels_.size())));
  return read.ok() ? Result(std::move(volume)) : Told(read);
}

Result<Mesh> StoredCells::CellsIn(const Box& box) const {
  Mesh mesh;
  mesh.at = facts_.at;
  if (box.empty()) return mesh;
  const CellBounds space = SpaceOf(box);
  std::vector<std::uint32_t> numbers;
  for (std::size_t run = 0; run < runs_.size(); ++run) {
    if (!Touch(runs_[run], space)) continue;
    const std::uint64_t end = std::min<std::uint64_t>((run + 1) * CellRuns::kCells, facts_.cells);
    for (std::uint64_t cell = run * CellRuns::kCells; cell < end; ++cell) numbers.push_back(std::uint32_t(cell));
  }
  Result<CellArrays::Part> part = arrays_.Read(numbers);
  if (!part.ok()) return Told(part.status());
  // Then as bytes.
  if (Status fits = CheckFitsMemory(2 * std::int64_t(part->mesh.bytes()), "a box of cells"); !fits.ok()) return fits;
  return CellsTouching(part->mesh, space);
}

Status StoredCells::Visit(const std::function<void(const Mesh&)>& function) const {
  for (std::uint64_t begin = 0; begin < facts_.cells; begin += kPartCells) {
    const Result<CellArrays::Part> part = arrays_.Read(begin, std::min(begin + kPartCells, facts_.cells));
    if (!part.ok()) return Told(part.status());
    function(part->mesh);
  }
  return Status::Ok();
}

CellRanges StoredCells::Ranges(const Index3& /*size*/) const {
  CellRanges ranges = {.whole = facts_.whole, .bricks = {}, .counts = {}};
  for (const BrickOfCells& brick : bricks_) {
    ranges.bricks.push_back(brick.range);
    ranges.counts.push_back(brick.count);
  }
  return ranges;
}

std::uint64_t StoredCells::bytes() const { return runs_.capacity() * sizeof(runs_[0]) + bricks_.capacity() * sizeof(bricks_[0]); }

}  // namespace slabstream
