// Unstructured grids in VTK's XML files (.vtu; vtk_xml.h). Pieces follow each other.
#include <fmt/format.h>

#include <utility>

#include "common/text/parse_number.h"
#include "data/volume_io/mesh_builder.h"
#include "data/volume_io/mesh_formats.h"
#include "data/volume_io/raw_volume.h"
#include "data/volume_io/vtk_xml.h"

namespace slabstream {
namespace {

using WholeNumbers = AlignedVector<std::int64_t>;

struct Piece {
  std::size_t number = 0;              // in the file
  std::int64_t points = 0, cells = 0;  // at least one each
  std::int64_t corners = 0;            // points of its cells, each counted in each cell
};

template <class T>
void Append(AlignedVector<T>& all, const AlignedVector<T>& more) {
  all.insert(all.end(), more.begin(), more.end());
}

class XmlGridReader {
 public:
  XmlGridReader(const std::string& path, VtkXmlFile file) : file_(std::move(file)), builder_(path, "VTK unstructured grid") {}

  Result<LoadedMesh> Read(const MeshOptions& options) {
    if (Status status = FindPieces(); !status.ok()) return status;
    const OfferedArrays offered = file_.Offered();
    const Result<std::size_t> chosen = builder_.SetArrays(offered.arrays, options);
    if (!chosen.ok()) return chosen.status();
    if (options.headers_only) return builder_.Take();
    if (Status status = ReadPoints(); !status.ok()) return status;
    if (Status status = ReadCells(); !status.ok()) return status;
    if (Status status = ReadValues(file_.arrays()[offered.numbers[*chosen]]); !status.ok()) return status;
    return builder_.Take();
  }

 private:
  Result<std::int64_t> Count(const XmlTag& piece, const std::string& attribute, std::int64_t most) const {
    const std::string text = piece.Attribute(attribute);
    const std::int64_t count = ParseNumber<std::int64_t>(text).value_or(-1);
    if (count >= 0 && count <= most) return count;
    return file_.Wrong(fmt::format("{} is '{}', must be a whole number in [0, {}]", attribute, text, most));
  }

  // Programs that run in parallel write empty pieces.
  Status FindPieces() {
    std::int64_t points = 0, cells = 0;
    for (std::size_t i = 0; i < file_.pieces().size(); ++i) {
      const XmlTag& piece = file_.pieces()[i];
      const auto of_piece = Count(piece, "NumberOfPoints", kMaxMeshPoints), in_piece = Count(piece, "NumberOfCells", kMaxTetrahedra);
      for (const auto* count : {&of_piece, &in_piece}) {
        if (!count->ok()) return count->status();
      }
      if (*of_piece > 0 && *in_piece > 0) pieces_.push_back({i, *of_piece, *in_piece});
      points += *of_piece;
      cells += *in_piece;
    }
    if (pieces_.empty()) return file_.Wrong("has no piece with points and cells in it");
    if (points <= kMaxMeshPoints && cells <= kMaxTetrahedra) return Status::Ok();
    return file_.Wrong(
        fmt::format("its pieces have {} points and {} cells, must have at most {} and {}", points, cells, kMaxMeshPoints, kMaxTetrahedra));
  }

  // The numbers of an array of a piece's cells.
  Result<WholeNumbers> OfCells(const Piece& piece, const char* name, std::int64_t tuples) const {
    const Result<const VtkArray*> array = file_.Find(piece.number, "Cells", name);
    if (!array.ok()) return array.status();
    const Result<VtkArrayType> type = file_.TypeOf(**array, 1);
    if (!type.ok()) return type.status();
    if (type->type == SampleType::kFloat32 || type->type == SampleType::kFloat64) {
      return file_.Wrong(fmt::format("array {} of Cells has no whole numbers", name));
    }
    return file_.ReadNumbers<std::int64_t>(**array, type->type, tuples);
  }

  Status ReadPoints() {
    AlignedVector<double> places;
    for (const Piece& piece : pieces_) {
      const Result<const VtkArray*> array = file_.Find(piece.number, "Points", "");
      if (!array.ok()) return array.status();
      const Result<VtkArrayType> type = file_.TypeOf(**array, 3);
      if (!type.ok()) return type.status();
      if (type->components != 3) return file_.Wrong(fmt::format("its points have {} components, must have 3", type->components));
      const auto more = file_.ReadNumbers<double>(**array, type->type, 3 * piece.points);
      if (!more.ok()) return more.status();
      Append(places, *more);
    }
    return builder_.SetPoints(places);
  }

  Status ReadCells() {
    WholeNumbers kinds, ends;
    std::int64_t corners = 0;
    for (Piece& piece : pieces_) {
      const auto more_kinds = OfCells(piece, "types", piece.cells);
      auto more_ends = OfCells(piece, "offsets", piece.cells);
      if (!more_kinds.ok()) return more_kinds.status();
      if (!more_ends.ok()) return more_ends.status();
      piece.corners = more_ends->back();
      // What is wrong stays wrong: the builder checks each of them.
      for (std::int64_t& end : *more_ends) end = std::int64_t(std::uint64_t(end) + std::uint64_t(corners));
      corners = more_ends->back();
      Append(kinds, *more_kinds);
      Append(ends, *more_ends);
    }
    if (Status status = builder_.SetCells(kinds, ends); !status.ok()) return status;
    for (std::int64_t points = 0; const Piece& piece : pieces_) {
      const Result<WholeNumbers> more = OfCells(piece, "connectivity", piece.corners);
      if (!more.ok()) return more.status();
      if (Status status = builder_.AddCorners(*more, points, piece.points); !status.ok()) return status;
      points += piece.points;
    }
    return Status::Ok();
  }

  // Of the array with this name and type in each piece.
  Status ReadValues(const VtkArray& array) {
    AlignedVector<float> values;
    const VtkArrayType type = *file_.TypeOf(array, kMaxComponents);
    for (const Piece& piece : pieces_) {
      const Result<const VtkArray*> of_piece = file_.FindLike(piece.number, array);
      if (!of_piece.ok()) return of_piece.status();
      const std::int64_t tuples = array.section == "PointData" ? piece.points : piece.cells;
      const auto more = file_.ReadNumbers<float>(**of_piece, type.type, tuples * type.components);
      if (!more.ok()) return more.status();
      Append(values, *more);
    }
    return builder_.SetValues(std::move(values));
  }

  const VtkXmlFile file_;
  std::vector<Piece> pieces_;  // that hold cells
  MeshBuilder builder_;
};

}  // namespace

Result<LoadedMesh> ReadVtkXmlGrid(const std::string& path, const MeshOptions& options) {
  Result<VtkXmlFile> file = VtkXmlFile::Open(path, "UnstructuredGrid", {.time = options.time});
  if (!file.ok()) return file.status();
  return XmlGridReader(path, *std::move(file)).Read(options);
}

}  // namespace slabstream
