#include "common/decomposition/decomposition.h"

namespace slabstream {

const std::vector<DecompositionEntry>& Decompositions() {
  static const std::vector<DecompositionEntry> entries = {
      {"slab", "equal slabs of slices along --axis", MakeSlabs},
  };
  return entries;
}

const DecompositionEntry* FindDecomposition(std::string_view name) {
  for (const DecompositionEntry& entry : Decompositions()) {
    if (entry.name == name) return &entry;
  }
  return nullptr;
}

}  // namespace slabstream
