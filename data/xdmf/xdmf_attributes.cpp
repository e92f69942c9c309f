#include "data/xdmf/xdmf_attributes.h"

#include <fmt/format.h>

#include <utility>

#include "common/base/printable.h"
#include "data/volume_io/raw_volume.h"

namespace slabstream {
namespace {

// nullopt: its values belong neither to points nor to cells.
std::optional<ValuesAt> PlaceOf(const XdmfElement& attribute) {
  const std::string center = attribute.Word({"Center"});
  if (center == "cell") return ValuesAt::kCells;
  return center.empty() || center == "node" ? std::optional(ValuesAt::kPoints) : std::nullopt;
}

}  // namespace

Result<std::vector<XdmfAttribute>> AttributesOf(XdmfDocument& document, const XdmfElement& grid, const XdmfCounts& counts) {
  std::vector<XdmfAttribute> attributes;
  for (const XdmfElement* child : XdmfDocument::Children(grid, "Attribute")) {
    const Result<const XdmfElement*> attribute = document.Resolved(*child);
    if (!attribute.ok()) return attribute.status();
    const std::optional<ValuesAt> at = PlaceOf(**attribute);
    if (!at) continue;
    GridArray array{.name = (*attribute)->Attribute({"Name"}), .at = *at};
    const Result<XdmfItem> item = ItemOf(document, **attribute);
    if (const std::uint64_t count = counts(*at); item.ok() && count > 0) {
      array.components = ComponentsOf(*item, count);
      array.type_name = item->type_name;
      if (item->format != XdmfItem::Format::kHdf5) array.type = item->type;
    }
    attributes.push_back({*attribute, std::move(array)});
  }
  return attributes;
}

Result<const XdmfElement*> FindAttribute(XdmfDocument& document, const XdmfElement& grid, const std::string& name, ValuesAt at,
                                         const std::string& like) {
  for (const XdmfElement* child : XdmfDocument::Children(grid, "Attribute")) {
    const Result<const XdmfElement*> attribute = document.Resolved(*child);
    if (!attribute.ok() || ((*attribute)->Attribute({"Name"}) == name && PlaceOf(**attribute) == at)) return attribute;
  }
  return document.Wrong(grid, fmt::format("has no attribute '{}' of {}, which {} has", name, NameOf(at), like));
}

Result<XdmfItem> ItemOf(XdmfDocument& document, const XdmfElement& attribute) {
  // Of a finite element function there are several items.
  if (const std::string type = attribute.Word({"ItemType"}); !type.empty() && type != "uniform") {
    return document.Wrong(attribute, fmt::format("ItemType '{}' is not supported for an attribute; supported: Uniform", Printable(type)));
  }
  const auto items = XdmfDocument::Children(attribute, "DataItem");
  if (items.size() != 1) return document.Wrong(attribute, fmt::format("has {} of DataItem, must have 1", items.size()));
  return ParseXdmfItem(document, *items.front());
}

int ComponentsOf(const XdmfItem& item, std::uint64_t count) {
  const std::uint64_t elements = item.elements();
  return elements % count == 0 && elements / count <= std::uint64_t{kMaxComponents} ? int(elements / count) : 1;
}

}  // namespace slabstream
