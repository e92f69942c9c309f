// Volumes as they are decoded as a whole, whatever else their formats allow: other code than what reads boxes.
#pragma once

#include <gtest/gtest.h>

#include <string>
#include <utility>

#include "common/base/check.h"
#include "data/open/open_source.h"
#include "data/open/read_volume.h"
#include "data/positional/decoded_source.h"
#include "tests/data/sources/opened_source.h"
#include "tests/data/volume_io/volume_files.h"
#include "tests/support/random_box.h"

namespace slabstream {

inline Result<LoadedVolume> ReadDecoded(const std::string& path, const ReadOptions& options = {}) {
  const VolumeFormat* const format = FindFormat(path, options);
  CHECK(format != nullptr) << path;
  const Result<std::shared_ptr<VolumeSource>> source = OpenDecoded(*format, path, options);
  if (!source.ok()) return source.status();
  Result<LevelInMemory> level = (*source)->ReadLevel(0, nullptr, {.all_exact = true});
  if (!level.ok()) return level.status();
  LoadedVolume loaded{*std::move(level), (*source)->info()};
  loaded.info.levels.front().description = loaded.volume->description;
  return loaded;
}

// The volume as it is read by boxes is `whole`: what is said of it, and the values of the whole volume and of `boxes` - 1 random boxes,
// which may be stored as another type. Calls check(box, its samples) for each of them, too.
template <class Check>
void ExpectReadsAs(const LoadedVolume& whole, VolumeSource& source, Random& random, int boxes, Check&& check) {
  const SourceInfo& info = source.info();
  const VolumeDescription &description = info.levels.at(0).description, &wanted = whole.info.finest();
  EXPECT_EQ(description.geometry, wanted.geometry);
  EXPECT_EQ(info.format, whole.info.format);
  EXPECT_EQ(info.file_type, whole.info.file_type);
  for (int i = 0; i < boxes; ++i) {
    SCOPED_TRACE(testing::Message() << "box " << i);
    const Box box = i == 0 ? wanted.geometry.bounds() : RandomBox(random, wanted.geometry.bounds());
    const VoxelBlock cut = CutBlock(whole.volume->block, box);
    const VoxelBlock read = {box, description.type, ReadBox(source, 0, box)};
    if (description == wanted) {
      ASSERT_TRUE(read.bytes == cut.bytes);
    } else {
      ASSERT_EQ(DataValues(description, read), DataValues(wanted, cut));
    }
    check(box, read.bytes);
  }
}

}  // namespace slabstream
