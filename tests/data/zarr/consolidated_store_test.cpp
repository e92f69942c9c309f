// Consolidated metadata: what one object says of all nodes is not asked for again.
#include "data/zarr/consolidated_store.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <mutex>

#include "data/zarr/zarr_pyramid.h"
#include "tests/data/volume_io/volume_files.h"
#include "tests/data/zarr/read_zarr.h"
#include "tests/data/zarr/zarr_files.h"
#include "tests/support/temporary_directory.h"
#include "tests/support/whole_file.h"

namespace slabstream {
namespace {

using testing::Contains;
using testing::ElementsAre;
using testing::Not;

// A folder that cannot list, as a web server, and notes what it is asked for.
class SilentStore : public Store {
 public:
  explicit SilentStore(const std::string& folder) : folder_(FolderStore(folder)) {}

  void Read(const std::string& key, const ByteRange& range, std::uint64_t most, Done done, StillWanted /*wanted*/) override {
    {
      const std::lock_guard lock(mutex_);
      asked_.push_back(key);
    }
    folder_->Read(key, range, most, std::move(done));
  }
  Result<std::vector<std::string>> List(const std::string&) override { return Status::InvalidArgument("lists nothing"); }
  const std::string& name() const override { return folder_->name(); }

  std::vector<std::string> asked() const {
    const std::lock_guard lock(mutex_);
    return asked_;
  }

 private:
  const std::shared_ptr<Store> folder_;
  mutable std::mutex mutex_;
  std::vector<std::string> asked_;
};

Json ReadJsonFile(const std::string& path) { return Json::Parse(ReadFile(path)).value(); }

// A group of an array of volumes and its coordinates, consolidated.
void WriteConsolidated(const std::string& folder, int version) {
  const ZarrSpec volume{.version = version, .shape = {2, 3, 4}, .chunk = {2, 3, 4}, .separator = '/'};
  const ZarrSpec line{.version = version, .shape = {4}, .chunk = {4}};
  WriteZarrArray(folder + "/runs/a", volume, [](auto at) { return double(at[2]); });
  WriteZarrArray(folder + "/runs/x", line, [](auto at) { return double(at[0]); });
  WriteZarrGroup(folder + "/runs", version, Json::object());
  Json nodes;
  for (const std::string path : {"runs", "runs/a", "runs/x"}) {
    if (version == 3) {
      nodes[path] = ReadJsonFile(folder + "/" + path + "/zarr.json");
    } else {
      const std::string key = path + (path == "runs" ? "/.zgroup" : "/.zarray");
      nodes[key] = ReadJsonFile(folder + "/" + key);
    }
  }
  if (version == 2) {
    WriteZarrGroup(folder, 2, Json::object());
    return WriteJson(folder + "/.zmetadata", {{"zarr_consolidated_format", 1}, {"metadata", nodes}});
  }
  WriteJson(folder + "/zarr.json", {{"zarr_format", 3},
                                    {"node_type", "group"},
                                    {"consolidated_metadata", {{"kind", "inline"}, {"must_understand", false}, {"metadata", nodes}}}});
}

TEST(ConsolidatedStoreTest, NodesAreKnownWithoutAsking) {
  for (const int version : {2, 3}) {
    const TemporaryDirectory folder;
    WriteConsolidated(folder.path(), version);
    const auto silent = std::make_shared<SilentStore>(folder.path());
    const std::shared_ptr<Store> store = zarr::WithConsolidatedMetadata(silent);
    ASSERT_NE(store, silent);
    EXPECT_THAT(*store->List(""), ElementsAre("runs/"));
    EXPECT_THAT(*store->List("runs"), ElementsAre("a/", "x/"));
    EXPECT_THAT(*store->List("nowhere"), ElementsAre());
    const Result<Pyramid> pyramid = zarr::OpenPyramid(store, {.array = "runs"}, TestContext());
    ASSERT_TRUE(pyramid.ok()) << pyramid.status().message();
    EXPECT_THAT(silent->asked(), Not(Contains(testing::StartsWith("runs/"))));
    // What is not said there may still be there, and chunks are.
    WriteZarrGroup(folder / "later", version, Json::object());
    EXPECT_TRUE(ReadNow(*store, version == 3 ? "later/zarr.json" : "later/.zgroup").ok());
    EXPECT_TRUE(ReadNow(*store, version == 3 ? "runs/a/c/0/0/0" : "runs/a/0/0/0").ok());
    EXPECT_EQ(ReadNow(*store, "runs/a/.zattrs").status().code(), StatusCode::kNotFound);
    EXPECT_EQ(ReadNow(*store, version == 3 ? "runs/zarr.json" : "runs/.zgroup", 3).status().code(), StatusCode::kResourceExhausted);
  }
}

TEST(ConsolidatedStoreTest, WithoutThemTheStoreStaysItself) {
  const TemporaryDirectory folder;
  const auto store = std::make_shared<SilentStore>(folder.path());
  EXPECT_EQ(zarr::WithConsolidatedMetadata(store), store);
  WriteFile(folder / ".zmetadata", "{\"metadata\": [");
  EXPECT_EQ(zarr::WithConsolidatedMetadata(store), store);
  WriteFile(folder / ".zmetadata", "{\"metadata\": [1, 2]}");
  EXPECT_EQ(zarr::WithConsolidatedMetadata(store), store);
}

}  // namespace
}  // namespace slabstream
