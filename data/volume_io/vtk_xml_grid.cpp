// Unstructured and curvilinear grids in VTK's XML files (vtk_xml.h), and lists of such files (vtk_list.h). All pieces are one grid.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <optional>
#include <set>
#include <span>
#include <utility>

#include "common/text/parse_number.h"
#include "data/volume_io/mesh_builder.h"
#include "data/volume_io/mesh_formats.h"
#include "data/volume_io/raw_volume.h"
#include "data/volume_io/structured_cells.h"
#include "data/volume_io/vtk_extent.h"
#include "data/volume_io/vtk_list.h"
#include "data/volume_io/vtk_xml.h"

namespace slabstream {
namespace {

constexpr std::string_view kUnstructured = "UnstructuredGrid";
// What a path may be. Blocks may be the first four.
constexpr std::array<std::string_view, 7> kGridTypes = {kUnstructured,
                                                        "StructuredGrid",
                                                        "PUnstructuredGrid",
                                                        "PStructuredGrid",
                                                        "vtkMultiBlockDataSet",
                                                        "vtkPartitionedDataSet",
                                                        "vtkPartitionedDataSetCollection"};
constexpr std::size_t kTypesOfBlocks = 4;

struct GridFile {
  std::string path, type;
};

struct Piece {
  std::size_t number = 0;              // in its file
  std::int64_t points = 0, cells = 0;  // at least one each
  std::optional<GridPoints> grid;      // of a curvilinear grid
};

// A file, which may be a list, and all that it names.
class GridFiles {
 public:
  explicit GridFiles(std::string path) : path_(std::move(path)) {}

  Status Find() { return Add(path_, path_, kGridTypes, false); }
  const std::string& type() const { return type_; }                       // of the path itself
  const std::vector<GridFile>& grids() const { return grids_; }           // that are no lists
  const std::vector<std::string>& surfaces() const { return surfaces_; }  // names of blocks that are left out
  const std::vector<std::string>& paths() const { return paths_; }        // of all files

 private:
  Status Add(const std::string& path, const std::string& name, std::span<const std::string_view> types, bool block) {
    const Result<VtkList> list = ReadVtkList(path);
    if (!list.ok()) return list.status();
    if (paths_.empty()) type_ = list->type;
    paths_.push_back(path);
    std::error_code error;
    if (!known_.insert(std::filesystem::weakly_canonical(path, error)).second) return Status::InvalidArgument(path + ": is named twice");
    if (block && list->OfSurfaces()) {
      surfaces_.push_back(name);
      return Status::Ok();
    }
    if (std::ranges::find(types, list->type) == types.end()) {
      return Status::InvalidArgument(fmt::format("{}: a VTK file of type '{}', must be {}", path, list->type, fmt::join(types, " or ")));
    }
    if (list->entries.empty()) grids_.push_back({path, list->type});
    if (grids_.size() > kMostListedFiles) {
      return Status::InvalidArgument(fmt::format("{}: with it there are more than {} files", path, kMostListedFiles));
    }
    const std::array<std::string_view, 1> pieces = {std::string_view(list->type).substr(1)};
    for (const auto& [entry, entry_name] : list->entries) {
      const std::span<const std::string_view> wanted = list->OfBlocks() ? std::span(kGridTypes).first(kTypesOfBlocks) : std::span(pieces);
      if (Status status = Add(entry, entry_name, wanted, list->OfBlocks()); !status.ok()) return status;
    }
    return Status::Ok();
  }

  const std::string path_;
  std::string type_;
  std::vector<GridFile> grids_;
  std::vector<std::string> surfaces_;
  std::vector<std::string> paths_;
  std::set<std::filesystem::path> known_;
};

Result<std::int64_t> Count(const VtkXmlFile& file, const XmlTag& piece, const std::string& attribute, std::int64_t most) {
  const std::string text = piece.Attribute(attribute);
  const std::int64_t count = ParseNumber<std::int64_t>(text).value_or(-1);
  if (count >= 0 && count <= most) return count;
  return file.Wrong(fmt::format("{} is '{}', must be a whole number in [0, {}]", attribute, text, most));
}

// Programs that run in parallel write empty pieces.
Result<std::optional<Piece>> UnstructuredPiece(const VtkXmlFile& file, std::size_t number) {
  const XmlTag& tag = file.pieces()[number];
  const auto points = Count(file, tag, "NumberOfPoints", kMaxMeshPoints), cells = Count(file, tag, "NumberOfCells", kMaxTetrahedra);
  for (const auto* count : {&points, &cells}) {
    if (!count->ok()) return count->status();
  }
  return *points == 0 || *cells == 0 ? std::nullopt : std::optional(Piece{number, *points, *cells, {}});
}

class XmlGridReader {
 public:
  XmlGridReader(const std::string& path, const MeshOptions& options) : files_(path), path_(path), options_(options) {}

  Result<LoadedMesh> Read() {
    Result<LoadedMesh> loaded = ReadFiles();
    // What is wrong with a file that the path names.
    if (const Status status = loaded.status(); !status.ok() && !status.message().starts_with(path_ + ":")) {
      return Status(status.code(), path_ + ": " + status.message());
    }
    return loaded;
  }

 private:
  Result<LoadedMesh> ReadFiles() {
    if (Status status = files_.Find(); !status.ok()) return status;
    if (!files_.surfaces().empty()) notes_.push_back(SurfacesNote(files_.surfaces()));
    for (const GridFile& file : files_.grids()) {
      if (Status status = ReadFile(file); !status.ok()) return status;
      if (options_.headers_only && array_) break;
      std::error_code error;
      if (options_.read) options_.read(std::int64_t(std::filesystem::file_size(file.path, error)));
    }
    if (!array_) {
      const std::string why = "has no piece with points and cells in it";
      return Status::InvalidArgument(fmt::format("{}: {}", path_, notes_.empty() ? why : notes_.front()));
    }
    Result<LoadedMesh> loaded = options_.headers_only ? builder_.TakeHeaders() : builder_.Finish(path_);
    if (!loaded.ok()) return loaded;
    MeshFileInfo& info = loaded->info;
    info.format =
        files_.paths().size() == 1 ? "VTK " + files_.type() : fmt::format("VTK {}, {} files", files_.type(), files_.paths().size());
    info.notes.insert(info.notes.end(), notes_.begin(), notes_.end());
    info.other_files.assign(files_.paths().begin() + 1, files_.paths().end());
    return loaded;
  }

  Status ReadFile(const GridFile& from) {
    const Result<VtkXmlFile> file = VtkXmlFile::Open(from.path, from.type, {.time = options_.time});
    if (!file.ok()) return file.status();
    for (std::size_t number = 0; number < file->pieces().size(); ++number) {
      where_ = file->pieces().size() == 1 ? from.path : fmt::format("{}: piece {}", from.path, number);
      const Result<std::optional<Piece>> piece =
          from.type == kUnstructured ? UnstructuredPiece(*file, number) : StructuredPiece(*file, number);
      if (!piece.ok()) return piece.status();
      if (!*piece) continue;
      if (!array_) {
        if (Status status = ChooseArray(*file, from.path); !status.ok()) return status;
      }
      if (options_.headers_only) return Status::Ok();
      if (Status status = ReadPiece(*file, **piece); !status.ok()) return status;
    }
    return Status::Ok();
  }

  Result<std::optional<Piece>> StructuredPiece(const VtkXmlFile& file, std::size_t number) {
    const Result<PointExtent> extent = ExtentOf(file, file.pieces()[number], "Extent");
    if (!extent.ok()) return extent.status();
    if (extent->empty()) return std::optional<Piece>();
    const GridPoints grid = {extent->Points(0), extent->Points(1), extent->Points(2)};
    if (Status status = CheckPointCount(where_, grid); !status.ok()) return status;
    if (!HasVolume(grid)) {
      notes_.push_back(fmt::format("{}is flat, {}, and so has no volume", where_ == path_ ? "" : where_ + " ", ToText(grid)));
      return std::optional<Piece>();
    }
    const auto [x, y, z] = grid;
    return std::optional(Piece{number, x * y * z, (x - 1) * (y - 1) * (z - 1), grid});
  }

  Status ChooseArray(const VtkXmlFile& file, const std::string& path) {
    const OfferedArrays offered = file.Offered();
    const Result<std::size_t> chosen = builder_.SetArrays(path, offered.arrays, options_);
    if (chosen.ok()) array_ = file.arrays()[offered.numbers[*chosen]];
    return chosen.status();
  }

  Status ReadPiece(const VtkXmlFile& file, const Piece& piece) {
    MeshPiece read;
    if (Status status = ReadPlaces(file, piece, read.places); !status.ok()) return status;
    if (Status status = ReadValues(file, piece, read.values); !status.ok()) return status;
    for (const GhostMark& mark : kGhostMarks) {
      const bool of_points = mark.at == ValuesAt::kPoints;
      const std::string section = of_points ? "PointData" : "CellData", name(mark.name);
      if (!file.Find(piece.number, section, name).ok()) continue;
      const Result<WholeNumbers> numbers = Whole(file, piece, section, name, of_points ? piece.points : piece.cells);
      if (!numbers.ok()) return numbers.status();
      read.Mark(mark, *numbers);
    }
    if (Status status = builder_.BeginPiece(where_, std::move(read)); !status.ok()) return status;
    return piece.grid ? AddStructuredCells(*piece.grid, builder_) : ReadCells(file, piece);
  }

  // The numbers of an array.
  Result<WholeNumbers> Whole(const VtkXmlFile& file, const Piece& piece, const std::string& section, const std::string& name,
                             std::int64_t tuples) const {
    const Result<const VtkArray*> array = file.Find(piece.number, section, name);
    if (!array.ok()) return array.status();
    const Result<VtkArrayType> type = file.TypeOf(**array, 1);
    if (!type.ok()) return type.status();
    if (type->type == SampleType::kFloat32 || type->type == SampleType::kFloat64) {
      return file.Wrong(fmt::format("array {} of {} has no whole numbers", name, section));
    }
    return file.ReadNumbers<std::int64_t>(**array, type->type, tuples);
  }

  Status ReadPlaces(const VtkXmlFile& file, const Piece& piece, AlignedVector<double>& places) const {
    const Result<const VtkArray*> array = file.Find(piece.number, "Points", "");
    if (!array.ok()) return array.status();
    const Result<VtkArrayType> type = file.TypeOf(**array, 3);
    if (!type.ok()) return type.status();
    if (type->components != 3) return file.Wrong(fmt::format("its points have {} components, must have 3", type->components));
    auto read = file.ReadNumbers<double>(**array, type->type, 3 * piece.points);
    if (read.ok()) places = *std::move(read);
    return read.status();
  }

  // Of the array with the chosen one's name and type.
  Status ReadValues(const VtkXmlFile& file, const Piece& piece, AlignedVector<float>& values) const {
    const Result<const VtkArray*> array = file.FindLike(piece.number, *array_);
    if (!array.ok()) return array.status();
    const Result<VtkArrayType> type = file.TypeOf(**array, kMaxComponents);
    if (!type.ok()) return type.status();
    const std::int64_t tuples = array_->section == "PointData" ? piece.points : piece.cells;
    auto read = file.ReadNumbers<float>(**array, type->type, tuples * type->components);
    if (read.ok()) values = *std::move(read);
    return read.status();
  }

  Status ReadCells(const VtkXmlFile& file, const Piece& piece) {
    const auto cells = [&](const char* name, std::int64_t tuples) { return Whole(file, piece, "Cells", name, tuples); };
    const Result<WholeNumbers> kinds = cells("types", piece.cells), ends = cells("offsets", piece.cells);
    for (const auto* numbers : {&kinds, &ends}) {
      if (!numbers->ok()) return numbers->status();
    }
    const Result<std::int64_t> count = builder_.CheckCells(*kinds, *ends);
    if (!count.ok()) return count.status();
    const Result<WholeNumbers> corners = cells("connectivity", *count);
    return corners.ok() ? builder_.AddCells(*kinds, *corners) : corners.status();
  }

  GridFiles files_;
  const std::string path_;
  const MeshOptions options_;
  MeshBuilder builder_;
  std::optional<VtkArray> array_;  // the chosen one, as the first file with cells has it
  std::string where_;              // the file, or the piece in it
  std::vector<std::string> notes_;
};

}  // namespace

Result<std::vector<std::string>> FilesOfVtkXmlGrid(const std::string& path) {
  GridFiles files(path);
  const Status found = files.Find();
  return found.ok() ? Result(files.paths()) : found;
}

Result<LoadedMesh> ReadVtkXmlGrid(const std::string& path, const MeshOptions& options) { return XmlGridReader(path, options).Read(); }

}  // namespace slabstream
