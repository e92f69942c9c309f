// Makes a mesh of the contents of an unstructured grid's files of any format, and says what is wrong with them. First SetArrays; then for
// each piece of the grid BeginPiece, and its cells; last Finish. After an error there are no more calls. Errors name the path of the file.
//
// Pieces that meet have their common points twice. Where these have one place and one value, they become one point of the mesh, so that
// cells of two pieces split their common face alike, and light shows no border. Cells that VTK marks as ghosts or hidden are left out.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "common/base/status.h"
#include "common/memory/aligned_buffer.h"
#include "data/volume_io/mesh_points.h"
#include "data/volume_io/mesh_reader.h"

namespace slabstream {

using WholeNumbers = AlignedVector<std::int64_t>;

// Arrays by which VTK marks what is not drawn, and the bits that count. Of cells (vtkDataSetAttributes): copies of another piece's (1),
// those that finer ones replace (8), hidden ones (32), and in older files those with a level. Of points: hidden ones (2), which hide their
// cells.
struct GhostMark {
  std::string_view name;
  ValuesAt at = ValuesAt::kCells;
  std::int64_t bits = 0;
};
inline constexpr std::array<GhostMark, 3> kGhostMarks = {
    {{"vtkGhostType", ValuesAt::kCells, 1 | 8 | 32}, {"vtkGhostLevels", ValuesAt::kCells, ~0}, {"vtkGhostType", ValuesAt::kPoints, 2}}};

struct MeshPiece {
  AlignedVector<double> places;  // x, y and z of each point, in the world
  AlignedVector<float> values;   // of the chosen array, all components of each point or cell
  // What is left out, by point and by cell; empty: nothing is.
  std::vector<bool> points_out = {}, cells_out = {};

  // Adds what one of kGhostMarks marks: a number for each point or cell.
  void Mark(const GhostMark& mark, const WholeNumbers& numbers);
};

class MeshBuilder {
 public:
  // What the first file with cells has. The number of the array that is read: errors of ChooseArray (grid_arrays.h) and CheckChannel
  // (raw_volume.h).
  Result<std::size_t> SetArrays(const std::string& path, std::vector<GridArray> arrays, const MeshOptions& options);
  // `where`: the file, or the piece in it. InvalidArgument: a place that is not finite. ResourceExhausted: too many points.
  Status BeginPiece(const std::string& where, MeshPiece piece);
  // Checks the piece's cells, and takes memory for their tetrahedra: their kinds by VTK's numbers, and for each where its points end among
  // those of all, which follow each other. How many points there are, each counted in each of its cells. InvalidArgument: a kind that is
  // not supported. DataLoss: ends that do not fit the kinds. ResourceExhausted: too many.
  Result<std::int64_t> CheckCells(const WholeNumbers& kinds, const WholeNumbers& ends);
  // Takes memory for the tetrahedra of so many more cells. ResourceExhausted: too many.
  Status Reserve(const CellKind& kind, std::int64_t cells);
  // The piece's next cells, which were checked or are known to be sound, and the numbers of their points in the piece, as many as the kinds
  // have. DataLoss: points that there are not.
  Status AddCells(const WholeNumbers& kinds, const WholeNumbers& corners);
  // What is known before any piece was read.
  LoadedMesh TakeHeaders() { return std::move(result_); }
  // `path`: of the whole grid, for errors. InvalidArgument: no cell has a volume; an extent that is too small or too large.
  // ResourceExhausted. Errors of MeshSpill.
  Result<LoadedMesh> Finish(const std::string& path);

 private:
  Status Damaged(const std::string& why) const { return Status::DataLoss(where_ + ": " + why); }
  float ValueOf(std::size_t element) const;  // of the piece
  // Once a piece has ended: moves all to the spool if it is too much for the memory.
  Status EndPiece();

  LoadedMesh result_;
  const MeshSpill* spill_ = nullptr;  // null: there is none
  MeshPoints points_;
  std::vector<std::int64_t> counts_ = std::vector<std::int64_t>(CellKinds().size());  // of cells, by kind
  std::int64_t left_out_ = 0;                                                         // cells
  std::int64_t reserved_ = 0;                                                         // tetrahedra, those in the spool too
  std::size_t counted_ = 0;                                                           // points within result_.bounds
  // Of the piece.
  std::string where_;
  MeshPiece piece_;
  std::vector<PointNumber> numbers_;  // of its points in the mesh
  std::size_t next_ = 0;              // the cell that comes next
};

}  // namespace slabstream
