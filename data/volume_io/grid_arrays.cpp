#include "data/volume_io/grid_arrays.h"

#include <fmt/format.h>

#include <array>

#include "common/base/did_you_mean.h"
#include "common/base/find_named.h"

namespace slabstream {
namespace {

constexpr std::array kPlaces = {ValuesAt::kPoints, ValuesAt::kCells};

}  // namespace

Result<std::size_t> ChooseArray(const std::string& path, const std::vector<GridArray>& arrays, const std::string& wanted) {
  const auto wrong = [&](const std::string& why) { return Status::InvalidArgument(path + ": " + why); };
  const auto numbers = [&](auto&& fits) {
    std::vector<std::size_t> found;
    for (std::size_t i = 0; i < arrays.size(); ++i) {
      if (fits(arrays[i])) found.push_back(i);
    }
    return found;
  };
  const auto readable = [&](std::size_t i) -> Result<std::size_t> {
    if (arrays[i].type) return i;
    return wrong(fmt::format("array {}: type '{}' is not supported", arrays[i].name, arrays[i].type_name));
  };
  if (arrays.empty()) return wrong("has no array of points or cells");

  for (const ValuesAt at : kPlaces) {
    const auto named = numbers([&](const GridArray& array) { return array.at == at && !wanted.empty() && array.name == wanted; });
    if (!named.empty()) return readable(named.front());
  }
  if (!wanted.empty()) return wrong(fmt::format("has no array '{}'; it has {}{}", wanted, NamesOf(arrays), DidYouMean(wanted, arrays)));

  for (const ValuesAt at : kPlaces) {
    const auto active = numbers([&](const GridArray& array) { return array.at == at && array.active; });
    if (!active.empty()) return readable(active.front());
  }
  for (const ValuesAt at : kPlaces) {
    for (const bool scalars : {true, false}) {
      const auto candidates = numbers([&](const GridArray& array) {
        return array.at == at && array.type && (array.components == 1 || !scalars) && !array.name.starts_with("vtk");
      });
      if (candidates.size() == 1) return candidates.front();
      if (candidates.size() > 1) {
        return wrong("has several arrays and none is the active scalars; choose one by its name (--array): " + NamesOf(arrays));
      }
    }
  }
  if (arrays.size() == 1) return readable(0);
  return wrong("has no array that is read without its name (--array), only " + NamesOf(arrays));
}

std::vector<std::string> NotesOf(const std::vector<GridArray>& arrays, std::size_t chosen) {
  std::vector<std::string> notes;
  const auto& [name, at, type, type_name, components, active] = arrays[chosen];
  if (arrays.size() > 1) notes.push_back(fmt::format("array {} of {} is shown, of {}", name, NameOf(at), NamesOf(arrays)));
  if (at == ValuesAt::kCells) notes.emplace_back("voxels are the cells of the grid, not its points");
  return notes;
}

}  // namespace slabstream
