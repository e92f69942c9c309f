// StoredCells: the cells of a grid that does not fit the memory, in the order of SortByPlace, in a folder of files: a cell store.
//
//   points      float32 x, y, z                in data space of the lattice
//   gradients   float32 x, y, z                by point (PointGradients)
//   cells       uint32 a, b, c, d              the points of each tetrahedron
//   values      float32                        by point or by tetrahedron
//   runs        float32 low x, y, z, high ...  what each run of 256 tetrahedra lies in (CellRuns)
//   bricks      float32 min, max, uint32       by brick of the lattice: CellRanges
//   voxels      float32                        the values on the lattice
//   order       uint32                         by value: the number of its point or cell as the grid was read
//   header      how many there are of all, and a digest of each block of each file
//
// Numbers are little-endian. It is read part by part; what is held of it are runs and bricks, about a byte for ten tetrahedra. A part is
// the same as of the grid in memory, bit for bit. StoreCells (store_cells.h) makes the files.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/mesh/lattice.h"
#include "common/mesh/mesh_part.h"
#include "common/volume/volume.h"
#include "data/cell_store/record_file.h"

namespace slabstream {

// The arrays of a sorted grid in files.
struct CellArrays {
  ValuesAt at = ValuesAt::kPoints;
  Records<Vector3<float>> points;
  Records<Tetrahedron> cells;
  Records<float> values;
  std::optional<Records<Vector3<float>>> gradients;

  struct Part {
    Mesh mesh;
    std::vector<PointNumber> numbers;  // of its points in the grid, ascending
  };
  // Of the cells of these ascending numbers. ResourceExhausted.
  Result<Part> Read(std::span<const std::uint32_t> numbers) const;
  // The same of the cells [begin, end).
  Result<Part> Read(std::uint64_t begin, std::uint64_t end) const;
};

struct BrickOfCells {
  ValueRange range;
  std::uint32_t count = 0;
};

inline constexpr std::size_t kMostKinds = 16;

// The facts of a cell store that its header has beside digests.
struct CellStoreFacts {
  ValuesAt at = ValuesAt::kPoints;
  std::uint64_t points = 0, cells = 0;
  VolumeGeometry lattice;
  Bounds3 bounds;                                 // of all points that were read
  std::uint64_t points_read = 0;                  // also those of no cell
  std::uint64_t geometry = 0;                     // a digest of points and cells as they were read, without values
  std::array<std::uint64_t, kMostKinds> kinds{};  // cells that were read, by number of CellKinds()
  ValueRange whole;                               // of all cells
  std::vector<std::string> notes;                 // a sentence each of what was left out
};

enum class CellFile : std::uint8_t { kPoints, kGradients, kCells, kValues, kRuns, kBricks, kVoxels, kOrder };
inline constexpr std::array<const char*, 8> kCellFileNames = {"points", "gradients", "cells",  "values",
                                                              "runs",   "bricks",    "voxels", "order"};
using CellStoreDigests = std::array<std::vector<std::uint64_t>, kCellFileNames.size()>;  // by CellFile
inline std::string PathOf(const std::string& folder, CellFile file) { return folder + "/" + kCellFileNames[std::size_t(file)]; }
// Ends the file of this number, and keeps its digests.
template <class T>
Status EndCellFile(CellFile number, Records<T>& file, CellStoreDigests& digests) {
  const Status status = file.Flush();
  digests[std::size_t(number)] = file.digests();
  return status;
}
struct CellStoreHeader {
  CellStoreFacts facts;
  CellStoreDigests digests;
  std::string digest;  // of all that
};
// DataLoss, naming the file: damaged, truncated, or of another version.
Result<CellStoreHeader> ReadCellStoreHeader(const std::string& folder);
Status WriteCellStoreHeader(const std::string& folder, const CellStoreFacts& facts, const CellStoreDigests& digests);

class StoredCells : public GridCells {
 public:
  // `in_use`: is destroyed with the last user of the cells. DataLoss, naming a file: damaged, truncated, or none of this version.
  static Result<std::shared_ptr<StoredCells>> Open(const std::string& folder, std::shared_ptr<const void> in_use = nullptr);

  const CellStoreFacts& facts() const { return facts_; }
  // The grid's values on the lattice.
  Result<Volume> ReadLattice() const;

  Result<Mesh> CellsIn(const Box& box) const override;
  Status Visit(const std::function<void(const Mesh&)>& function) const override;
  CellRanges Ranges(const Index3& size) const override;
  std::string Digest() const override { return digest_; }
  std::uint64_t bytes() const override;

 private:
  StoredCells(std::string folder, CellStoreFacts facts, std::string digest, CellArrays arrays, Records<float> voxels,
              std::vector<CellBounds> runs, std::vector<BrickOfCells> bricks, std::shared_ptr<const void> in_use);
  Status Told(const Status& status) const;  // says what helps

  const std::string folder_;
  const CellStoreFacts facts_;
  const std::string digest_;
  const CellArrays arrays_;
  const Records<float> voxels_;
  const std::vector<CellBounds> runs_;
  const std::vector<BrickOfCells> bricks_;
  const std::shared_ptr<const void> in_use_;
};

}  // namespace slabstream
