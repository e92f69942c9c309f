#include "common/transport/endpoint.h"

#include <arpa/inet.h>
#include <sys/un.h>

#include <algorithm>
#include <charconv>
#include <cstdint>
#include <optional>
#include <utility>

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

Result<Endpoint> ParseTcp(std::string_view text, std::string_view rest, bool allow_wildcard) {
  const std::size_t colon = rest.rfind(':');
  if (colon == std::string_view::npos) return Refused(text, "no port, expected tcp://HOST:PORT");
  const std::string_view host = rest.substr(0, colon), port = rest.substr(colon + 1);
  Endpoint endpoint;
  if (std::optional<std::string> loopback = LoopbackHost(host)) {
    endpoint.host = *std::move(loopback);
  } else {
    return Refused(text, "host \"" + std::string(host.substr(0, 128)) +
                             "\" is not loopback (127.0.0.0/8, [::1] or localhost): without keys the service stays on this machine");
  }
  if (allow_wildcard && port == "*") return endpoint;
  const auto [end, error] = std::from_chars(port.data(), port.data() + port.size(), endpoint.port);
  if (error != std::errc() || end != port.data() + port.size() || endpoint.port < 1 || endpoint.port > kMaxPort) {
    return Refused(text,
                   "port \"" + std::string(port.substr(0, 128)) + "\" is not a number of [1, 65535]" + (allow_wildcard ? " or *" : ""));
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

std::string Endpoint::ToString() const {
  switch (scheme) {
    case Scheme::kTcp: return "tcp://" + host + ":" + (port == 0 ? "*" : std::to_string(port));
    case Scheme::kIpc: return "ipc://" + path;
    case Scheme::kInproc: break;
  }
  return "inproc://" + path;
}

Result<Endpoint> ParseEndpoint(std::string_view text, bool allow_wildcard) {
  if (text.size() > kMaxTextBytes) return Refused(text, std::to_string(text.size()) + " bytes, at most " + std::to_string(kMaxTextBytes));
  if (!Printable(text)) return Refused(text, "spaces and control characters are not allowed, expected " + std::string(kShapes));
  if (text.starts_with("tcp://")) return ParseTcp(text, text.substr(6), allow_wildcard);
  if (text.starts_with("ipc://")) return ParseIpc(text, text.substr(6));
  if (text.starts_with("inproc://")) {
    if (text.size() == 9) return Refused(text, "no name, expected inproc://NAME");
    return Endpoint{Scheme::kInproc, {}, 0, std::string(text.substr(9))};
  }
  return Refused(text, "expected " + std::string(kShapes));
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
