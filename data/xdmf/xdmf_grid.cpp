#include "data/xdmf/xdmf_grid.h"

#include <fmt/format.h>

#include <algorithm>

#include "common/base/printable.h"
#include "data/volume_io/structured_grid.h"
#include "data/xdmf/xdmf_attributes.h"

namespace slabstream {
namespace {

class GridReader {
 public:
  GridReader(XdmfDocument& document, const XdmfElement& element, XdmfArrays& arrays)
      : document_(document), element_(element), arrays_(arrays), grid_{.named = document.Named(element)} {}

  Result<XdmfGrid> Read(const ReadOptions& options, const XdmfGrid* like) {
    const Result<PointGrid> points = ReadPoints();
    if (!points.ok()) return points.status();
    const Result<const XdmfElement*> attribute = like == nullptr ? Choose(*points, options) : FindLike(*like);
    if (!attribute.ok()) return attribute.status();
    if (Status status = SetGrid(grid_.header, grid_.named, *points, grid_.at); !status.ok()) return status;
    Result<XdmfItem> item = ItemOf(document_, **attribute);
    if (!item.ok()) return item.status();
    grid_.header.components = ComponentsOf(*item, std::uint64_t(CountIn(grid_.header.size)));
    grid_.header.type = item->type.value_or(SampleType::kFloat32);
    TakeFile(*item);
    grid_.item = *std::move(item);
    return std::move(grid_);
  }

 private:
  void TakeFile(const XdmfItem& item) {
    if (!item.file.empty() && std::ranges::find(grid_.files, item.file) == grid_.files.end()) grid_.files.push_back(item.file);
  }

  // The arrays of the geometry, at most `most` numbers each.
  Result<std::vector<std::vector<double>>> ReadCoordinates(const XdmfElement& geometry, std::size_t arrays, std::uint64_t most) {
    const std::vector<const XdmfElement*> items = XdmfDocument::Children(geometry, "DataItem");
    if (items.size() != arrays) return document_.Wrong(geometry, fmt::format("has {} items, must have {}", items.size(), arrays));
    std::vector<std::vector<double>> all;
    for (const XdmfElement* each : items) {
      const Result<XdmfItem> item = ParseXdmfItem(document_, *each);
      if (!item.ok()) return item.status();
      if (Status status = document_.Spend(item->elements() + item->text.size() / 8); !status.ok()) return status;
      const Result<AlignedVector<double>> numbers = arrays_.ReadNumbers<double>(*item, most);
      if (!numbers.ok()) return numbers.status();
      TakeFile(*item);
      all.emplace_back(numbers->begin(), numbers->end());
    }
    return all;
  }

  // Their dimensions, coordinates, origin and spacing are in the order z, y, x; arrays of coordinates in that of x, y, z.
  Result<PointGrid> ReadPoints() {
    const Result<const XdmfElement*> topology = document_.Needed(element_, "Topology");
    if (!topology.ok()) return topology.status();
    const std::string type = (*topology)->Word({"TopologyType", "Type"});
    const bool even = type == "3dcorectmesh";
    if (!even && type != "3drectmesh") {
      return document_.Wrong(**topology,
                             fmt::format("TopologyType '{}' is not supported; supported: 3DCoRectMesh, 3DRectMesh, 3DSMesh, Mixed, "
                                         "Tetrahedron, Hexahedron, Wedge and Pyramid",
                                         Printable(type)));
    }
    const std::string dimensions = (*topology)->Attribute({"Dimensions", "NumberOfElements"});
    const std::optional<std::vector<std::uint64_t>> sizes = CountsInText(dimensions, 3);
    if (!sizes || sizes->size() != 3 || std::ranges::count(*sizes, 0) > 0) {
      return document_.Wrong(**topology, fmt::format("Dimensions is '{}', must be 3 whole numbers above 0", Printable(dimensions)));
    }
    const Result<const XdmfElement*> geometry = document_.Needed(element_, "Geometry");
    if (!geometry.ok()) return geometry.status();
    const std::string kind = (*geometry)->Word({"GeometryType", "Type"}), wanted = even ? "origin_dxdydz" : "vxvyvz";
    if (kind != wanted) {
      return document_.Wrong(**geometry, fmt::format("GeometryType is '{}', must be {} for {}", Printable(kind), wanted, type));
    }
    const auto coordinates = ReadCoordinates(**geometry, even ? 2 : 3, even ? 3 : kMaxVolumeSide);
    if (!coordinates.ok()) return coordinates.status();
    if (even) {
      const std::vector<double>&origin = (*coordinates)[0], &spacing = (*coordinates)[1];
      if (origin.size() != 3 || spacing.size() != 3) {
        return document_.Wrong(
            **geometry, fmt::format("has {} numbers of the origin and {} of the spacing, must have 3", origin.size(), spacing.size()));
      }
      return PointGrid{.points = {double((*sizes)[2]), double((*sizes)[1]), double((*sizes)[0])},
                       .steps = StepsOf({spacing[2], spacing[1], spacing[0]}),
                       .origin = {origin[2], origin[1], origin[0]},
                       .matrix = "DXDYDZ"};
    }
    // The library of XDMF 3 writes the dimensions of such a mesh in the order x, y, z.
    std::vector<std::uint64_t> counts;
    for (const std::vector<double>& axis : *coordinates) counts.push_back(axis.size());
    if (!std::ranges::equal(counts, *sizes) && !std::equal(counts.rbegin(), counts.rend(), sizes->begin())) {
      return document_.Wrong(**geometry, fmt::format("has {} coordinates along x, y and z, but Dimensions is '{}'", fmt::join(counts, ", "),
                                                     Printable(dimensions)));
    }
    return GridOfCoordinates({(*coordinates)[0], (*coordinates)[1], (*coordinates)[2]});
  }

  Result<const XdmfElement*> Choose(const PointGrid& points, const ReadOptions& options) {
    const auto count = [&](ValuesAt at) {
      return SetGrid(grid_.header, grid_.named, points, at).ok() ? std::uint64_t(CountIn(grid_.header.size)) : 0;
    };
    const Result<std::vector<XdmfAttribute>> attributes = AttributesOf(document_, element_, count);
    if (!attributes.ok()) return attributes.status();
    std::vector<GridArray> arrays;
    for (const XdmfAttribute& attribute : *attributes) arrays.push_back(attribute.array);
    const Result<std::size_t> chosen = ChooseArray(grid_.named, arrays, options.array);
    if (!chosen.ok()) return chosen.status();
    grid_.array = arrays[*chosen].name;
    grid_.at = arrays[*chosen].at;
    grid_.header.notes = NotesOf(arrays, *chosen);
    return (*attributes)[*chosen].element;
  }

  Result<const XdmfElement*> FindLike(const XdmfGrid& like) {
    grid_.array = like.array;
    grid_.at = like.at;
    return FindAttribute(document_, element_, like.array, like.at, like.named);
  }

  XdmfDocument& document_;
  const XdmfElement& element_;
  XdmfArrays& arrays_;
  XdmfGrid grid_;
};

}  // namespace

Result<XdmfGrid> ReadXdmfGrid(XdmfDocument& document, const XdmfElement& element, const ReadOptions& options, XdmfArrays& arrays,
                              const XdmfGrid* like) {
  return GridReader(document, element, arrays).Read(options, like);
}

}  // namespace slabstream
