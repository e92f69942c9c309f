#include "common/http/address.h"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <sys/random.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <utility>

#include "common/base/printable.h"
#include "common/files/files.h"
#include "common/text/parse_number.h"

namespace slabstream {
namespace {

constexpr std::string_view kTokenLetters = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-_";

std::string Lower(std::string_view text) {
  std::string lower(text);
  std::ranges::transform(lower, lower.begin(), [](unsigned char c) { return char(std::tolower(c)); });
  return lower;
}

bool IsLoopback(const std::string& host) {
  in_addr v4{};
  if (::inet_pton(AF_INET, host.c_str(), &v4) == 1) return (ntohl(v4.s_addr) >> 24) == 127;
  return host == "::1";
}

bool IsNumeric(const std::string& host) {
  in_addr v4{};
  in6_addr v6{};
  return ::inet_pton(AF_INET, host.c_str(), &v4) == 1 || ::inet_pton(AF_INET6, host.c_str(), &v6) == 1;
}

struct HostAndPort {
  std::string host;  // without brackets
  std::optional<std::uint16_t> port;
};

// nullopt: neither a name nor an address with a port or without.
std::optional<HostAndPort> Divide(std::string_view text) {
  HostAndPort parts;
  if (text.starts_with('[')) {
    const std::size_t end = text.find(']');
    if (end == std::string_view::npos) return std::nullopt;
    parts.host = text.substr(1, end - 1);
    text.remove_prefix(end + 1);
  } else {
    parts.host = text.substr(0, text.find(':'));
    text.remove_prefix(parts.host.size());
  }
  if (parts.host.empty()) return std::nullopt;
  if (text.empty() || text == ":") return parts;
  parts.port = text[0] == ':' ? ParseNumber<std::uint16_t>(text.substr(1)) : std::nullopt;
  return parts.port ? std::optional(parts) : std::nullopt;
}

std::string_view AfterScheme(std::string_view origin) { return origin.substr(origin.find("//") + 2); }

constexpr std::string_view kAnyPort = ":*";

// Whether `origin` is one of those that `source` names (ParsePageSource).
bool IsOf(std::string_view source, std::string_view origin) {
  if (source.ends_with(':')) return origin.starts_with(source) && origin.substr(source.size()).starts_with("//");
  if (!source.ends_with(kAnyPort)) return origin == source;
  source.remove_suffix(kAnyPort.size());
  if (!origin.starts_with(source)) return false;
  const std::string_view port = origin.substr(source.size());
  return port.empty() || (port.front() == ':' && ParseNumber<std::uint16_t>(port.substr(1)).has_value());
}

}  // namespace

Result<ListenAddress> ParseListenAddress(std::string_view option, std::string_view text) {
  const auto refuse = [&] {
    return Status::InvalidArgument(fmt::format("{} '{}' is not an address such as 127.0.0.1:8080 or [::1]:8080", option, text));
  };
  const bool any_port = text.ends_with(":*");
  const std::optional<HostAndPort> parts = Divide(any_port ? text.substr(0, text.size() - 2) : text);
  if (!parts) return refuse();
  ListenAddress listen;
  listen.host = parts->host == "localhost" ? "127.0.0.1" : parts->host;
  if (!IsNumeric(listen.host)) return refuse();
  listen.port = parts->port.value_or(0);
  listen.loopback = IsLoopback(listen.host);
  listen.any = listen.host == "0.0.0.0" || listen.host == "::";
  return listen;
}

Result<std::string> ParseOrigin(std::string_view option, std::string_view text) {
  const std::string origin = Lower(text);
  const bool scheme = origin.starts_with("https://") || origin.starts_with("http://");
  const std::string_view rest = scheme ? AfterScheme(origin) : "";
  if (scheme && !rest.empty() && rest.find_first_of("/?#@ ") == std::string_view::npos && Divide(rest)) {
    const std::string_view usual = origin.starts_with("https") ? ":443" : ":80";
    return origin.substr(0, origin.size() - (origin.ends_with(usual) ? usual.size() : 0));
  }
  return Status::InvalidArgument(fmt::format("{} '{}' is not an origin such as https://viewer.example.org", option, text));
}

Result<std::string> ParsePageSource(std::string_view option, std::string_view text) {
  const std::string lower = Lower(text);
  const auto belongs = [](unsigned char c) {
    return std::isalnum(c) != 0 || std::string_view("+-.").find(char(c)) != std::string_view::npos;
  };
  const std::string_view scheme = std::string_view(lower).substr(0, lower.size() - std::min<std::size_t>(lower.size(), 1));
  const bool is_scheme = lower.ends_with(':') && !scheme.empty() && std::isalpha(static_cast<unsigned char>(scheme.front())) != 0 &&
                         std::ranges::all_of(scheme, belongs);
  if (is_scheme && (scheme == "http" || scheme == "https")) {
    return Status::InvalidArgument(
        fmt::format("{} '{}' is every page of the web: name origins, such as https://notebooks.example.org", option, text));
  }
  if (is_scheme) return lower;
  const bool any_port = lower.ends_with(kAnyPort);
  const Result<std::string> origin =
      ParseOrigin(option, any_port ? std::string_view(lower).substr(0, lower.size() - kAnyPort.size()) : lower);
  // Signs that end a field of the policy, or stand for many hosts there.
  if (origin.ok() && origin->find_first_of(";,*'") == std::string::npos) return any_port ? lower : *origin;
  return Status::InvalidArgument(
      fmt::format("{} '{}' is neither an origin such as https://notebooks.example.org nor a scheme such as vscode-webview:", option, text));
}

Result<ProxyAddress> ParseProxyAddress(std::string_view option, std::string_view text) {
  const std::size_t scheme = text.find("://"), slash = scheme == std::string_view::npos ? scheme : text.find('/', scheme + 3);
  std::string_view path = slash == std::string_view::npos ? "" : text.substr(slash);
  while (path.ends_with('/')) path.remove_suffix(1);
  const auto belongs = [](unsigned char c) {
    return std::isalnum(c) != 0 || std::string_view("/-._~%@:+").find(char(c)) != std::string_view::npos;
  };
  Result<std::string> origin = ParseOrigin(option, text.substr(0, slash));
  // Parts that browsers and proxies take away would never match.
  const std::string inside = fmt::format("{}/", path);
  const bool plain =
      inside.find("//") == std::string::npos && inside.find("/./") == std::string::npos && inside.find("/../") == std::string::npos;
  if (origin.ok() && plain && std::ranges::all_of(path, belongs)) return ProxyAddress{*std::move(origin), std::string(path)};
  return Status::InvalidArgument(fmt::format("{} '{}' is not an address such as https://viewer.example.org/render/", option, text));
}

Result<HttpUrl> ParseHttpUrl(std::string_view option, std::string_view text) {
  const std::string lower = Lower(text.substr(0, text.find("://") + 1));
  if (lower == "https:") {
    return Status::InvalidArgument(fmt::format("{} '{}' asks for TLS, which is not spoken here: it takes http://HOST:PORT", option, text));
  }
  const auto printable = [](unsigned char c) { return c > ' ' && c < 0x7F && c != '#'; };
  if (lower == "http:" && std::ranges::all_of(text, printable)) {
    const std::string_view rest = AfterScheme(text);
    const std::size_t end = std::min(rest.find_first_of("/?"), rest.size());
    const std::string_view authority = rest.substr(0, end);
    const std::optional<HostAndPort> parts = authority.find('@') == std::string_view::npos ? Divide(authority) : std::nullopt;
    if (parts && parts->port != 0 && !authority.ends_with(':')) {
      HttpUrl url{.host = parts->host, .port = parts->port.value_or(80)};
      url.target = std::string(rest.substr(end));
      if (!url.target.starts_with('/')) url.target.insert(0, "/");
      return url;
    }
  }
  return Status::InvalidArgument(fmt::format("{} '{}' is not an address such as http://127.0.0.1:4318", option, text));
}

std::string HostOf(const HttpUrl& url) {
  const bool v6 = url.host.find(':') != std::string::npos;
  return fmt::format("{}{}{}:{}", v6 ? "[" : "", url.host, v6 ? "]" : "", url.port);
}

std::string ToString(const HttpUrl& url) { return fmt::format("http://{}{}", HostOf(url), url.target); }

OriginRules::OriginRules(ListenAddress listen, bool tls, std::string proxy_origin, std::vector<std::string> pages)
    : listen_(std::move(listen)), tls_(tls), proxy_origin_(std::move(proxy_origin)), pages_(std::move(pages)) {
  if (!proxy_origin_.empty()) proxy_host_ = AfterScheme(proxy_origin_);
}

bool OriginRules::IsOwnHost(std::string_view host) const {
  if (!proxy_host_.empty() && host == proxy_host_) return true;
  const std::optional<HostAndPort> parts = Divide(host);
  if (!parts) return false;
  // Any port of this machine's own names: a tunnel's near end has another one. No foreign page has such a name.
  if (parts->host == "localhost" || IsLoopback(parts->host)) return true;
  // With TLS, whoever reaches the gateway under a name had its certificate checked for it.
  if (tls_ || parts->host == listen_.host) return true;
  // A server that listens at every address may be asked under each. A foreign page whose name was made to point here asks under its name,
  // never under a number.
  return listen_.any && IsNumeric(parts->host);
}

std::optional<std::string> OriginRules::Refusal(std::string_view host, std::optional<std::string_view> origin) const {
  const std::string asked = Lower(host);
  if (!IsOwnHost(asked)) {
    return fmt::format("Host '{}' is not a name of this gateway; --behind-proxy names the address of a proxy in front of it",
                       Printable(asked.substr(0, 128)));
  }
  if (!origin) return std::nullopt;
  const std::string from = Lower(*origin);
  if (!proxy_origin_.empty() && from == proxy_origin_) return std::nullopt;
  if (from == fmt::format("{}://{}", tls_ ? "https" : "http", asked)) return std::nullopt;
  if (std::ranges::any_of(pages_, [&](const std::string& source) { return IsOf(source, from); })) return std::nullopt;
  return fmt::format("Origin '{}' is another site{}", Printable(from.substr(0, 128)),
                     pages_.empty() ? "" : "; --origin names those that may ask");
}

Result<std::string> MakeToken() {
  std::array<unsigned char, 22> random{};  // 6 bits of each: 132 bits
  if (::getrandom(random.data(), random.size(), 0) != ssize_t(random.size()))
    return Status::Unavailable("the system gives no random bytes");
  std::string token;
  for (const unsigned char byte : random) token += kTokenLetters[byte % kTokenLetters.size()];
  return token;
}

Status CheckToken(std::string_view token) {
  constexpr std::size_t kLeast = 16, kMost = 128;
  if (token.size() >= kLeast && token.size() <= kMost && token.find_first_not_of(kTokenLetters) == std::string_view::npos)
    return Status::Ok();
  return Status::InvalidArgument(
      fmt::format("the token has {} characters; it needs {} to {} letters, digits, - and _", token.size(), kLeast, kMost));
}

Result<std::string> ReadToken(std::string_view option, const std::string& path) {
  constexpr std::size_t kMostBytes = 256;
  Result<std::string> token = ReadPrivateTextFile(path, kMostBytes);
  if (!token.ok()) return Status(token.status().code(), fmt::format("{} {}", option, token.status().message()));
  while (token->ends_with('\n')) token->pop_back();
  if (const Status checked = CheckToken(*token); !checked.ok()) {
    return Status::InvalidArgument(fmt::format("{} {}: {}", option, path, checked.message()));
  }
  return token;
}

bool SameToken(std::string_view a, std::string_view b) {
  unsigned difference = a.size() == b.size() ? 0 : 1;
  for (std::size_t i = 0; i < a.size(); ++i) difference |= unsigned(a[i] ^ (b.empty() ? 'x' : b[i % b.size()]));
  return difference == 0;
}

bool IsBearer(const std::optional<std::string>& authorization, std::string_view token) {
  constexpr std::string_view kBearer = "Bearer ";
  return authorization && authorization->starts_with(kBearer) && SameToken(std::string_view(*authorization).substr(kBearer.size()), token);
}

}  // namespace slabstream
