#include "common/combining/schedule.h"

namespace slabstream {

const std::vector<CombiningEntry>& CombiningSchemes() {
  static const std::vector<CombiningEntry> entries = {
      {"fan-in", "binary tree of workers, log2(workers) rounds", MakeFanIn},
      {"centralized", "every worker sends to one, which combines all", MakeCentralized},
  };
  return entries;
}

const CombiningEntry* FindCombiningScheme(std::string_view name) {
  for (const CombiningEntry& entry : CombiningSchemes()) {
    if (entry.name == name) return &entry;
  }
  return nullptr;
}

}  // namespace slabstream
