#include "data/zarr/find_volume.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <sstream>
#include <string_view>
#include <utility>
#include <vector>

#include "common/base/printable.h"
#include "data/sources/axis_kind.h"
#include "data/zarr/ome.h"

namespace slabstream::zarr {
namespace {

using metadata::Field;
using metadata::Join;

constexpr std::size_t kMostLooked = 1000, kMostTold = 20;

Status Refused(const Store& store, const std::string& path, const std::string& why) {
  return Printable(Status::InvalidArgument(NameOf(store, path) + ": " + why));
}

// "a/x, a/y, ..."
std::string Listed(const std::string& path, const std::vector<std::string>& children) {
  std::string list;
  for (std::size_t i = 0; i < std::min(children.size(), kMostTold); ++i) list += (i > 0 ? ", " : "") + Join(path, children[i]);
  return list + (children.size() > kMostTold ? ", ..." : "");
}

// Paths that a list in metadata names: each as a text, or as the member "path".
std::vector<std::string> PathsOf(const Field& list) {
  std::vector<std::string> paths;
  for (std::size_t i = 0; list.is_array() && i < std::min(list.size(), kMostLooked); ++i) {
    const Field path = list[i].is_text() ? list[i] : list[i]["path"];
    if (path.is_text()) paths.push_back(*path.Text());
  }
  return paths;
}

// Arrays that only say where the elements of others lie, as xarray keeps coordinates, have one axis, or two beside larger ones.
std::vector<std::string> OfMostAxes(const std::vector<std::pair<std::string, std::size_t>>& arrays) {
  constexpr std::size_t kVolume = 3;
  std::size_t most = 0;
  for (const auto& [name, axes] : arrays) most = std::max(most, std::min(axes, kVolume));
  std::vector<std::string> names;
  for (const auto& [name, axes] : arrays) {
    if (axes >= most) names.push_back(name);
  }
  return names;
}

// The path of the only array in a group.
Result<std::string> OnlyArray(Store& store, const std::string& path) {
  const Result<std::vector<std::string>> names = store.List(path);
  if (!names.ok()) return names.status();
  std::vector<std::pair<std::string, std::size_t>> found;  // arrays, and how many axes they have
  std::vector<std::string> groups;
  std::set<std::string> named;  // by others
  std::size_t looked = 0;
  for (const std::string& name : *names) {
    if (!name.ends_with('/') || name.starts_with('.') || ++looked > kMostLooked) continue;
    const std::string child = name.substr(0, name.size() - 1);
    const Result<std::optional<ZarrNode>> node = NodeReading(store, Join(path, child)).Get();
    if (!node.ok() || !node->has_value()) continue;
    if ((*node)->array) {
      found.emplace_back(child, (*node)->metadata_field()["shape"].size());
      for (const std::string_view attribute : kNamingAttributes) {
        const Result<std::string> text = (*node)->attributes_field()[std::string(attribute)].Text();
        std::istringstream names_in(text.ok() ? *text : "");
        for (std::string other; names_in >> other;) named.insert(std::move(other));
      }
    } else {
      groups.push_back(child);
    }
  }
  const auto is_named = [&](const auto& array) { return named.contains(array.first); };
  if (!std::ranges::all_of(found, is_named)) std::erase_if(found, is_named);
  const std::vector<std::string> arrays = OfMostAxes(found);
  if (arrays.size() == 1) return Join(path, arrays.front());
  std::string why = "a group without arrays";
  if (!arrays.empty()) why = fmt::format("a group of {} arrays, of which ?array= takes one: {}", arrays.size(), Listed(path, arrays));
  if (arrays.empty() && !groups.empty()) why += ", but with groups, of which ?array= takes one: " + Listed(path, groups);
  return Refused(store, path, why);
}

// Of a plate of several wells, its wells are named, and an image in the first of them.
Status SeveralWells(Store& store, const std::string& path, const std::vector<std::string>& wells) {
  const Result<std::optional<ZarrNode>> first = NodeReading(store, Join(path, wells.front())).Get();
  std::vector<std::string> images;
  if (first.ok() && first->has_value()) images = PathsOf(OmeField((*first)->attributes_field())["well"]["images"]);
  const std::string image = Join(Join(path, wells.front()), images.empty() ? "0" : images.front());
  return Refused(
      store, path,
      fmt::format("a plate of {} wells, of which ?array= takes an image, such as {}: {}", wells.size(), image, Listed(path, wells)));
}

// The path of the only volume below a group.
Result<std::string> Below(Store& store, const ZarrNode& group) {
  const Field ome = OmeField(group.attributes_field());
  // bioformats2raw writes one image or more as 0, 1, ... into a group.
  if (ome["bioformats2raw.layout"].given()) return Join(group.path, "0");
  const std::vector<std::string> wells = PathsOf(ome["plate"]["wells"]), fields = PathsOf(ome["well"]["images"]);
  const std::vector<std::string> labels =
      NameOf(store, group.path).ends_with("/labels") ? PathsOf(ome["labels"]) : std::vector<std::string>();
  for (const std::vector<std::string>* const paths : {&wells, &fields, &labels}) {
    if (paths->size() == 1) return Join(group.path, paths->front());
  }
  if (!wells.empty()) return SeveralWells(store, group.path, wells);
  const auto several = [&](std::string_view what, const std::vector<std::string>& paths) {
    return Refused(store, group.path,
                   fmt::format("{} of {} images, of which ?array= takes one: {}", what, paths.size(), Listed(group.path, paths)));
  };
  if (!fields.empty()) return several("a well", fields);
  if (!labels.empty()) return several("a group", labels);
  return OnlyArray(store, group.path);
}

}  // namespace

std::string NameOf(const Store& store, const std::string& path) { return path.empty() ? store.name() : store.name() + "/" + path; }

Result<ZarrNode> NodeOf(const Store& store, NodeReading reading, std::set<std::string>& keys) {
  Result<std::optional<ZarrNode>> node = reading.Get();
  if (!node.ok()) return node.status();
  if (!node->has_value()) return Printable(Status::NotFound(NameOf(store, reading.path()) + ": no Zarr array or group is there"));
  keys.insert((*node)->keys.begin(), (*node)->keys.end());
  return **std::move(node);
}

Result<FoundVolume> FindVolume(Store& store, std::string path) {
  FoundVolume found;
  constexpr int kMostSteps = 4;
  for (int step = 0; step < kMostSteps; ++step) {
    Result<ZarrNode> node = NodeOf(store, NodeReading(store, path), found.keys);
    if (!node.ok()) return node.status();
    if (node->array || IsOmeImage(node->attributes_field())) {
      found.node = *std::move(node);
      return found;
    }
    Result<std::string> below = Below(store, *node);
    if (!below.ok()) return below.status();
    path = *std::move(below);
  }
  return Status::InvalidArgument(NameOf(store, path) + ": too many groups in groups");
}

}  // namespace slabstream::zarr
