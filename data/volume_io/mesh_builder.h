// Makes a mesh of the contents of an unstructured grid's file of any format, and says what is wrong with it. The calls come in the
// order of their declarations; after an error there are no more. Errors name the path.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "common/base/status.h"
#include "common/memory/aligned_buffer.h"
#include "data/volume_io/mesh_reader.h"

namespace slabstream {

class MeshBuilder {
 public:
  // `format`: for the user.
  MeshBuilder(std::string path, std::string format);

  // What the file has. The number of the array that is read: errors of ChooseArray (grid_arrays.h) and CheckChannel (raw_volume.h).
  Result<std::size_t> SetArrays(std::vector<GridArray> arrays, const MeshOptions& options);
  // x, y and z of each point, in the world. InvalidArgument: a place that is not finite, an extent that is too small or too large.
  Status SetPoints(const AlignedVector<double>& places);
  // The cells' kinds by VTK's numbers, and for each cell where its points end among those of all cells, which follow each other.
  // InvalidArgument: a kind that is not supported. DataLoss: ends that do not fit the kinds. ResourceExhausted: too many.
  Status SetCells(const AlignedVector<std::int64_t>& kinds, const AlignedVector<std::int64_t>& ends);
  // The points of the next cells, whole ones: as many as the kinds have. They count from the point `first` and are below `points`.
  // DataLoss: numbers of points that there are not.
  Status AddCorners(const AlignedVector<std::int64_t>& corners, std::int64_t first, std::int64_t points);
  // The values of the chosen array, all components of each point or cell of the file. InvalidArgument: no cell has a volume.
  Status SetValues(const AlignedVector<float>& values);
  LoadedMesh Take() { return std::move(result_); }

 private:
  Status Wrong(const std::string& why) const { return Status::InvalidArgument(path_ + ": " + why); }
  Status Damaged(const std::string& why) const { return Status::DataLoss(path_ + ": " + why); }
  // Takes memory for what the cells of info.kinds make.
  Status ReserveTetrahedra();

  std::string path_;
  LoadedMesh result_;
  std::vector<const CellKind*> kinds_;  // by cell
  std::size_t next_ = 0;                // the cell whose points come next
  std::vector<std::uint32_t> cells_;    // by tetrahedron: the cell that it is a part of
};

}  // namespace slabstream
