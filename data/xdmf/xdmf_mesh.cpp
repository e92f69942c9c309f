#include "data/xdmf/xdmf_mesh.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <limits>
#include <optional>
#include <set>
#include <utility>

#include "common/base/printable.h"
#include "data/volume_io/mesh_builder.h"
#include "data/volume_io/structured_cells.h"
#include "data/xdmf/xdmf_attributes.h"

namespace slabstream {
namespace {

constexpr std::uint64_t kMostNumbers = std::uint64_t{1} << 36;

// How XDMF calls kinds of cells, and their number where kinds are mixed. Source: XDMF's model, "Topology".
struct CellName {
  std::string_view name;
  std::int64_t number;
  int vtk_type;  // of those that have no volume, 0
  int points;    // 0: a number of points follows
};
constexpr CellName kCells[] = {{"tetrahedron", 6, 10, 4}, {"pyramid", 7, 14, 5},   {"wedge", 8, 13, 6},
                               {"hexahedron", 9, 12, 8},  {"polyvertex", 1, 0, 0}, {"polyline", 2, 0, 0},
                               {"polygon", 3, 0, 0},      {"triangle", 4, 0, 3},   {"quadrilateral", 5, 0, 4}};
constexpr std::string_view kMixed = "mixed", kCurvilinear = "3dsmesh";

std::string TypeOf(const XdmfElement& topology) { return topology.Word({"TopologyType", "Type"}); }

// The cells of a piece, as MeshBuilder takes them. Those without a volume are left out.
struct Cells {
  WholeNumbers kinds, ends, corners;
  std::vector<bool> flat = {};  // by cell of the file, whether it has no volume; empty: all have one
};

class MeshPieceReader {
 public:
  MeshPieceReader(XdmfDocument& document, const XdmfElement& grid, XdmfArrays& arrays)
      : document_(document), grid_(grid), arrays_(arrays) {}

  // Reads what says how many points and cells there are.
  Status ReadSizes() {
    Result<const XdmfElement*> element = document_.Needed(grid_, "Topology");
    if (!element.ok()) return element.status();
    topology_ = *element;
    element = document_.Needed(grid_, "Geometry");
    if (!element.ok()) return element.status();
    geometry_ = *element;
    const std::string kind = geometry_->Word({"GeometryType", "Type"});
    if (kind != "xyz" && kind != "x_y_z" && !kind.empty()) {
      return document_.Wrong(*geometry_,
                             fmt::format("GeometryType '{}' is not supported for cells; supported: XYZ and X_Y_Z", Printable(kind)));
    }
    const std::vector<const XdmfElement*> items = XdmfDocument::Children(*geometry_, "DataItem");
    const std::size_t wanted = kind == "x_y_z" ? 3 : 1;
    if (items.size() != wanted) return document_.Wrong(*geometry_, fmt::format("has {} items, must have {}", items.size(), wanted));
    for (const XdmfElement* each : items) {
      Result<XdmfItem> item = ParseXdmfItem(document_, *each);
      if (!item.ok()) return item.status();
      places_.push_back(*std::move(item));
    }
    const std::uint64_t numbers = places_.front().elements();
    if (wanted == 1 && numbers % 3 != 0) return document_.Wrong(*geometry_, fmt::format("has {} numbers, must have 3 a point", numbers));
    points_ = wanted == 1 ? numbers / 3 : numbers;
    for (const XdmfItem& item : places_) {
      if (item.elements() != numbers) return document_.Wrong(*geometry_, "has other numbers of x, y and z");
    }
    return IsCurvilinear() ? ReadGridPoints() : ReadCellCount();
  }

  // Of numbers that are not in the XML.
  Status AddFiles(std::set<std::string>& files) {
    const auto add = [&](const XdmfItem& item) {
      if (!item.file.empty()) files.insert(item.file);
    };
    add(corners_);
    std::ranges::for_each(places_, add);
    const Result<std::vector<XdmfAttribute>> attributes = Attributes();
    if (!attributes.ok()) return attributes.status();
    for (const XdmfAttribute& attribute : *attributes) {
      if (const Result<XdmfItem> item = ItemOf(document_, *attribute.element); item.ok()) add(*item);
    }
    return Status::Ok();
  }

  Result<std::vector<XdmfAttribute>> Attributes() {
    return AttributesOf(document_, grid_, [this](ValuesAt at) { return at == ValuesAt::kPoints ? points_ : cells_; });
  }

  // Adds the piece, of which it reads the attribute of this name.
  Status Read(const GridArray& array, const std::string& first, MeshBuilder& builder) {
    const std::string where = document_.Named(grid_);
    MeshPiece piece;
    if (Status status = ReadPlaces(piece.places); !status.ok()) return status;
    const Result<const XdmfElement*> attribute = FindAttribute(document_, grid_, array.name, array.at, first);
    if (!attribute.ok()) return attribute.status();
    Result<AlignedVector<float>> values = ReadAttribute<float>(**attribute, array.at, array.components);
    if (!values.ok()) return values.status();
    piece.values = *std::move(values);
    for (const GhostMark& mark : kGhostMarks) {
      const Result<const XdmfElement*> marked = FindAttribute(document_, grid_, std::string(mark.name), mark.at, first);
      if (!marked.ok()) continue;
      const Result<WholeNumbers> numbers = ReadAttribute<std::int64_t>(**marked, mark.at, 1);
      if (!numbers.ok()) return numbers.status();
      piece.Mark(mark, *numbers);
    }
    if (IsCurvilinear()) {
      const Status status = builder.BeginPiece(where, std::move(piece));
      return status.ok() ? AddStructuredCells(grid_points_, builder) : status;
    }
    Result<Cells> cells = ReadCells();
    if (!cells.ok()) return cells.status();
    LeaveOut(cells->flat, array, piece);
    if (Status status = builder.BeginPiece(where, std::move(piece)); !status.ok()) return status;
    const Result<std::int64_t> corners = builder.CheckCells(cells->kinds, cells->ends);
    return corners.ok() ? builder.AddCells(cells->kinds, cells->corners) : corners.status();
  }

 private:
  bool IsCurvilinear() const { return TypeOf(*topology_) == kCurvilinear; }
  std::string Dimensions() const { return topology_->Attribute({"Dimensions", "NumberOfElements"}); }

  // Dimensions are in the order z, y, x.
  Status ReadGridPoints() {
    const std::optional<std::vector<std::uint64_t>> sizes = CountsInText(Dimensions(), 3);
    constexpr std::uint64_t kMost = std::numeric_limits<std::int32_t>::max();
    if (!sizes || sizes->size() != 3 || std::ranges::any_of(*sizes, [](std::uint64_t n) { return n < 2 || n > kMost; })) {
      return document_.Wrong(*topology_, fmt::format("Dimensions is '{}', must be 3 whole numbers above 1", Printable(Dimensions())));
    }
    for (std::size_t i = 0; i < 3; ++i) grid_points_[i] = std::int64_t((*sizes)[2 - i]);
    if (Status status = CheckPointCount(document_.Named(grid_), grid_points_); !status.ok()) return status;
    const auto [x, y, z] = grid_points_;
    if (std::uint64_t(x * y * z) != points_) {
      return document_.Wrong(*geometry_, fmt::format("has {} points, but Dimensions says {}", points_, ToText(grid_points_)));
    }
    cells_ = std::uint64_t((x - 1) * (y - 1) * (z - 1));
    return Status::Ok();
  }

  Status ReadCellCount() {
    if (!topology_->Attribute({"Order", "BaseOffset"}).empty()) {
      return document_.Wrong(*topology_, "has an Order or a BaseOffset, which is not supported");
    }
    const std::vector<const XdmfElement*> items = XdmfDocument::Children(*topology_, "DataItem");
    if (items.size() != 1) return document_.Wrong(*topology_, fmt::format("has {} items, must have 1", items.size()));
    Result<XdmfItem> item = ParseXdmfItem(document_, *items.front());
    if (!item.ok()) return item.status();
    corners_ = *std::move(item);
    if (const int of_cell = PointsOfCell(); of_cell > 0) {
      if (corners_.elements() % std::uint64_t(of_cell) != 0) {
        return document_.Wrong(*topology_, fmt::format("has {} numbers, must have {} a cell", corners_.elements(), of_cell));
      }
      cells_ = corners_.elements() / std::uint64_t(of_cell);
    } else if (const auto counts = CountsInText(Dimensions(), kMaxArrayAxes); counts) {
      cells_ = 1;
      for (const std::uint64_t count : *counts) cells_ *= std::max<std::uint64_t>(1, std::min(count, kMostNumbers / cells_));
    }
    return Status::Ok();
  }
  // 0: kinds are mixed.
  int PointsOfCell() const {
    const auto* const cell = std::ranges::find(kCells, TypeOf(*topology_), &CellName::name);
    return cell == std::end(kCells) ? 0 : cell->points;
  }

  Status ReadPlaces(AlignedVector<double>& places) {
    for (std::size_t i = 0; i < places_.size(); ++i) {
      Result<AlignedVector<double>> numbers = Numbers<double>(places_[i], std::uint64_t{3} * kMaxMeshPoints);
      if (!numbers.ok()) return numbers.status();
      if (places_.size() == 1) {
        places = *std::move(numbers);
        continue;
      }
      places.resize(3 * points_);
      for (std::size_t point = 0; point < numbers->size(); ++point) places[3 * point + i] = (*numbers)[point];
    }
    return Status::Ok();
  }

  template <class T>
  Result<AlignedVector<T>> ReadAttribute(const XdmfElement& attribute, ValuesAt at, int components) {
    const Result<XdmfItem> item = ItemOf(document_, attribute);
    if (!item.ok()) return item.status();
    const std::uint64_t count = at == ValuesAt::kPoints ? points_ : cells_;
    if (item->elements() != count * std::uint64_t(components)) {
      return document_.Wrong(
          attribute, fmt::format("has {} numbers, must have {} for each of {} {}", item->elements(), components, count, NameOf(at)));
    }
    return Numbers<T>(*item, kMostNumbers);
  }

  template <class T>
  Result<AlignedVector<T>> Numbers(const XdmfItem& item, std::uint64_t most) {
    if (Status status = document_.Spend(item.text.size() / 8); item.format == XdmfItem::Format::kText && !status.ok()) return status;
    return arrays_.ReadNumbers<T>(item, most);
  }

  Result<Cells> ReadCells() {
    Result<WholeNumbers> numbers = Numbers<std::int64_t>(corners_, kMostNumbers);
    if (!numbers.ok()) return numbers.status();
    const auto* const named = std::ranges::find(kCells, TypeOf(*topology_), &CellName::name);
    if (named == std::end(kCells)) return ReadMixed(*numbers);
    Cells cells{.kinds = WholeNumbers(cells_, named->vtk_type), .ends = WholeNumbers(cells_), .corners = *std::move(numbers)};
    for (std::uint64_t i = 0; i < cells_; ++i) cells.ends[i] = std::int64_t(i + 1) * named->points;
    return cells;
  }

  // Each cell begins with the number of its kind.
  Result<Cells> ReadMixed(const WholeNumbers& numbers) {
    Cells cells;
    for (std::size_t at = 0; at < numbers.size();) {
      const std::size_t cell = cells.flat.size();
      const auto* const kind = std::ranges::find(kCells, numbers[at], &CellName::number);
      if (kind == std::end(kCells)) {
        return document_.Wrong(*topology_,
                               fmt::format("cell {} is of kind {}, which is not supported; supported: 1 to 9", cell, numbers[at]));
      }
      ++at;
      std::int64_t points = kind->points;
      if (points == 0 && at < numbers.size()) points = numbers[at++];
      if (points < 1 || std::uint64_t(points) > numbers.size() - at) {
        return Status::DataLoss(fmt::format("{}: cell {} has more points than the item has numbers", document_.Named(*topology_), cell));
      }
      cells.flat.push_back(kind->vtk_type == 0);
      if (kind->vtk_type != 0) {
        cells.kinds.push_back(kind->vtk_type);
        cells.corners.insert(cells.corners.end(), numbers.begin() + std::ptrdiff_t(at), numbers.begin() + std::ptrdiff_t(at) + points);
        cells.ends.push_back(std::int64_t(cells.corners.size()));
      }
      at += std::size_t(points);
    }
    if (cells.flat.size() != cells_) {
      return document_.Wrong(*topology_, fmt::format("has {} cells, but Dimensions says {}", cells.flat.size(), cells_));
    }
    return cells;
  }

  // Takes the values and marks of cells without a volume out of the piece.
  static void LeaveOut(const std::vector<bool>& flat, const GridArray& array, MeshPiece& piece) {
    if (std::ranges::find(flat, true) == flat.end()) return;
    const auto components = array.at == ValuesAt::kCells ? std::size_t(array.components) : 0;
    std::size_t kept = 0;
    for (std::size_t cell = 0; cell < flat.size(); ++cell) {
      if (flat[cell]) continue;
      for (std::size_t c = 0; c < components; ++c) piece.values[kept * components + c] = piece.values[cell * components + c];
      if (!piece.cells_out.empty()) piece.cells_out[kept] = piece.cells_out[cell];
      ++kept;
    }
    if (components > 0) piece.values.resize(kept * components);
    if (!piece.cells_out.empty()) piece.cells_out.resize(kept);
  }

  XdmfDocument& document_;
  const XdmfElement& grid_;
  XdmfArrays& arrays_;
  const XdmfElement* topology_ = nullptr;
  const XdmfElement* geometry_ = nullptr;
  std::vector<XdmfItem> places_;
  XdmfItem corners_;
  std::uint64_t points_ = 0, cells_ = 0;
  GridPoints grid_points_{};
};

}  // namespace

Result<bool> IsXdmfMesh(XdmfDocument& document, const XdmfElement& grid) {
  const Result<const XdmfElement*> topology = document.Needed(grid, "Topology");
  if (!topology.ok()) return topology.status();
  const std::string type = TypeOf(**topology);
  return type == kMixed || type == kCurvilinear ||
         std::ranges::any_of(kCells, [&](const CellName& cell) { return cell.vtk_type != 0 && cell.name == type; });
}

Result<std::vector<std::string>> FilesOfXdmfMesh(XdmfDocument& document, const std::vector<const XdmfElement*>& pieces,
                                                 XdmfArrays& arrays) {
  std::set<std::string> files;
  for (const XdmfElement* piece : pieces) {
    MeshPieceReader reader(document, *piece, arrays);
    if (Status status = reader.ReadSizes(); !status.ok()) return status;
    if (Status status = reader.AddFiles(files); !status.ok()) return status;
  }
  std::vector<std::string> all = {document.path()};
  all.insert(all.end(), files.begin(), files.end());
  return all;
}

Result<LoadedMesh> ReadXdmfMesh(XdmfDocument& document, const std::vector<const XdmfElement*>& pieces, const MeshOptions& options,
                                XdmfArrays& arrays) {
  MeshBuilder builder;
  std::optional<GridArray> array;
  std::set<std::string> files;
  for (const XdmfElement* piece : pieces) {
    const Result<bool> is_mesh = IsXdmfMesh(document, *piece);
    if (!is_mesh.ok()) return is_mesh.status();
    if (!*is_mesh) return document.Wrong(*piece, "has straight axes, but another piece has cells: pieces must be of one kind");
    MeshPieceReader reader(document, *piece, arrays);
    if (Status status = reader.ReadSizes(); !status.ok()) return status;
    if (!array) {
      const Result<std::vector<XdmfAttribute>> attributes = reader.Attributes();
      if (!attributes.ok()) return attributes.status();
      std::vector<GridArray> offered;
      for (const XdmfAttribute& attribute : *attributes) offered.push_back(attribute.array);
      const Result<std::size_t> chosen = builder.SetArrays(document.path(), offered, options);
      if (!chosen.ok()) return chosen.status();
      array = offered[*chosen];
    }
    if (options.headers_only) return builder.TakeHeaders();
    if (Status status = reader.AddFiles(files); !status.ok()) return status;
    if (Status status = reader.Read(*array, document.Named(*pieces.front()), builder); !status.ok()) return status;
  }
  Result<LoadedMesh> loaded = builder.Finish(document.path());
  if (!loaded.ok()) return loaded;
  loaded->info.format = "XDMF";
  loaded->info.other_files.assign(files.begin(), files.end());
  files.insert(document.path());
  std::error_code error;
  for (const std::string& file : files) {
    if (options.read) options.read(std::int64_t(std::filesystem::file_size(file, error)));
  }
  return loaded;
}

}  // namespace slabstream
