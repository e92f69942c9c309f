// Endpoints: what is accepted, as what, and the one line for each that is refused.
#include "common/transport/endpoint.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace slabstream {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

TEST(Endpoint, AcceptsLoopbackIpcAndInproc) {
  const struct {
    std::string text, shown;
  } cases[] = {
      {"tcp://127.0.0.1:7420", "tcp://127.0.0.1:7420"},
      {"tcp://127.1.2.3:1", "tcp://127.1.2.3:1"},
      {"tcp://localhost:65535", "tcp://127.0.0.1:65535"},
      {"tcp://[::1]:80", "tcp://[::1]:80"},
      {"tcp://127.0.0.1:*", "tcp://127.0.0.1:*"},
      {"ipc:///tmp/a b", ""},  // a space: refused below
      {"ipc:///tmp/slabstream.sock", "ipc:///tmp/slabstream.sock"},
      {"ipc:///tmp/caf\xC3\xA9", "ipc:///tmp/caf\xC3\xA9"},
      {"ipc:///" + std::string(106, 'x'), "ipc:///" + std::string(106, 'x')},
      {"inproc://service-1", "inproc://service-1"},
  };
  for (const auto& [text, shown] : cases) {
    const Result<Endpoint> endpoint = ParseEndpoint(text, true);
    ASSERT_EQ(endpoint.ok(), !shown.empty()) << text;
    if (!endpoint.ok()) continue;
    EXPECT_EQ(endpoint->ToString(), shown);
    const Result<Endpoint> again = ParseEndpoint(shown, true);
    ASSERT_TRUE(again.ok()) << shown;
    EXPECT_EQ(again->ToString(), shown);
  }
}

TEST(Endpoint, BindingTakesNoNames) {
  EXPECT_TRUE(ParseEndpoint("tcp://node7:7420", false).ok());
  EXPECT_THAT(ParseEndpoint("tcp://node7:7420", true).status().message(), HasSubstr("host \"node7\" is not the address of one host"));
}

TEST(Endpoint, TellsWhatLeavesThisMachine) {
  for (const char* text : {"tcp://127.0.0.1:1", "tcp://localhost:1", "tcp://[::1]:1", "ipc:///tmp/a", "inproc://a"}) {
    const Result<Endpoint> endpoint = ParseEndpoint(text, false);
    ASSERT_TRUE(endpoint.ok()) << text;
    EXPECT_FALSE(endpoint->remote()) << text;
  }
  for (const char* text : {"tcp://8.8.8.8:1", "tcp://128.0.0.1:1", "tcp://[fe80::1]:1", "tcp://node7:1", "tcp://localhost.example.org:1",
                           "tcp://127.0.0.1.example.org:1"}) {
    const Result<Endpoint> endpoint = ParseEndpoint(text, false);
    ASSERT_TRUE(endpoint.ok()) << text;
    EXPECT_TRUE(endpoint->remote()) << text;
    EXPECT_EQ(endpoint->ToString(), text);
  }
  for (const char* text : {"tcp://127.1:1", "tcp://-a:1", "tcp://a..b:1", "tcp://a_b:1", "tcp://node7.:1", "tcp://10.0.0.256:1"})
    EXPECT_FALSE(ParseEndpoint(text, false).ok()) << text;
}

TEST(Endpoint, RefusesWithOneLineThatNamesTextAndReason) {
  const struct {
    std::string text, reason;
  } cases[] = {
      {"", "expected tcp://HOST:PORT"},
      {"127.0.0.1:7420", "expected tcp://HOST:PORT"},
      {"udp://127.0.0.1:7420", "expected tcp://HOST:PORT"},
      {"tcp://0.0.0.0:7420", "host \"0.0.0.0\" is not the address or the name of one host"},
      {"tcp://*:7420", "host \"*\" is not the address or the name of one host"},
      {"tcp://[::]:7420", "is not the address or the name of one host"},
      {"tcp://[::ffff:127.0.0.1]:7420", "is not the address or the name of one host"},
      {"tcp://[fe80::1:7420", "is not the address or the name of one host"},
      {"tcp://127.1:7420", "is not the address or the name of one host"},  // short forms are read in more than one way
      {"tcp://0177.0.0.1:7420", "is not the address or the name of one host"},
      {"tcp://eth0;127.0.0.1:7420", "is not the address or the name of one host"},
      {"tcp://:7420", "is not the address or the name of one host"},
      {"tcp://127.0.0.1", "no port"},
      {"tcp://127.0.0.1:", "port \"\" is not a number of [1, 65535]"},
      {"tcp://127.0.0.1:65536", "port \"65536\""},
      {"tcp://127.0.0.1:-1", "port \"-1\""},
      {"tcp://127.0.0.1:+80", "port \"+80\""},
      {"tcp://127.0.0.1:80x", "port \"80x\""},
      {"tcp://127.0.0.1:99999999999999999999", "port \"99999999999999999999\""},
      {"tcp://127.0.0.1:*", "port \"*\" is not a number of [1, 65535]"},
      {"ipc://", "expected an absolute path"},
      {"ipc://relative.sock", "expected an absolute path"},
      {"ipc://@abstract", "expected an absolute path"},
      {"ipc://*", "expected an absolute path"},
      {"ipc:///tmp/", "expected an absolute path"},
      {"ipc:///" + std::string(107, 'x'), "a path of 108 bytes, at most 107"},
      {"ipc:///tmp/a b", "spaces and control characters"},
      {"inproc://", "no name"},
      {"inproc://a\nb", "spaces and control characters"},
      {std::string("inproc://a\0b", 12), "spaces and control characters"},
      {"inproc://" + std::string(504, 'x'), "513 bytes, at most 512"},
  };
  for (const auto& [text, reason] : cases) {
    const Result<Endpoint> endpoint = ParseEndpoint(text, false);
    ASSERT_FALSE(endpoint.ok()) << text;
    EXPECT_EQ(endpoint.status().code(), StatusCode::kInvalidArgument) << text;
    EXPECT_THAT(endpoint.status().message(), AllOf(HasSubstr("endpoint \""), HasSubstr(reason), Not(HasSubstr("\n"))));
    EXPECT_LT(endpoint.status().message().size(), 400U) << text;
  }
}

TEST(Endpoint, WorkersListenBesideTheClients) {
  const struct {
    std::string client, worker;
  } cases[] = {
      {"tcp://127.0.0.1:7420", "tcp://127.0.0.1:7421"},
      {"tcp://127.0.0.1:65535", "tcp://127.0.0.1:65534"},
      {"tcp://[::1]:*", "tcp://[::1]:*"},
      {"ipc:///run/slabstream", "ipc:///run/slabstream.workers"},
      {"inproc://service", "inproc://service.workers"},
  };
  for (const auto& [client, worker] : cases) {
    const Result<Endpoint> endpoint = ParseEndpoint(client, true);
    ASSERT_TRUE(endpoint.ok());
    EXPECT_EQ(WorkerEndpointFor(*endpoint).ToString(), worker);
  }
}

}  // namespace
}  // namespace slabstream
