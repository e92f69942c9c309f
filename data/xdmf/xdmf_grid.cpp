#include "data/xdmf/xdmf_grid.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "common/base/printable.h"
#include "data/volume_io/structured_grid.h"

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
    Result<XdmfItem> item = ItemOf(**attribute);
    if (!item.ok()) return item.status();
    grid_.header.components = ComponentsOf(*item);
    grid_.header.type = item->type.value_or(SampleType::kFloat32);
    TakeFile(*item);
    grid_.item = *std::move(item);
    return std::move(grid_);
  }

 private:
  Status Wrong(const std::string& why) const { return Status::InvalidArgument(grid_.named + ": " + why); }

  void TakeFile(const XdmfItem& item) {
    if (!item.file.empty() && std::ranges::find(grid_.files, item.file) == grid_.files.end()) grid_.files.push_back(item.file);
  }

  Result<const XdmfElement*> Needed(std::string_view name) {
    Result<const XdmfElement*> child = document_.Child(element_, name);
    return child.ok() && *child == nullptr ? Wrong(fmt::format("has no {}", name)) : child;
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
      Result<std::vector<double>> numbers = arrays_.ReadNumbers(*item, most);
      if (!numbers.ok()) return numbers.status();
      TakeFile(*item);
      all.push_back(*std::move(numbers));
    }
    return all;
  }

  // Their dimensions, coordinates, origin and spacing are in the order z, y, x; arrays of coordinates in that of x, y, z.
  Result<PointGrid> ReadPoints() {
    const Result<const XdmfElement*> topology = Needed("Topology");
    if (!topology.ok()) return topology.status();
    const std::string type = (*topology)->Word({"TopologyType", "Type"});
    const bool even = type == "3dcorectmesh";
    if (!even && type != "3drectmesh") {
      return document_.Wrong(**topology,
                             fmt::format("TopologyType '{}' is not supported; supported: 3DCoRectMesh and 3DRectMesh, whose axes "
                                         "are straight",
                                         Printable(type)));
    }
    const std::string dimensions = (*topology)->Attribute({"Dimensions", "NumberOfElements"});
    const std::optional<std::vector<std::uint64_t>> sizes = CountsInText(dimensions, 3);
    if (!sizes || sizes->size() != 3 || std::ranges::count(*sizes, 0) > 0) {
      return document_.Wrong(**topology, fmt::format("Dimensions is '{}', must be 3 whole numbers above 0", Printable(dimensions)));
    }
    const Result<const XdmfElement*> geometry = Needed("Geometry");
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

  // Where its values belong; nullopt: not to points or cells.
  static std::optional<ValuesAt> PlaceOf(const XdmfElement& attribute) {
    const std::string center = attribute.Word({"Center"});
    if (center == "cell") return ValuesAt::kCells;
    return center.empty() || center == "node" ? std::optional(ValuesAt::kPoints) : std::nullopt;
  }

  Result<XdmfItem> ItemOf(const XdmfElement& attribute) {
    const auto items = XdmfDocument::Children(attribute, "DataItem");
    return items.empty() ? Result<XdmfItem>(document_.Wrong(attribute, "has no DataItem")) : ParseXdmfItem(document_, *items.front());
  }

  // Of the header's size; 1: it does not fit it, which shows when it is read.
  int ComponentsOf(const XdmfItem& item) const {
    const std::uint64_t voxels = CountIn(grid_.header.size), elements = item.elements();
    return elements % voxels == 0 && elements / voxels <= std::uint64_t{kMaxComponents} ? int(elements / voxels) : 1;
  }

  Result<const XdmfElement*> Choose(const PointGrid& points, const ReadOptions& options) {
    std::vector<GridArray> arrays;
    std::vector<const XdmfElement*> attributes;
    for (const XdmfElement* child : XdmfDocument::Children(element_, "Attribute")) {
      const Result<const XdmfElement*> attribute = document_.Resolved(*child);
      if (!attribute.ok()) return attribute;
      const std::optional<ValuesAt> at = PlaceOf(**attribute);
      if (!at) continue;
      GridArray array{.name = (*attribute)->Attribute({"Name"}), .at = *at};
      // Whoever chooses one that cannot be read is told why then.
      const Result<XdmfItem> item = ItemOf(**attribute);
      if (item.ok() && SetGrid(grid_.header, grid_.named, points, *at).ok()) {
        array.components = ComponentsOf(*item);
        array.type_name = item->type_name;
        if (item->format != XdmfItem::Format::kHdf5) array.type = item->type;
      }
      arrays.push_back(std::move(array));
      attributes.push_back(*attribute);
    }
    const Result<std::size_t> chosen = ChooseArray(grid_.named, arrays, options.array);
    if (!chosen.ok()) return chosen.status();
    grid_.array = arrays[*chosen].name;
    grid_.at = arrays[*chosen].at;
    grid_.header.notes = NotesOf(arrays, *chosen);
    return attributes[*chosen];
  }

  Result<const XdmfElement*> FindLike(const XdmfGrid& like) {
    grid_.array = like.array;
    grid_.at = like.at;
    for (const XdmfElement* child : XdmfDocument::Children(element_, "Attribute")) {
      const Result<const XdmfElement*> attribute = document_.Resolved(*child);
      if (!attribute.ok() || ((*attribute)->Attribute({"Name"}) == like.array && PlaceOf(**attribute) == like.at)) return attribute;
    }
    return Wrong(fmt::format("has no attribute '{}' of {}, which {} has", like.array, NameOf(like.at), like.named));
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
