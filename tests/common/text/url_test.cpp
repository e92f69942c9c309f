// Addresses in texts, and what of them nobody may see.
#include "common/text/url.h"

#include <gtest/gtest.h>

namespace slabstream {
namespace {

TEST(Url, HasAScheme) {
  EXPECT_EQ(SchemeOf("https://host"), "https");
  EXPECT_EQ(SchemeOf("s3+http://host"), "s3+http");
  for (const char* path : {"", "scan.nii", "/data/a://b", "://x", "3d://x", "a b://x", "scan?header=Referer:https://x"}) {
    EXPECT_EQ(SchemeOf(path), "") << path;
  }
}

TEST(Url, IsEncodedAndDecoded) {
  EXPECT_EQ(EncodedPath("a b/\u00fc%?#+~"), "a%20b/%C3%BC%25%3F%23%2B~");
  EXPECT_EQ(EncodedUrl("host/a b%20\u00fc?x=<1>&y=a+b"), "host/a%20b%20%C3%BC?x=%3C1%3E&y=a+b");
  EXPECT_EQ(DecodedPath("/a%20b%2fc%C3%bc"), "/a b/c\u00fc");
  EXPECT_EQ(DecodedPath("100%, 5%2, %zz%"), "100%, 5%2, %zz%");
}

TEST(Url, SecretsAreNotShown) {
  const std::pair<const char*, const char*> cases[] = {
      {"no address? x=1", "no address? x=1"},
      {"https://host/x.zarr: HTTP 403", "https://host/x.zarr: HTTP 403"},
      {"https://name:secret@host/x@y: wrong", "https://...@host/x@y: wrong"},
      {"https://host/x.zarr?sv=1&sig=secret: HTTP 403", "https://host/x.zarr?...: HTTP 403"},
      {"'https://host/x?sig=secret': no, 'http://a@b/y?token=secret'.", "'https://host/x?...': no, 'http://...@b/y?...'."},
      {"s3://b/x?endpoint=http://127.0.0.1:9000,header=A:secret", "s3://b/x?endpoint=http://127.0.0.1:9000,..."},
      {"s3://b/x?endpoint=http://me:secret@host", "s3://b/x?endpoint=http://...@host"},
      {"a=https://host/x?sig=secret,labels=https://host/y?sig=secret", "a=https://host/x?..."},
      {"https://host?: nothing", "https://host?: nothing"},
  };
  for (const auto& [text, shown] : cases) EXPECT_EQ(Redacted(text), shown);
}

}  // namespace
}  // namespace slabstream
