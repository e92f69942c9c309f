// Service files: what is written is read, nobody else can read it, and every mistake is one line that names path and field.
#include "common/service/service_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <filesystem>
#include <string>

#include "common/files/files.h"
#include "tests/support/temporary_directory.h"

namespace slabstream {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

class ServiceFileTest : public testing::Test {
 protected:
  std::string path() const { return directory_ / "client.json"; }
  void Replace(const std::string& what, const std::string& with) {
    std::string text = ReadTextFile(path(), 1 << 16).value();
    const std::size_t at = text.find(what);
    ASSERT_NE(at, std::string::npos) << what;
    ASSERT_TRUE(WritePrivateTextFile(path(), text.replace(at, what.size(), with)).ok());
  }

  TemporaryDirectory directory_{"/tmp"};
  const ServiceFile file_ = {Role::kWorker, "tcp://10.0.0.1:7421", MakeKeyPair().public_key, MakeKeyPair(), 7, 1, "2026-11-21T10:00:00Z"};
};

TEST_F(ServiceFileTest, IsReadAsItWasWrittenByItsOwnerAlone) {
  ASSERT_TRUE(WriteServiceFile(path(), file_).ok());
  const Result<ServiceFile> read = ReadServiceFile(path());
  ASSERT_TRUE(read.ok()) << read.status().message();
  EXPECT_EQ(*read, file_);
  struct stat info {};
  ASSERT_EQ(::stat(path().c_str(), &info), 0);
  EXPECT_EQ(info.st_mode & 0777, 0600U);
}

TEST_F(ServiceFileTest, MistakesAreNamedAndSecretsAreNot) {
  EXPECT_EQ(ReadServiceFile(path()).status().code(), StatusCode::kNotFound);
  const struct {
    std::string what, with, says;
  } cases[] = {
      {"\"worker\"", "\"boss\"", "role is not client, worker, admin or owner"},
      {"tcp://10.0.0.1:7421", "tcp://10.0.0.1", "endpoint endpoint \"tcp://10.0.0.1\": no port"},
      {"\"server_key\"", "\"server\"", "server_key is missing or no text"},
      {file_.own.public_key, "abc", "public_key is no key"},
      {file_.own.public_key, file_.server_key, "secret_key does not belong to public_key"},
      {"\"epoch\": 7", "\"epoch\": -7", "epoch is missing or no whole number in [0, 18446744073709551615]"},
      {"\"wire_version\": 1", "\"wire_version\": 4294967297", "wire_version is missing or no whole number in [0, 4294967295]"},
      {"{", "[", "is not one JSON object"},
  };
  for (const auto& [what, with, says] : cases) {
    ASSERT_TRUE(WriteServiceFile(path(), file_).ok());
    Replace(what, with);
    const Status status = ReadServiceFile(path()).status();
    EXPECT_EQ(status.code(), StatusCode::kInvalidArgument) << what;
    EXPECT_THAT(status.message(), AllOf(HasSubstr(path()), HasSubstr(says), Not(HasSubstr("\n")), Not(HasSubstr(file_.own.secret_key))));
  }
}

TEST_F(ServiceFileTest, IsRefusedIfOthersCanUseIt) {
  ASSERT_TRUE(WriteServiceFile(path(), file_).ok());
  for (const unsigned mode : {0640U, 0604U, 0620U, 0602U}) {
    std::filesystem::permissions(path(), std::filesystem::perms(mode));
    const Status status = ReadServiceFile(path()).status();
    EXPECT_EQ(status.code(), StatusCode::kInvalidArgument);
    EXPECT_THAT(status.message(), HasSubstr("others can use '" + path() + "', which holds a secret (chmod 600)"));
  }
}

}  // namespace
}  // namespace slabstream
