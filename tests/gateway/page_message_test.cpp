#include "gateway/page_message.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "common/http/address.h"
#include "gateway/request_fields.h"

namespace slabstream {
namespace {

using testing::HasSubstr;

TEST(PageMessageTest, ViewsAcknowledgementsAndPongs) {
  const auto view =
      ParsePageMessage(R"({"type": "view", "seq": 17, "options": {"dataset": "head", "azimuth": 30, "clip-plane": ["1,0,0,5"]}})");
  ASSERT_TRUE(view.ok()) << view.status().message();
  const auto& message = std::get<ViewMessage>(*view);
  EXPECT_EQ(message.seq, 17U);
  EXPECT_EQ(message.kind, PagePicture::kRender);
  const auto job = MakePictureJob(message.kind, message.options);
  ASSERT_TRUE(job.ok()) << job.status().message();
  EXPECT_EQ(job->frames.front().view.azimuth_degrees, 30);
  EXPECT_EQ(job->frames.front().clipping.planes.size(), 1U);
  const auto ack = ParsePageMessage(R"({"frame": 5, "type": "ack"})");
  ASSERT_TRUE(ack.ok());
  EXPECT_EQ(std::get<AckMessage>(*ack).frame, 5U);
  const auto slow = ParsePageMessage(R"({"type": "ack", "frame": 6, "page_ms": 12.5})");
  ASSERT_TRUE(slow.ok());
  EXPECT_EQ(std::get<AckMessage>(*slow).in_page, std::chrono::microseconds(12500));
  const auto pong = ParsePageMessage(R"({"type": "pong", "ping": 7})");
  ASSERT_TRUE(pong.ok());
  EXPECT_EQ(std::get<PongMessage>(*pong).ping, 7U);
}

TEST(PageMessageTest, WrongFormIsRefusedInOneLine) {
  const std::string deep = std::string(5000, '[');
  for (const std::string& text :
       {std::string(), std::string("{}"), std::string("[]"), std::string("null"), std::string(R"({"type": "x"})"),
        std::string(R"({"type": "view"})"), std::string(R"({"type": "view", "seq": 0, "options": {}})"),
        std::string(R"({"type": "view", "seq": 1, "options": []})"), std::string(R"({"type": "view", "seq": 1, "options": {}, "more": 1})"),
        std::string(R"({"type": "view", "seq": 1e300, "options": {}})"), std::string(R"({"type": "ack"})"),
        std::string(R"({"type": "ack", "frame": -1})"), std::string(R"({"type": "ack", "frame": 1, "page_ms": -1})"),
        std::string(R"({"type": "pong"})"), deep}) {
    const auto message = ParsePageMessage(text);
    ASSERT_FALSE(message.ok()) << text;
    EXPECT_EQ(message.status().code(), StatusCode::kInvalidArgument);
    EXPECT_THAT(message.status().message(), testing::Not(HasSubstr("\n")));
  }
  EXPECT_FALSE(ParsePageMessage(std::string(kMaxPageMessageBytes + 1, ' ')).ok());
}

TEST(TargetTest, FieldsAreDecoded) {
  const auto target = ParseTarget("/api/v1/render.png?dataset=a%20b&title=1+%2B+1&fit&&light=1,0,0&light=0%2c1,0");
  ASSERT_TRUE(target.ok());
  EXPECT_EQ(target->path, "/api/v1/render.png");
  ASSERT_EQ(target->fields.size(), 5U);
  EXPECT_EQ(target->fields[0].text, "a b");
  EXPECT_EQ(target->fields[1].text, "1 + 1");
  EXPECT_EQ(target->fields[2].name, "fit");
  EXPECT_EQ(target->fields[4].text, "0,1,0");
  for (const char* wrong : {"", "x", "/?%", "/?a=%4", "/?a=%zz", "http://host/"}) EXPECT_FALSE(ParseTarget(wrong).ok()) << wrong;
  std::string many = "/?";
  for (std::size_t i = 0; i <= kMaxPictureFields; ++i) many += "a=b&";
  EXPECT_FALSE(ParseTarget(many).ok());
}

TEST(AddressTest, ListenAddresses) {
  const auto any = ParseListenAddress("--listen", "127.0.0.1");
  ASSERT_TRUE(any.ok());
  EXPECT_EQ(any->port, 0);
  EXPECT_TRUE(ParseListenAddress("--listen", "[::1]:80")->loopback);
  EXPECT_FALSE(ParseListenAddress("--listen", "0.0.0.0:80")->loopback);
  EXPECT_EQ(ParseListenAddress("--listen", "localhost:8080")->host, "127.0.0.1");
  for (const char* wrong : {"", ":80", "host.example:80", "127.0.0.1:x", "127.0.0.1:65536", "::1", "[::1", "1.2.3:5"}) {
    EXPECT_FALSE(ParseListenAddress("--listen", wrong).ok()) << wrong;
  }
}

TEST(AddressTest, OnlyOwnHostsAndOriginsMayAsk) {
  const ListenAddress loopback = *ParseListenAddress("--listen", "127.0.0.1:4000");
  const OriginRules rules(loopback, false, "");
  EXPECT_EQ(rules.Refusal("127.0.0.1:4000", std::nullopt), std::nullopt);
  EXPECT_EQ(rules.Refusal("localhost:9999", "http://localhost:9999"), std::nullopt);  // a tunnel's near end
  EXPECT_EQ(rules.Refusal("[::1]:4000", "http://[::1]:4000"), std::nullopt);
  EXPECT_NE(rules.Refusal("evil.example:4000", std::nullopt), std::nullopt);  // a name that was made to point here
  EXPECT_NE(rules.Refusal("", std::nullopt), std::nullopt);
  EXPECT_NE(rules.Refusal("localhost:4000", "http://evil.example"), std::nullopt);
  EXPECT_NE(rules.Refusal("localhost:4000", "https://localhost:4000"), std::nullopt);
  EXPECT_NE(rules.Refusal("localhost:4000", "http://localhost:4001"), std::nullopt);
  EXPECT_NE(rules.Refusal("localhost:4000", "null"), std::nullopt);
  const OriginRules proxied(loopback, false, *ParseOrigin("--behind-proxy", "https://Viewer.example.org"));
  EXPECT_EQ(proxied.Refusal("viewer.example.org", "https://viewer.example.org"), std::nullopt);
  EXPECT_EQ(proxied.Refusal("localhost:4000", "https://viewer.example.org"), std::nullopt);  // a proxy that changes Host
  EXPECT_NE(proxied.Refusal("viewer.example.org", "https://other.example.org"), std::nullopt);
  for (const char* any : {"0.0.0.0:4000", "[::]:4000"}) {
    const OriginRules everywhere(*ParseListenAddress("--listen", any), false, "");
    EXPECT_EQ(everywhere.Refusal("192.168.1.7:4000", "http://192.168.1.7:4000"), std::nullopt) << any;
    EXPECT_EQ(everywhere.Refusal("[fd00::7]:4000", std::nullopt), std::nullopt) << any;
    EXPECT_NE(everywhere.Refusal("evil.example:4000", std::nullopt), std::nullopt) << any;
    EXPECT_NE(everywhere.Refusal("192.168.1.7:4000", "http://192.168.1.8:4000"), std::nullopt) << any;
  }
  const OriginRules one(*ParseListenAddress("--listen", "192.168.1.7:4000"), false, "");
  EXPECT_NE(one.Refusal("192.168.1.8:4000", std::nullopt), std::nullopt);
  for (const char* wrong : {"", "viewer", "https://", "https://a/b", "ftp://a", "https://a b"}) {
    EXPECT_FALSE(ParseOrigin("--origin", wrong).ok()) << wrong;
  }
}

TEST(AddressTest, PagesOfNamedOriginsMayAsk) {
  std::vector<std::string> pages;
  for (const char* text : {"http://localhost:*", "https://Notebooks.example.org:443", "https://a.example:8443", "vscode-webview:"}) {
    pages.push_back(*ParsePageSource("--origin", text));
  }
  EXPECT_EQ(pages[1], "https://notebooks.example.org");  // as browsers write it
  const OriginRules rules({}, false, "", pages);
  for (const char* origin : {"http://localhost", "http://localhost:1", "http://LOCALHOST:65535", "https://notebooks.example.org",
                             "https://a.example:8443", "vscode-webview://0abc", "http://127.0.0.1:4000"}) {
    EXPECT_EQ(rules.Refusal("127.0.0.1:4000", origin), std::nullopt) << origin;
  }
  for (const char* origin :
       {"http://localhost.evil.example", "http://localhost:1.evil.example", "http://localhost:65536",
        "http://localhost:", "https://localhost", "http://notebooks.example.org", "https://notebooks.example.org.evil.example",
        "https://notebooks.example.org:8443", "https://a.example", "https://a.example:84430", "vscode-webview:evil",
        "vscode-webviews://0abc", "http://127.0.0.1:4001", "null", ""}) {
    EXPECT_NE(rules.Refusal("127.0.0.1:4000", origin), std::nullopt) << origin;
  }
  EXPECT_NE(rules.Refusal("notebooks.example.org", std::nullopt), std::nullopt) << "it is no name of this gateway";
  for (const char* wrong : {"*", "https:", "http:", "null", "https://*", "https://a:*:*", "https://a:*/", "https://a;b", ":*", ""}) {
    EXPECT_FALSE(ParsePageSource("--origin", wrong).ok()) << wrong;
  }
}

TEST(AddressTest, AProxyMayShowTheServerBelowAPath) {
  const auto parsed = [](const char* text) { return *ParseProxyAddress("--behind-proxy", text); };
  EXPECT_EQ(parsed("https://Viewer.example.org").origin, "https://viewer.example.org");
  EXPECT_EQ(parsed("https://viewer.example.org/").path, "");
  for (const char* text : {"http://a:8000/user/Anna%40b.org/proxy/7", "http://a:8000/user/Anna%40b.org/proxy/7/"}) {
    EXPECT_EQ(parsed(text).origin, "http://a:8000");
    EXPECT_EQ(parsed(text).path, "/user/Anna%40b.org/proxy/7");
  }
  for (const char* wrong :
       {"", "/render/", "viewer.example.org/render/", "https:///render/", "https://a/b?c", "https://a/b#c", "https://a/b c", "https://a//b",
        "https://a/../b", "https://a/./b", "https://a/b/..", "https://a/\r\nX: y", "https://u@a/b"}) {
    EXPECT_FALSE(ParseProxyAddress("--behind-proxy", wrong).ok()) << wrong;
  }
}

TEST(AddressTest, TokensAreRandomAndCompared) {
  const std::string a = *MakeToken(), b = *MakeToken();
  EXPECT_NE(a, b);
  EXPECT_TRUE(CheckToken(a).ok());
  EXPECT_FALSE(CheckToken("short").ok());
  EXPECT_FALSE(CheckToken("with a blank in the middle").ok());
  EXPECT_TRUE(SameToken(a, a));
  EXPECT_FALSE(SameToken(a, b));
  EXPECT_FALSE(SameToken("", a));
  EXPECT_FALSE(SameToken(a, ""));
  EXPECT_FALSE(SameToken(a + "x", a));
}

}  // namespace
}  // namespace slabstream
