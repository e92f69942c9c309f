// Where objects of buckets are, whose credentials sign requests, and whether a server would take the signatures.
#include "data/stores/s3.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <openssl/evp.h>
#include <openssl/hmac.h>

#include <cstdlib>
#include <filesystem>
#include <future>

#include "common/files/files.h"
#include "data/stores/http_transfers.h"
#include "data/stores/store.h"
#include "data/stores/transfer.h"
#include "tests/data/stores/scripted_server.h"
#include "tests/support/temporary_directory.h"

namespace slabstream {
namespace {

using testing::HasSubstr;

constexpr char kSecret[] = "secret/of+nobody";

class S3Test : public testing::Test {
 protected:
  // Nothing of the machine's is seen.
  S3Test() {
    for (const char* name : {"AWS_ENDPOINT_URL", "AWS_REGION", "AWS_DEFAULT_REGION", "AWS_ACCESS_KEY_ID", "AWS_SECRET_ACCESS_KEY",
                             "AWS_SESSION_TOKEN", "AWS_PROFILE", "AWS_NO_SIGN_REQUEST", "AWS_SHARED_CREDENTIALS_FILE", "AWS_CONFIG_FILE"}) {
      ::unsetenv(name);
    }
    Set("HOME", home_.path());
  }
  static void Set(const char* name, const std::string& value) { ::setenv(name, value.c_str(), 1); }

  const TemporaryDirectory home_;
};

TEST_F(S3Test, BucketsAreAmazonsOrThoseOfAnEndpoint) {
  const auto url = [](const std::string& address) { return FindS3Place(address).value().url; };
  EXPECT_EQ(url("s3://bucket/a/b.zarr"), "https://bucket.s3.us-east-1.amazonaws.com/a/b.zarr");
  EXPECT_EQ(url("s3://bucket/my scan+\u00fc?.zarr"), "https://bucket.s3.us-east-1.amazonaws.com/my%20scan%2B%C3%BC%3F.zarr");
  EXPECT_EQ(url("s3://bu.cket/a"), "https://s3.us-east-1.amazonaws.com/bu.cket/a");
  EXPECT_EQ(url("s3://bucket/em?endpoint=http://127.0.0.1:9000/"), "http://127.0.0.1:9000/bucket/em");
  Set("AWS_REGION", "eu-west-3");
  EXPECT_EQ(url("s3://bucket"), "https://bucket.s3.eu-west-3.amazonaws.com");
  Set("AWS_ENDPOINT_URL", "https://host");
  EXPECT_EQ(url("s3://bucket/em"), "https://host/bucket/em");
  for (const char* wrong : {"s3://", "s3:///em", "s3://bu@cket/em", "s3://bucket/em?endpoint=ftp://host", "http://bucket/em"}) {
    EXPECT_EQ(FindS3Place(wrong).status().code(), StatusCode::kInvalidArgument) << wrong;
  }
}

TEST_F(S3Test, CredentialsAreThoseOfTheEnvironmentOrOfAFile) {
  const auto key = [] {
    const Result<S3Place> place = FindS3Place("s3://bucket/em");
    return !place.ok() ? "wrong" : place->access ? place->access->key : "anonymous";
  };
  EXPECT_EQ(key(), "anonymous");
  ASSERT_TRUE(std::filesystem::create_directory(home_ / ".aws"));
  ASSERT_TRUE(WriteTextFile(home_ / ".aws/credentials",
                            "# of nobody\n[default]\naws_access_key_id = FILE\naws_secret_access_key=s\n\n"
                            "[other]\naws_access_key_id=OTHER\naws_secret_access_key=t\n[half]\naws_access_key_id=HALF\n")
                  .ok());
  ASSERT_TRUE(WriteTextFile(home_ / ".aws/config", "[default]\nregion = here\n[profile other]\nregion=there\n").ok());
  EXPECT_EQ(key(), "FILE");
  EXPECT_EQ(FindS3Place("s3://bucket/em")->access->region, "here");
  Set("AWS_PROFILE", "other");
  EXPECT_EQ(key(), "OTHER");
  EXPECT_EQ(FindS3Place("s3://bucket/em")->access->region, "there");
  Set("AWS_PROFILE", "half");
  EXPECT_EQ(key(), "wrong");
  Set("AWS_ACCESS_KEY_ID", "ENVIRONMENT");
  const Status half = FindS3Place("s3://bucket/em").status();
  EXPECT_THAT(half.message(), HasSubstr("AWS_ACCESS_KEY_ID and AWS_SECRET_ACCESS_KEY"));
  Set("AWS_SECRET_ACCESS_KEY", kSecret);
  EXPECT_EQ(key(), "ENVIRONMENT");
  Set("AWS_NO_SIGN_REQUEST", "true");
  EXPECT_EQ(key(), "anonymous");
}

// ---- signatures

std::string Hex(const std::string& bytes) {
  std::string text;
  for (const char c : bytes) text += fmt::format("{:02x}", static_cast<unsigned char>(c));
  return text;
}
std::string Hmac(const std::string& key, const std::string& text) {
  std::string digest(32, 0);
  unsigned size = 32;
  ::HMAC(::EVP_sha256(), key.data(), int(key.size()), reinterpret_cast<const unsigned char*>(text.data()), text.size(),
         reinterpret_cast<unsigned char*>(digest.data()), &size);
  return digest;
}
std::string Sha256(const std::string& text) {
  std::string digest(32, 0);
  unsigned size = 32;
  ::EVP_Digest(text.data(), text.size(), reinterpret_cast<unsigned char*>(digest.data()), &size, ::EVP_sha256(), nullptr);
  return digest;
}
std::string Between(const std::string& text, const std::string& before, const std::string& after) {
  const std::size_t begin = text.find(before) + before.size();
  return text.substr(begin, text.find(after, begin) - begin);
}

// As "Authenticating Requests (AWS Signature Version 4)" of the S3 reference says, for requests without a query.
bool IsSigned(const ServerRequest& request, const std::string& secret) {
  const std::string authorization = request.header("authorization"), scope = Between(authorization, "Credential=", ",");
  const std::string day = Between(scope, "/", "/"), region = Between(scope, day + "/", "/"),
                    names = Between(authorization, "SignedHeaders=", ",");
  std::string headers;
  for (std::size_t begin = 0; begin < names.size();) {
    const std::size_t end = std::min(names.find(';', begin), names.size());
    const std::string name = names.substr(begin, end - begin);
    headers += name + ":" + request.header(name) + "\n";
    begin = end + 1;
  }
  const std::string canonical =
      request.method + "\n" + request.target + "\n\n" + headers + "\n" + names + "\n" + request.header("x-amz-content-sha256");
  const std::string text =
      "AWS4-HMAC-SHA256\n" + request.header("x-amz-date") + "\n" + scope.substr(scope.find('/') + 1) + "\n" + Hex(Sha256(canonical));
  const std::string key = Hmac(Hmac(Hmac(Hmac("AWS4" + secret, day), region), "s3"), "aws4_request");
  return names.find("host") != std::string::npos && Hex(Hmac(key, text)) == Between(authorization + "\n", "Signature=", "\n");
}

TEST_F(S3Test, RequestsAreSignedForThisServerAlone) {
  const ScriptedServer other([](const ServerRequest& request) {
    return request.header("authorization").empty() ? AnswerText("200 OK", "elsewhere") : AnswerText("400 x", "");
  });
  const ScriptedServer server([&](const ServerRequest& request) {
    if (request.target.ends_with("/away")) {
      return AnswerText("307 x", "", fmt::format("Location: http://localhost:{}/x\r\n", other.port()));
    }
    if (!IsSigned(request, kSecret) || request.header("x-amz-security-token") != "token") return AnswerText("403 Forbidden", "");
    const std::string range = request.header("range");
    return range.empty() ? AnswerText("200 OK", "0123456789") : AnswerText("206 x", "234", "Content-Range: bytes 2-4/10\r\n");
  });
  Set("AWS_ACCESS_KEY_ID", "KEY");
  Set("AWS_SESSION_TOKEN", "token");
  HttpTransfers transfers({});
  const auto read = [&](const std::string& key, const ByteRange& range = {}) {
    const std::shared_ptr<Store> store = HttpStore("s3://bucket/e m?endpoint=" + server.url(), transfers).value();
    std::promise<Result<Bytes>> answer;
    store->Read(key, range, 100, [&](Result<Bytes> bytes) { answer.set_value(std::move(bytes)); });
    const Result<Bytes> bytes = answer.get_future().get();
    return bytes.ok() ? std::string(reinterpret_cast<const char*>(bytes->span().data()), bytes->size()) : bytes.status().message();
  };
  Set("AWS_SECRET_ACCESS_KEY", kSecret);
  EXPECT_EQ(read("0/c/1/2"), "0123456789");
  EXPECT_EQ(read(".zattrs", {2, 3}), "234");
  EXPECT_EQ(read("a+b c/\u00fc~"), "0123456789");
  Set("AWS_SECRET_ACCESS_KEY", "another");
  const std::string refused = read("0/c/1/2");
  EXPECT_THAT(refused, HasSubstr("HTTP 403"));
  EXPECT_THAT(refused, testing::Not(HasSubstr("another"))) << "nothing secret in messages";
  EXPECT_EQ(read("away"), "elsewhere") << "where a redirect leads, nobody gets a signature";
}

// A bucket is asked in the region that its server names, from then on.
TEST_F(S3Test, BucketsMayBeInAnotherRegion) {
  Set("AWS_ACCESS_KEY_ID", "KEY");
  Set("AWS_SECRET_ACCESS_KEY", kSecret);
  const std::string malformed = "<Error><Code>AuthorizationHeaderMalformed</Code><Region>eu-central-1</Region></Error>";
  const std::string answers[] = {AnswerText("301 x", "", "x-amz-bucket-region: eu-central-1\r\n"),
                                 AnswerText("403 x", "", "x-amz-bucket-region: eu-central-1\r\n"), AnswerText("400 x", malformed)};
  for (const std::string& answer : answers) {
    const ScriptedServer server([&](const ServerRequest& request) {
      const bool is_there = request.header("authorization").find("/eu-central-1/s3/") != std::string::npos;
      return !is_there ? answer : AnswerText(IsSigned(request, kSecret) ? "200 OK" : "403 x", "ten");
    });
    HttpTransfers transfers({});
    const std::shared_ptr<Store> store = HttpStore("s3://bucket/em?endpoint=" + server.url(), transfers).value();
    for (const char* key : {"a", "b", "c"}) EXPECT_TRUE(ReadNow(*store, key).ok()) << answer;
    EXPECT_EQ(server.requests().size(), 4U) << "it is told once";
  }
  const ScriptedServer nowhere([&](const ServerRequest&) { return answers[0]; });
  HttpTransfers transfers({});
  const Status status = ReadNow(**HttpStore("s3://bucket/em?endpoint=" + nowhere.url(), transfers), "a").status();
  EXPECT_THAT(status.message(), HasSubstr("the bucket is in the region 'eu-central-1'"));
}

TEST_F(S3Test, RegionsAreInTheNamesOfAmazon) {
  const std::pair<const char*, const char*> cases[] = {
      {"https://bucket.s3.us-east-1.amazonaws.com/a", "https://bucket.s3.eu-west-3.amazonaws.com/a"},
      {"https://my.bucket.s3.amazonaws.com/a", "https://my.bucket.s3.eu-west-3.amazonaws.com/a"},
      {"https://s3.amazonaws.com/bucket/a", "https://s3.eu-west-3.amazonaws.com/bucket/a"},
      {"https://s3-us-west-2.amazonaws.com/bucket/a", "https://s3.eu-west-3.amazonaws.com/bucket/a"},
      {"https://amazonaws.com/a", "https://amazonaws.com/a"},
      {"https://ec2.us-east-1.amazonaws.com/a", "https://ec2.us-east-1.amazonaws.com/a"},
      {"https://s3.amazonaws.com.example.org/a", "https://s3.amazonaws.com.example.org/a"},
      {"http://127.0.0.1:9000/bucket", "http://127.0.0.1:9000/bucket"},
  };
  for (const auto& [url, there] : cases) EXPECT_EQ(InRegion(url, "eu-west-3"), there);
}

}  // namespace
}  // namespace slabstream
