// Cells that are kept on disk, held against those in memory.
#pragma once

#include <gtest/gtest.h>

#include <cstdlib>
#include <string>

#include "common/mesh/mesh_part.h"
#include "data/open/open_source.h"

namespace slabstream {

// `cache`: a folder for the store. Reads the grid from memory first, since a store that is there is used.
inline void ExpectKeptCellsAreTheSame(const std::string& path, ReadOptions options, const SourceContext& context,
                                      const std::string& cache) {
  ::setenv("XDG_CACHE_HOME", cache.c_str(), 1);
  const auto read = [&] {
    const Result<std::shared_ptr<VolumeSource>> source = OpenSource(path, options, context);
    return source.ok() ? (*source)->ReadLevel(0) : source.status();
  };
  const Result<LevelInMemory> held = read();
  options.keep_cells = true;
  const Result<LevelInMemory> kept = read();
  ::unsetenv("XDG_CACHE_HOME");
  ASSERT_TRUE(held.ok()) << held.status().message();
  ASSERT_TRUE(kept.ok()) << kept.status().message();
  ASSERT_TRUE(held->volume->cells != nullptr && kept->cells != nullptr);
  EXPECT_EQ(held->volume->description, kept->volume->description);
  EXPECT_EQ(held->volume->block.bytes, kept->volume->block.bytes);
  const Box all = held->volume->description.geometry.bounds();
  const Result<Mesh> cells = kept->cells->CellsIn(all);
  ASSERT_TRUE(cells.ok()) << cells.status().message();
  EXPECT_EQ(EncodeMesh(*cells), EncodeMesh(MeshCutter(held->volume->cells).Cut(all)));
}

}  // namespace slabstream
