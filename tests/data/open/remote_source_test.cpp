// Volumes at addresses: the same voxels as from files, whatever the server goes through.
#include "data/open/remote_source.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <filesystem>
#include <fstream>

#include "common/files/files.h"
#include "data/open/open_source.h"
#include "data/zarr_writer/ome_zarr_writer.h"
#include "tests/data/sources/memory_source.h"
#include "tests/data/sources/opened_source.h"
#include "tests/data/stores/scripted_server.h"
#include "tests/support/random_volume.h"
#include "tests/support/temporary_directory.h"

namespace slabstream {
namespace {

class RemoteSourceTest : public testing::Test {
 protected:
  // An OME-Zarr of two levels in chunks of 8 voxels, in the folder NAME.
  std::string Write(const std::string& name, OmeZarrVersion version) {
    Random random(81);
    SCOPED_TRACE(random.trace());
    const auto volume = std::make_shared<const Volume>(RandomVolume(random, {20, 18, 16}, ScalarType::kUint8));
    const std::string path = directory_ / name;
    const Status written = WriteOmeZarr(*MakeMemorySource(volume, {.format = "test", .file_type = "uint8"}), path,
                                        {.version = version, .chunk_side = 8, .shard_side = 16});
    CHECK(written.ok()) << written.message();
    return path;
  }
  Result<std::shared_ptr<VolumeSource>> Open(const std::string& path, const ReadOptions& options = {}) {
    return OpenSource(path, options, context_);
  }
  static std::vector<std::byte> AllOf(VolumeSource& source, int level) {
    const VolumeDescription& description = source.info().levels.at(std::size_t(level)).description;
    std::vector<std::byte> samples(std::size_t(description.voxel_bytes()));
    const Status read = source.ReadNow(level, description.geometry.bounds(), samples);
    EXPECT_TRUE(read.ok()) << read.message();
    return samples;
  }

  TemporaryDirectory directory_;
  const SourceContext context_ = TestReadContext();
};

TEST_F(RemoteSourceTest, HasTheVoxelsOfTheFiles) {
  std::atomic<int> count = 0;
  const ScriptedServer::Script serves = ServesFolder(directory_.path());
  const ScriptedServer server([&](const ServerRequest& request) { return ++count % 7 == 3 ? AnswerText("503 x", "") : serves(request); });
  for (const OmeZarrVersion version : {OmeZarrVersion::k04, OmeZarrVersion::k05}) {
    const std::string name = version == OmeZarrVersion::k04 ? "four.zarr" : "five.zarr";
    const auto files = Opened(Open(Write(name, version))), remote = Opened(Open(server.url() + "/" + name));
    ASSERT_EQ(remote->info().levels.size(), files->info().levels.size());
    EXPECT_EQ(remote->info().format, files->info().format);
    EXPECT_TRUE(remote->info().files.empty());
    for (int level = 0; level < int(files->info().levels.size()); ++level) {
      EXPECT_EQ(remote->info().levels[std::size_t(level)].description, files->info().levels[std::size_t(level)].description);
      EXPECT_EQ(AllOf(*remote, level), AllOf(*files, level)) << name << ", level " << level;
    }
    EXPECT_GT(remote->counts().stored_bytes, 0U);
  }
}

TEST_F(RemoteSourceTest, VersionsAreThoseOfMarkers) {
  const std::string path = Write("scan.zarr", OmeZarrVersion::k05);
  const ScriptedServer server(ServesFolder(directory_.path()));
  const std::string url = server.url() + "/scan.zarr";
  const std::uint64_t version = Opened(Open(url))->info().version;
  EXPECT_EQ(Opened(Open(url))->info().version, version) << "whoever opens it";
  std::ofstream(path + "/zarr.json", std::ios::app) << "\n";
  EXPECT_NE(Opened(Open(url))->info().version, version);
}

TEST_F(RemoteSourceTest, SaysWhatIsThereOrWhatIsWrong) {
  Write("scan.zarr", OmeZarrVersion::k05);
  ASSERT_TRUE(std::filesystem::create_directory(directory_ / "empty"));
  const ScriptedServer::Script serves = ServesFolder(directory_.path());
  const ScriptedServer server([&](const ServerRequest& request) {
    return request.target.starts_with("/private") ? AnswerText("403 Forbidden", "") : serves(request);
  });
  const auto failure = [&](const std::string& name, const ReadOptions& options = {}) {
    return Open(server.url() + name, options).status();
  };
  EXPECT_EQ(failure("/empty").code(), StatusCode::kNotFound);
  EXPECT_THAT(failure("/empty").message(), HasSubstr("/empty: is no volume that can be read from an address"));
  EXPECT_EQ(failure("/private").code(), StatusCode::kUnavailable);
  EXPECT_THAT(failure("/private").message(), HasSubstr("HTTP 403"));
  EXPECT_EQ(failure("/scan.zarr", {.dims = Index3{1, 1, 1}}).code(), StatusCode::kInvalidArgument);
}

// Buckets that do not let strangers list them say 403 of what is not there; viewers answer all with a page.
TEST_F(RemoteSourceTest, OpensWhereWhatIsMissingIsForbiddenOrAPage) {
  const ScriptedServer::Script serves = ServesFolder(directory_.path());
  const std::string answers[] = {AnswerText("403 Forbidden", "<Error><Code>AccessDenied</Code></Error>"),
                                 AnswerText("200 OK", "<!doctype html><html></html>", "Content-Type: text/html\r\n")};
  for (const OmeZarrVersion version : {OmeZarrVersion::k04, OmeZarrVersion::k05}) {
    const std::string name = version == OmeZarrVersion::k04 ? "four.zarr" : "five.zarr", path = Write(name, version);
    std::filesystem::remove(path + (version == OmeZarrVersion::k04 ? "/0/0/0/0" : "/0/c/0/0/0"));
    for (const std::string& missing : answers) {
      const ScriptedServer server([&](const ServerRequest& request) {
        return std::filesystem::is_regular_file(directory_.path() + request.target) ? serves(request) : missing;
      });
      const auto files = Opened(Open(path)), remote = Opened(Open(server.url() + "/" + name));
      EXPECT_EQ(AllOf(*remote, 0), AllOf(*files, 0)) << name << missing;
    }
  }
}

TEST_F(RemoteSourceTest, APageForEverythingIsNoVolume) {
  const std::pair<std::string, const char*> pages[] = {
      {AnswerText("200 OK", "<html>an app</html>", "Content-Type: text/html\r\n"), "a page of HTML came"},
      {AnswerText("200 OK", "<p>an app"), "it holds none of"},
      {AnswerText("200 OK", "{\"error\": \"not found\"}"), "it holds none of"},
      {AnswerText("200 OK", ""), "it holds none of"}};
  for (const auto& [page, why] : pages) {
    const ScriptedServer server([answer = page](const ServerRequest&) { return answer; });
    EXPECT_THAT(Open(server.url() + "/a.n5").status().message(), HasSubstr(why));
  }
}

// One marker that cannot be read does not matter if another one is there.
TEST_F(RemoteSourceTest, OneMarkerIsEnough) {
  Write("scan.zarr", OmeZarrVersion::k05);
  const ScriptedServer::Script serves = ServesFolder(directory_.path());
  const ScriptedServer server([&](const ServerRequest& request) {
    return request.target.ends_with("/attributes.json") ? AnswerText("400 Bad Request", "") : serves(request);
  });
  EXPECT_TRUE(Open(server.url() + "/scan.zarr").ok());
}

TEST_F(RemoteSourceTest, TheQueryOfAnAddressGoesWithEachRequestAndIsNotShown) {
  const std::string path = Write("scan.zarr", OmeZarrVersion::k04);
  const ScriptedServer::Script serves = ServesFolder(directory_.path());
  const ScriptedServer server([&](const ServerRequest& request) {
    const std::string signature = "?sv=1&sig=secret";
    if (!request.target.ends_with(signature)) return AnswerText("403 x", "");
    ServerRequest plain = request;
    plain.target.resize(plain.target.size() - signature.size());
    return serves(plain);
  });
  const auto remote = Opened(Open(server.url() + "/scan.zarr", {.query = "sv=1&sig=secret"}));
  EXPECT_EQ(AllOf(*remote, 0), AllOf(*Opened(Open(path)), 0));
  EXPECT_THAT(remote->info().notes, testing::Contains("each request has the query of the address: sv, sig"));
  EXPECT_THAT(Open(server.url() + "/scan.zarr", {.query = "sig=secret"}).status().message(), testing::Not(HasSubstr("secret")));
  EXPECT_THAT(Open(path, {.headers = {"A:b"}}).status().message(), HasSubstr("header is no option of Zarr"));
}

TEST_F(RemoteSourceTest, AStoreThatComesBackIsReadAgain) {
  Write("scan.zarr", OmeZarrVersion::k04);
  std::atomic<bool> broken = false;
  const ScriptedServer::Script serves = ServesFolder(directory_.path());
  const ScriptedServer server([&](const ServerRequest& request) { return broken ? AnswerText("403 Forbidden", "") : serves(request); });
  const auto source = Opened(Open(server.url() + "/scan.zarr"));
  std::vector<std::byte> samples(20 * 18 * 16);
  broken = true;
  const Status failed = source->ReadNow(0, {{0, 0, 0}, {20, 18, 16}}, samples);
  EXPECT_EQ(failed.code(), StatusCode::kUnavailable);
  EXPECT_THAT(failed.message(), HasSubstr(server.url() + "/scan.zarr/0/"));
  broken = false;
  EXPECT_TRUE(source->ReadNow(0, {{0, 0, 0}, {20, 18, 16}}, samples).ok());
}

}  // namespace
}  // namespace slabstream
