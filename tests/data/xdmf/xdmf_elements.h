// Elements of XDMF files, as tests put them together.
#pragma once

#include <fmt/format.h>

#include <string>

namespace slabstream {

inline std::string Element(const std::string& name, const std::string& attributes, const std::string& inside) {
  return fmt::format("<{0} {1}>{2}</{0}>\n", name, attributes, inside);
}
inline std::string Item(const std::string& dimensions, const std::string& text, const std::string& attributes = "") {
  return Element("DataItem", fmt::format("Dimensions=\"{}\" {}", dimensions, attributes), text);
}
inline std::string HdfItem(const std::string& dimensions, const std::string& place) { return Item(dimensions, place, "Format=\"HDF\""); }
inline std::string Slab(const std::string& selection, const std::string& item) {
  return Element("DataItem", "ItemType=\"HyperSlab\"", "<DataItem>" + selection + "</DataItem>" + item);
}
inline std::string Attribute(const std::string& name, const std::string& item, const std::string& attributes = "") {
  return Element("Attribute", fmt::format("Name=\"{}\" {}", name, attributes), item);
}
inline std::string Grid(const std::string& inside, const std::string& attributes = "Name=\"g\" GridType=\"Uniform\"") {
  return Element("Grid", attributes, inside);
}
inline std::string Collection(const std::string& type, const std::string& inside) {
  return Grid(inside, "Name=\"all\" GridType=\"Collection\" CollectionType=\"" + type + "\"");
}

}  // namespace slabstream
