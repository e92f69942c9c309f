#include "data/volume_io/vtk_list.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <span>

#include "common/text/trimmed.h"
#include "data/volume_io/xml_events.h"

namespace slabstream {
namespace {

// "PUnstructuredGrid", not "PolyData".
bool IsOfPieces(const std::string& type) {
  return type.size() > 1 && type[0] == 'P' && std::isupper(static_cast<unsigned char>(type[1])) != 0;
}

}  // namespace

Result<VtkList> ReadVtkList(const std::string& path) {
  namespace fs = std::filesystem;
  const auto wrong = [&](const std::string& why) { return Status::InvalidArgument(path + ": " + why); };
  VtkList list;
  std::size_t files = 0;
  bool unnamed = false;
  const auto on_start = [&](const XmlTag& tag) {
    if (tag.name == "VTKFile") list.type = Trimmed(tag.Attribute("type"));
    const bool of_pieces = IsOfPieces(list.type);
    if (tag.name != (of_pieces ? "Piece" : "DataSet")) return of_pieces || list.OfBlocks() || list.type.empty();
    const std::string source(Trimmed(tag.Attribute(of_pieces ? "Source" : "file"))), name(Trimmed(tag.Attribute("name")));
    unnamed = unnamed || (of_pieces && source.empty());  // while a block without a file is an empty one
    if (!source.empty() && ++files <= kMostListedFiles) {
      list.entries.push_back({(fs::path(path).parent_path() / source).string(), name.empty() ? source : name});
    }
    return true;
  };
  if (Status status = ReadXmlFile(path, "not a VTK file: ", {on_start, [](const XmlTag&) {}}); !status.ok()) return status;
  if (list.type.empty()) return wrong("not a VTK file: has no element VTKFile with a type");
  if (unnamed) return wrong("a Piece of it has no Source");
  if ((IsOfPieces(list.type) || list.OfBlocks()) && (files == 0 || files > kMostListedFiles)) {
    return wrong(fmt::format("names {} files, must name 1 to {}", files, kMostListedFiles));
  }
  return list;
}

bool ListsImages(const std::string& path) {
  const Result<VtkList> list = ReadVtkList(path);
  if (!list.ok() || !list->OfBlocks()) return false;
  for (const VtkListEntry& entry : list->entries) {
    const Result<VtkList> block = ReadVtkList(entry.path);
    if (block.ok() && block->OfSurfaces()) continue;
    return block.ok() && std::ranges::count(kVtkImageTypes, block->type) > 0;
  }
  return false;
}

std::string SurfacesNote(const std::vector<std::string>& names) {
  const std::size_t named = std::min<std::size_t>(names.size(), 8);
  const std::string more = named < names.size() ? fmt::format(" and {} more", names.size() - named) : "";
  return fmt::format("surfaces are left out: {}{}", fmt::join(std::span(names).first(named), ", "), more);
}

}  // namespace slabstream
