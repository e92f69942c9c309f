// The attributes of a grid of an XDMF file: its values, at its points or in its cells.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "common/base/status.h"
#include "data/volume_io/grid_arrays.h"
#include "data/xdmf/xdmf_document.h"
#include "data/xdmf/xdmf_item.h"

namespace slabstream {

struct XdmfAttribute {
  const XdmfElement* element = nullptr;
  GridArray array;  // its name, and where its values belong; the rest is what can be told before it is read
};

// How many points or cells the grid has; 0: it is not known.
using XdmfCounts = std::function<std::uint64_t(ValuesAt)>;

// Those that belong to points or cells. Errors of XdmfDocument::Resolved. What is wrong with an attribute is told when it is read.
Result<std::vector<XdmfAttribute>> AttributesOf(XdmfDocument& document, const XdmfElement& grid, const XdmfCounts& counts);

// The one of that name and place. InvalidArgument, naming the grid and the other one, which is `like`: it has none.
Result<const XdmfElement*> FindAttribute(XdmfDocument& document, const XdmfElement& grid, const std::string& name, ValuesAt at,
                                         const std::string& like);

// InvalidArgument, naming the attribute: it has none or several items, or is a finite element function; errors of ParseXdmfItem.
Result<XdmfItem> ItemOf(XdmfDocument& document, const XdmfElement& attribute);

// Numbers for each of so many points or cells; 1: the item has another size, which shows when it is read.
int ComponentsOf(const XdmfItem& item, std::uint64_t count);

}  // namespace slabstream
