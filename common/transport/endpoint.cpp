#include "common/transport/endpoint.h"

#include <arpa/inet.h>
#include <netdb.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <filesystem>
#include <memory>
#include <optional>
#include <system_error>
#include <utility>

#include "common/transport/ipc_listener.h"

namespace slabstream {
namespace {

constexpr std::size_t kMaxTextBytes = 512;
constexpr std::size_t kMaxIpcPathBytes = sizeof(sockaddr_un::sun_path) - 1;  // 107: without the closing zero
constexpr int kMaxPort = 65535;
constexpr std::string_view kShapes = "tcp://HOST:PORT, ipc:///PATH or inproc://NAME";

bool Printable(std::string_view text) {
  return std::all_of(text.begin(), text.end(), [](char c) { return static_cast<unsigned char>(c) > ' ' && c != '\x7f'; });
}

// The text for messages: bounded, and without bytes that would break the line.
std::string Quoted(std::string_view text) {
  std::string quoted = "endpoint \"";
  for (const char c : text.substr(0, 128)) quoted += static_cast<unsigned char>(c) < ' ' || c == '\x7f' ? '?' : c;
  return quoted + (text.size() > 128 ? "...\"" : "\"");
}

Status Refused(std::string_view text, const std::string& why) { return Status::InvalidArgument(Quoted(text) + ": " + why); }

// Host as ZeroMQ takes it, if it is loopback. "localhost" is fixed to 127.0.0.1, because binding takes no names.
std::optional<std::string> LoopbackHost(std::string_view host) {
  if (host == "localhost") return "127.0.0.1";
  if (host == "[::1]") return "[::1]";
  in_addr address{};
  const std::string text(host);
  if (inet_pton(AF_INET, text.c_str(), &address) == 1 && ntohl(address.s_addr) >> 24 == 127) return text;
  return std::nullopt;
}

// An IPv4 or IPv6 address of one host, as it is written in endpoints.
bool IsAddress(std::string_view host) {
  in_addr four{};
  if (inet_pton(AF_INET, std::string(host).c_str(), &four) == 1) return four.s_addr != htonl(INADDR_ANY);
  if (!host.starts_with('[') || !host.ends_with(']')) return false;
  in6_addr six{};
  const std::string inner(host.substr(1, host.size() - 2));
  return inet_pton(AF_INET6, inner.c_str(), &six) == 1 && !IN6_IS_ADDR_UNSPECIFIED(&six) && !IN6_IS_ADDR_V4MAPPED(&six) &&
         !IN6_IS_ADDR_LOOPBACK(&six);
}

// A host name (RFC 1123) that cannot be mistaken for an address.
bool IsName(std::string_view host) {
  constexpr std::size_t kMaxName = 253, kMaxLabel = 63;
  if (host.empty() || host.size() > kMaxName) return false;
  std::string_view label;
  for (std::size_t begin = 0; begin <= host.size(); begin += label.size() + 1) {
    label = host.substr(begin, host.find('.', begin) - begin);
    if (label.empty() || label.size() > kMaxLabel || label.front() == '-' || label.back() == '-') return false;
    const bool plain = std::ranges::all_of(label, [](unsigned char c) { return c < 0x80 && (std::isalnum(c) != 0 || c == '-'); });
    if (!plain) return false;
  }
  return std::ranges::any_of(label, [](unsigned char c) { return std::isalpha(c) != 0; });  // the last one
}

Result<Endpoint> ParseTcp(std::string_view text, std::string_view rest, bool to_bind) {
  const std::size_t colon = rest.rfind(':');
  if (colon == std::string_view::npos) return Refused(text, "no port, expected tcp://HOST:PORT");
  const std::string_view host = rest.substr(0, colon), port = rest.substr(colon + 1);
  Endpoint endpoint;
  if (std::optional<std::string> loopback = LoopbackHost(host)) {
    endpoint.host = *std::move(loopback);
  } else if (IsAddress(host) || (!to_bind && IsName(host))) {
    endpoint.host = host;
  } else {
    return Refused(text, "host \"" + std::string(host.substr(0, 128)) + "\" is not " +
                             (to_bind ? "the address of one host" : "the address or the name of one host"));
  }
  if (to_bind && (port == "*" || port == "0")) return endpoint;
  const auto [end, error] = std::from_chars(port.data(), port.data() + port.size(), endpoint.port);
  if (error != std::errc() || end != port.data() + port.size() || endpoint.port < 1 || endpoint.port > kMaxPort) {
    return Refused(text, "port \"" + std::string(port.substr(0, 128)) + "\" is not a number of [1, 65535]" + (to_bind ? " or *" : ""));
  }
  return endpoint;
}

Result<Endpoint> ParseIpc(std::string_view text, std::string_view path) {
  if (path.size() < 2 || path.front() != '/' || path.back() == '/')
    return Refused(text, "expected an absolute path of a socket file, ipc:///PATH");
  if (path.size() > kMaxIpcPathBytes) {
    return Refused(
        text, "a path of " + std::to_string(path.size()) + " bytes, at most " + std::to_string(kMaxIpcPathBytes) + " fit a socket address");
  }
  return Endpoint{Scheme::kIpc, {}, 0, std::string(path)};
}

}  // namespace

bool Endpoint::remote() const { return scheme == Scheme::kTcp && !LoopbackHost(host); }

std::string Endpoint::ToString() const {
  switch (scheme) {
    case Scheme::kTcp: return "tcp://" + host + ":" + (port == 0 ? "*" : std::to_string(port));
    case Scheme::kIpc: return "ipc://" + path;
    case Scheme::kInproc: break;
  }
  return "inproc://" + path;
}

Result<Endpoint> ParseEndpoint(std::string_view text, bool to_bind) {
  if (text.size() > kMaxTextBytes) return Refused(text, std::to_string(text.size()) + " bytes, at most " + std::to_string(kMaxTextBytes));
  if (!Printable(text)) return Refused(text, "spaces and control characters are not allowed, expected " + std::string(kShapes));
  if (text.starts_with("tcp://")) return ParseTcp(text, text.substr(6), to_bind);
  if (text.starts_with("ipc://")) return ParseIpc(text, text.substr(6));
  if (text.starts_with("inproc://")) {
    if (text.size() == 9) return Refused(text, "no name, expected inproc://NAME");
    return Endpoint{Scheme::kInproc, {}, 0, std::string(text.substr(9))};
  }
  return Refused(text, "expected " + std::string(kShapes));
}

void RemoveDeadSockets(const Endpoint& prefix) {
  if (prefix.scheme != Scheme::kIpc) return;
  const std::filesystem::path begin(prefix.path);
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(begin.parent_path(), error)) {
    const bool ours = entry.path().filename().string().starts_with(begin.filename().string());
    if (ours && entry.is_socket(error) && entry.path().string().size() <= kMaxIpcPathBytes)
      (void)IpcListener::RemoveStale(entry.path());  // somebody listens: it stays
  }
}

Result<std::string> LocalHostTowards(const Endpoint& endpoint) {
  const auto unavailable = [&](const std::string& why) { return Status::Unavailable("endpoint \"" + endpoint.ToString() + "\": " + why); };
  const bool bracketed = endpoint.host.starts_with('[');
  const std::string host = bracketed ? endpoint.host.substr(1, endpoint.host.size() - 2) : endpoint.host;
  const addrinfo wanted = {.ai_flags = AI_NUMERICSERV, .ai_family = bracketed ? AF_INET6 : AF_INET, .ai_socktype = SOCK_DGRAM};
  addrinfo* found = nullptr;
  if (const int error = ::getaddrinfo(host.c_str(), std::to_string(endpoint.port).c_str(), &wanted, &found); error != 0)
    return unavailable(::gai_strerror(error));
  const std::unique_ptr<addrinfo, decltype(&::freeaddrinfo)> addresses(found, ::freeaddrinfo);
  // Connecting a datagram socket only chooses the way.
  const int descriptor = ::socket(found->ai_family, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  const bool connected = descriptor >= 0 && ::connect(descriptor, found->ai_addr, found->ai_addrlen) == 0;
  const int error = errno;
  std::string address = connected ? LocalHostOf(descriptor) : "";
  if (descriptor >= 0) ::close(descriptor);
  if (address.empty()) return unavailable(std::strerror(error));
  return address;
}

std::string LocalHostOf(int descriptor) {
  sockaddr_storage own{};
  socklen_t bytes = sizeof(own);
  std::array<char, INET6_ADDRSTRLEN> text{};
  if (::getsockname(descriptor, reinterpret_cast<sockaddr*>(&own), &bytes) != 0 ||
      ::getnameinfo(reinterpret_cast<sockaddr*>(&own), bytes, text.data(), text.size(), nullptr, 0, NI_NUMERICHOST) != 0) {
    return "";
  }
  const std::string host = text.data();
  return own.ss_family == AF_INET6 ? '[' + host + ']' : host;
}

Endpoint WorkerEndpointFor(const Endpoint& client_endpoint) {
  Endpoint endpoint = client_endpoint;
  if (endpoint.scheme != Scheme::kTcp) {
    endpoint.path += ".workers";
  } else if (endpoint.port != 0) {
    endpoint.port += endpoint.port < kMaxPort ? 1 : -1;
  }
  return endpoint;
}

}  // namespace slabstream
