// Where an HTTP server listens, who may ask it by a token, and under which names it may be asked: the checks of Host and Origin that keep
// foreign pages out. And the addresses of other servers.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/status.h"

namespace slabstream {

struct ListenAddress {
  std::string host = "127.0.0.1";  // a numeric address; IPv6 without brackets
  std::uint16_t port = 0;          // 0: any free one
  bool loopback = true;
  bool any = false;  // 0.0.0.0 or [::]: every address of this machine
};

// "HOST:PORT", "HOST", or "[::1]:8080"; a port of 0 or * is any. InvalidArgument.
Result<ListenAddress> ParseListenAddress(std::string_view option, std::string_view text);

// "https://viewer.example.org" or with a port; no path. As browsers write it: in lower case, without the scheme's own port.
// InvalidArgument.
Result<std::string> ParseOrigin(std::string_view option, std::string_view text);

// Pages that may show this server's in a frame, and ask it: those of an origin, as ParseOrigin takes it; of any port of a host,
// "http://localhost:*"; or of a scheme, "vscode-webview:", but not of the whole web. As Content-Security-Policy has it. InvalidArgument.
Result<std::string> ParsePageSource(std::string_view option, std::string_view text);

// Where a proxy shows this server.
struct ProxyAddress {
  std::string origin;  // as ParseOrigin gives it; empty: there is no proxy
  std::string path;    // "/render", without a slash at its end; empty: all of the host
};

// "https://viewer.example.org/render/"; the slash at the end may be left out. InvalidArgument.
Result<ProxyAddress> ParseProxyAddress(std::string_view option, std::string_view text);

// What a client asks, without TLS.
struct HttpUrl {
  std::string host;  // a name or a numeric address; IPv6 without brackets
  std::uint16_t port = 80;
  std::string target = "/";  // path and query
};

// "http://HOST[:PORT][/PATH]". InvalidArgument: https, a name and password, or no such address.
Result<HttpUrl> ParseHttpUrl(std::string_view option, std::string_view text);
// "HOST:PORT", as the header Host has it.
std::string HostOf(const HttpUrl& url);
std::string ToString(const HttpUrl& url);

// Which requests are the server's own.
class OriginRules {
 public:
  // `proxy_origin`: of the proxy in front; empty: there is none. `pages`: others that may ask, as ParsePageSource gives them.
  OriginRules(ListenAddress listen, bool tls, std::string proxy_origin, std::vector<std::string> pages = {});

  // What is wrong with the headers Host and, if the request has one, Origin, in a line to the client. nullopt: nothing.
  std::optional<std::string> Refusal(std::string_view host, std::optional<std::string_view> origin) const;

 private:
  bool IsOwnHost(std::string_view host) const;
  ListenAddress listen_;
  bool tls_;
  std::string proxy_origin_, proxy_host_;
  std::vector<std::string> pages_;
};

// Random text of 128 bits, letters, digits, - and _. Unavailable: the system has no randomness.
Result<std::string> MakeToken();
// What may stand in --token-file: 16 to 128 letters, digits, - and _. InvalidArgument.
Status CheckToken(std::string_view token);
// The token in a file, without the end of its line. InvalidArgument and the errors of ReadPrivateTextFile, which name the option.
Result<std::string> ReadToken(std::string_view option, const std::string& path);
// In time that does not depend on where they differ.
bool SameToken(std::string_view a, std::string_view b);
// Whether this is the header `Authorization: Bearer TOKEN`.
bool IsBearer(const std::optional<std::string>& authorization, std::string_view token);

}  // namespace slabstream
