// Names of servers that lead to other addresses the next time. The resolver of this program answers as a test says, and connections to any
// address of IPv4 arrive at this machine's own servers.
#include <arpa/inet.h>
#include <dlfcn.h>
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <netdb.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <cstring>
#include <future>
#include <map>
#include <mutex>
#include <string>
#include <string_view>
#include <vector>

#include "data/stores/http_transfers.h"
#include "data/stores/store.h"
#include "tests/data/stores/scripted_server.h"

namespace slabstream {
namespace {

using testing::AllOf;
using testing::HasSubstr;

constexpr std::string_view kHangs = "hangs.test";  // a name for which no name server answers

// What the resolver says next of a name: several addresses at a time. The last one stays.
class Names {
 public:
  static Names& Get() {
    static Names names;
    return names;
  }
  void Set(const std::string& name, std::vector<std::vector<std::string>> answers) {
    const std::lock_guard lock(mutex_);
    answers_[name] = std::move(answers);
  }
  std::vector<std::string> Next(const std::string& name) {
    const std::lock_guard lock(mutex_);
    const auto found = answers_.find(name);
    if (found == answers_.end()) return {};
    std::vector<std::string> next = found->second.front();
    if (found->second.size() > 1) found->second.erase(found->second.begin());
    return next;
  }
  void Hang() { end_.get_future().wait(); }
  void EndHanging() { end_.set_value(); }
  // Where a connection was to go.
  void Connected(int socket, const sockaddr_in& address) {
    const std::lock_guard lock(mutex_);
    connected_[socket] = address;
  }
  const sockaddr_in* PlaceOf(int socket) {
    const std::lock_guard lock(mutex_);
    const auto found = connected_.find(socket);
    return found == connected_.end() ? nullptr : &found->second;
  }

 private:
  std::mutex mutex_;
  std::map<std::string, std::vector<std::vector<std::string>>> answers_;
  std::map<int, sockaddr_in> connected_;
  std::promise<void> end_;
};

template <class Function>
Function* Real(const char* name) {
  return reinterpret_cast<Function*>(::dlsym(RTLD_NEXT, name));
}

}  // namespace
}  // namespace slabstream

// libcurl finds these before those of the C library.
extern "C" {
__attribute__((visibility("default"))) int getaddrinfo(const char* name, const char* service, const addrinfo* hints, addrinfo** result) {
  const auto real = slabstream::Real<decltype(getaddrinfo)>("getaddrinfo");
  if (name != nullptr && slabstream::kHangs == name) slabstream::Names::Get().Hang();
  const std::vector<std::string> addresses = slabstream::Names::Get().Next(name == nullptr ? "" : name);
  if (addresses.empty()) return real(name, service, hints, result);
  addrinfo** end = result;
  for (const std::string& address : addresses) {
    addrinfo numeric = *hints;
    numeric.ai_flags |= AI_NUMERICHOST;
    numeric.ai_family = AF_UNSPEC;
    if (const int failed = real(address.c_str(), service, &numeric, end); failed != 0) return failed;
    while (*end != nullptr) end = &(*end)->ai_next;
  }
  return 0;
}

__attribute__((visibility("default"))) int connect(int socket, const sockaddr* address, socklen_t size) {
  const auto real = slabstream::Real<decltype(connect)>("connect");
  if (address->sa_family != AF_INET) return real(socket, address, size);
  sockaddr_in to{};
  std::memcpy(&to, address, sizeof to);
  slabstream::Names::Get().Connected(socket, to);
  to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  return real(socket, reinterpret_cast<const sockaddr*>(&to), sizeof to);
}

__attribute__((visibility("default"))) int getpeername(int socket, sockaddr* address, socklen_t* size) {
  const int failed = slabstream::Real<decltype(getpeername)>("getpeername")(socket, address, size);
  const sockaddr_in* const place = slabstream::Names::Get().PlaceOf(socket);
  if (failed == 0 && place != nullptr && address->sa_family == AF_INET) std::memcpy(address, place, sizeof *place);
  return failed;
}
}

namespace slabstream {
namespace {

class MovedNames : public ::testing::Test {
 protected:
  static Result<std::string> Read(HttpTransfers& transfers, const std::string& url) {
    std::promise<Result<Bytes>> answer;
    HttpStore(url, transfers).value()->Read("object", {}, 1000, [&](Result<Bytes> bytes) { answer.set_value(std::move(bytes)); });
    const Result<Bytes> bytes = answer.get_future().get();
    if (!bytes.ok()) return bytes.status();
    return std::string(reinterpret_cast<const char*>(bytes->span().data()), bytes->size());
  }
  static std::string At(const std::string& name, const ScriptedServer& server) { return fmt::format("http://{}:{}", name, server.port()); }
  static ScriptedServer::Script Says(const std::string& text) {
    return [text](const ServerRequest&) { return AnswerText("200 OK", text, "Connection: close\r\n"); };
  }

  const HttpTransfers::Timing timing_ = {.first_pause = std::chrono::milliseconds(1)};
  HttpTransfers transfers_{timing_};
  const ScriptedServer one_{Says("one")}, other_{Says("other")};
};

TEST_F(MovedNames, ARedirectToTheSameNameDoesNotLeadInside) {
  const ScriptedServer leads(
      [&](const ServerRequest&) { return AnswerText("302 Found", "", fmt::format("Location: {}/x\r\n", At("leads.test", other_))); });
  Names::Get().Set("leads.test", {{"10.77.0.1"}, {"127.0.0.1"}});
  const Status refused = Read(transfers_, At("leads.test", leads)).status();
  EXPECT_EQ(refused.code(), StatusCode::kUnavailable);
  EXPECT_THAT(refused.message(), AllOf(HasSubstr("127.0.0.1, which is an address of this machine"),
                                       HasSubstr("10.77.0.1, which is an address of a private network")));
  EXPECT_TRUE(other_.requests().empty());
}

TEST_F(MovedNames, ANewConnectionDoesNotLeadInside) {
  int number = 0;
  for (const auto& [first, now] : std::vector<std::pair<std::string, std::string>>{{"10.77.0.1", "127.0.0.1"},
                                                                                   {"10.77.0.1", "192.168.1.1"},
                                                                                   {"10.77.0.1", "169.254.169.254"},
                                                                                   {"10.77.0.1", "0.0.0.0"},
                                                                                   {"10.77.0.1", "::1"},
                                                                                   {"10.77.0.1", "::ffff:127.0.0.1"},
                                                                                   {"10.77.0.1", "64:ff9b::7f00:1"},
                                                                                   {"8.8.8.8", "10.77.0.1"},
                                                                                   {"8.8.8.8", "fd12::1"},
                                                                                   {"8.8.8.8", "127.0.0.1"}}) {
    SCOPED_TRACE(first + " " + now);
    const std::string name = fmt::format("moves{}.test", ++number);
    Names::Get().Set(name, {{first}, {now}});
    EXPECT_EQ(Read(transfers_, At(name, one_)).value(), "one");
    const Status refused = Read(transfers_, At(name, other_)).status();
    EXPECT_EQ(refused.code(), StatusCode::kUnavailable);
    EXPECT_THAT(refused.message(), AllOf(HasSubstr(first), HasSubstr(now)));
  }
  EXPECT_TRUE(other_.requests().empty());
}

TEST_F(MovedNames, AServerMayHaveSeveralAddresses) {
  Names::Get().Set("several.test", {{"10.77.0.1"}, {"10.78.0.2"}});
  EXPECT_EQ(Read(transfers_, At("several.test", one_)).value(), "one");
  EXPECT_EQ(Read(transfers_, At("several.test", other_)).value(), "other");
  Names::Get().Set("public.test", {{"8.8.8.8"}, {"1.1.1.1"}});
  EXPECT_EQ(Read(transfers_, At("public.test", one_)).value(), "one");
  EXPECT_EQ(Read(transfers_, At("public.test", other_)).value(), "other");
  Names::Get().Set("mixed.test", {{"10.77.0.1"}, {"127.0.0.1", "10.78.0.2"}});
  EXPECT_EQ(Read(transfers_, At("mixed.test", one_)).value(), "one");
  EXPECT_EQ(Read(transfers_, At("mixed.test", other_)).value(), "other") << "the other address is asked";
}

TEST_F(MovedNames, ANameServerThatDoesNotAnswerHoldsUpItsOwnRequestsAlone) {
  HttpTransfers impatient({.first_pause = std::chrono::milliseconds(1), .connecting = std::chrono::milliseconds(50), .tries = 1});
  EXPECT_EQ(Read(impatient, At(std::string(kHangs), one_)).status().code(), StatusCode::kUnavailable);
  EXPECT_EQ(Read(impatient, At("127.0.0.1", one_)).value(), "one");
  Names::Get().EndHanging();
}

TEST_F(MovedNames, AnAddressThatWasNamedIsAskedAgain) {
  for (const std::string address : {"127.0.0.1", "0.0.0.0", "10.77.0.1", "169.254.1.5"}) {
    EXPECT_EQ(Read(transfers_, At(address, one_)).value(), "one") << address;
    EXPECT_EQ(Read(transfers_, At(address, other_)).value(), "other") << address;
  }
  EXPECT_EQ(Read(transfers_, At("localhost", one_)).value(), "one");
  EXPECT_EQ(Read(transfers_, At("localhost", other_)).value(), "other");
}

}  // namespace
}  // namespace slabstream
