// Key folders: what they admit, over restarts, rotations and revocations.
#include "common/service/key_folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <filesystem>
#include <string>

#include "common/files/files.h"
#include "tests/support/temporary_directory.h"

namespace slabstream {
namespace {

using testing::HasSubstr;

class KeyFolderTest : public testing::Test {
 protected:
  std::string path() const { return directory_ / "keys"; }
  std::string FileOf(Role role) const { return path() + "/" + std::string(NameOf(role)) + ".json"; }

  TemporaryDirectory directory_{"/tmp"};
  const KeyFolder::Service service_ = {"tcp://10.0.0.1:7420", "tcp://10.0.0.1:7421", 3};
};

TEST_F(KeyFolderTest, PublishesAFileForEachRole) {
  Result<KeyFolder> folder = KeyFolder::Open(path());
  ASSERT_TRUE(folder.ok()) << folder.status().message();
  ASSERT_TRUE(folder->Publish(service_).ok());
  for (const Role role : kRoles) {
    const Result<ServiceFile> file = ReadServiceFile(FileOf(role));
    ASSERT_TRUE(file.ok()) << file.status().message();
    EXPECT_EQ(file->role, role);
    EXPECT_EQ(file->endpoint, IsOfClients(role) ? service_.client_endpoint : service_.worker_endpoint);
    EXPECT_EQ(file->server_key, folder->server().public_key);
    EXPECT_EQ(file->epoch, 3U);
    EXPECT_EQ(folder->KeysOf({role}), std::set<std::string>{file->own.public_key});
  }
  for (const auto& entry : std::filesystem::directory_iterator(path())) {
    struct stat info {};
    ASSERT_EQ(::stat(entry.path().c_str(), &info), 0);
    EXPECT_EQ(info.st_mode & 077, 0U) << entry.path();
  }
}

TEST_F(KeyFolderTest, KeepsItsKeysOverRestarts) {
  const KeyPair server = KeyFolder::Open(path())->server();
  ASSERT_TRUE(KeyFolder::Open(path())->Publish(service_).ok());
  const ServiceFile before = ReadServiceFile(FileOf(Role::kClient)).value();
  Result<KeyFolder> again = KeyFolder::Open(path());
  ASSERT_TRUE(again.ok());
  ASSERT_TRUE(again->Publish({"tcp://10.0.0.1:9", "tcp://10.0.0.1:10", 4}).ok());
  EXPECT_EQ(again->server(), server);
  const ServiceFile after = ReadServiceFile(FileOf(Role::kClient)).value();
  EXPECT_EQ(after.own, before.own);
  EXPECT_EQ(after.endpoint, "tcp://10.0.0.1:9");
  EXPECT_EQ(after.epoch, 4U);
}

TEST_F(KeyFolderTest, RotationMakesANewKeyAndRevocationEndsTheOldOne) {
  Result<KeyFolder> folder = KeyFolder::Open(path());
  ASSERT_TRUE(folder.ok() && folder->Publish(service_).ok());
  const std::string old_key = ReadServiceFile(FileOf(Role::kClient))->own.public_key;
  const Result<AdmittedKey> made = folder->Rotate(Role::kClient);
  ASSERT_TRUE(made.ok());
  EXPECT_EQ(ReadServiceFile(FileOf(Role::kClient))->own.public_key, made->public_key);
  EXPECT_EQ(folder->KeysOf({Role::kClient}), (std::set<std::string>{old_key, made->public_key}));
  ASSERT_TRUE(folder->Revoke(old_key).ok());
  EXPECT_EQ(folder->Revoke(old_key).status().code(), StatusCode::kNotFound);
  ASSERT_TRUE(folder->Rotate(Role::kClient).ok());
  EXPECT_EQ(folder->Revoke(IdOfKey(ReadServiceFile(FileOf(Role::kClient))->own.public_key)).value(),
            ReadServiceFile(FileOf(Role::kClient))->own.public_key);
  EXPECT_EQ(KeyFolder::Open(path())->KeysOf({Role::kClient}), std::set<std::string>{made->public_key});
  EXPECT_EQ(KeyFolder::Open(path())->admitted().size(), kRoles.size());
}

TEST_F(KeyFolderTest, KeysOfPeopleHaveNamesAndAreRevokedOneByOne) {
  Result<KeyFolder> folder = KeyFolder::Open(path());
  ASSERT_TRUE(folder.ok() && folder->Publish(service_).ok());
  const KeyPair anna = MakeKeyPair(), zoe = MakeKeyPair();
  ASSERT_TRUE(folder->Issue(anna.public_key, Role::kClient, "anna").ok());
  ASSERT_TRUE(folder->Issue(zoe.public_key, Role::kAdmin, "Zo\u00eb B.").ok());
  EXPECT_EQ(KeyFolder::Open(path())->Find(zoe.public_key)->name, "Zo\u00eb B.");
  EXPECT_TRUE(folder->KeysOf({Role::kClient}).contains(anna.public_key));
  EXPECT_EQ(folder->Revoke("anna").value(), anna.public_key);
  EXPECT_EQ(folder->Revoke("anna").status().code(), StatusCode::kNotFound);
  EXPECT_EQ(KeyFolder::Open(path())->Find(anna.public_key), nullptr);
  EXPECT_EQ(folder->Revoke("").status().code(), StatusCode::kNotFound) << "not that of the keys without names";
  EXPECT_EQ(folder->admitted().size(), kRoles.size() + 1);
}

TEST_F(KeyFolderTest, KeysThatCannotBeIssuedAreRefused) {
  Result<KeyFolder> folder = KeyFolder::Open(path());
  ASSERT_TRUE(folder.ok());
  const std::string key = MakeKeyPair().public_key;
  for (const std::string& name : {std::string(), std::string(kMaxHolderNameBytes + 1, 'a'), std::string("a/b"), std::string("../a"),
                                  std::string(".hidden"), std::string("a\nb"), std::string(" a"), std::string("a ")}) {
    EXPECT_THAT(folder->Issue(key, Role::kClient, name).status().message(), HasSubstr("printable text that can name a file")) << name;
  }
  EXPECT_THAT(folder->Issue(key, Role::kWorker, "anna").status().message(), HasSubstr("of role client or admin"));
  EXPECT_FALSE(folder->Issue("short", Role::kClient, "anna").ok());
  ASSERT_TRUE(folder->Issue(key, Role::kClient, "anna").ok());
  EXPECT_FALSE(folder->Issue(key, Role::kClient, "bert").ok()) << "one name a key";
  EXPECT_THAT(folder->Issue(MakeKeyPair().public_key, Role::kClient, "anna").status().message(), HasSubstr("'anna' has the key"));
  EXPECT_EQ(folder->admitted().size(), 1U);
}

TEST_F(KeyFolderTest, AFileWhoseKeyIsNotAdmittedGetsANewOne) {
  Result<KeyFolder> folder = KeyFolder::Open(path());
  ASSERT_TRUE(folder.ok() && folder->Publish(service_).ok());
  const std::string old_key = ReadServiceFile(FileOf(Role::kWorker))->own.public_key;
  ASSERT_TRUE(folder->Revoke(old_key).ok());
  ASSERT_TRUE(folder->Publish(service_).ok());
  const std::string new_key = ReadServiceFile(FileOf(Role::kWorker))->own.public_key;
  EXPECT_NE(new_key, old_key);
  EXPECT_EQ(folder->KeysOf({Role::kWorker}), std::set<std::string>{new_key});
}

TEST_F(KeyFolderTest, IsForItsOwnerAlone) {
  ASSERT_TRUE(KeyFolder::Open(path()).ok());
  std::filesystem::permissions(path(), std::filesystem::perms(0750));
  const Status status = KeyFolder::Open(path()).status();
  EXPECT_EQ(status.code(), StatusCode::kUnavailable);
  EXPECT_THAT(status.message(), HasSubstr("must be a folder of this user alone (chmod 700)"));
}

TEST_F(KeyFolderTest, ADamagedFileIsToldAndNotReplaced) {
  ASSERT_TRUE(KeyFolder::Open(path()).ok());
  for (const std::string text : {"", "{}", "{\"server_secret_key\": \"abc\", \"admitted\": []}", "[1, 2"}) {
    ASSERT_TRUE(WritePrivateTextFile(path() + "/keys.json", text).ok());
    EXPECT_EQ(KeyFolder::Open(path()).status().code(), StatusCode::kInvalidArgument) << text;
    EXPECT_EQ(*ReadTextFile(path() + "/keys.json", 100), text);
  }
}

}  // namespace
}  // namespace slabstream
