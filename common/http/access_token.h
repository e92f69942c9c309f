// Tokens that say what their holder may do and until when, signed with a server's own token, so that the server keeps no list of them. They
// are JSON Web Tokens (RFC 7519) signed by HMAC-SHA256, so other programs that know the server's token may make them, too:
//   {"alg": "HS256"}   {"exp": 1764450000, "datasets": ["head"], "view_only": true}
// `exp` is needed; without `datasets` they are all meant; `iat` is ignored. A claim of another name might narrow what the token gives, and
// so might an extension that the header names in `crit` (RFC 7515 4.1.11): both are refused. Pure. Any thread.
#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/status.h"

namespace slabstream {

struct Access {
  static constexpr std::int64_t kForEver = std::numeric_limits<std::int64_t>::max();

  std::int64_t until = kForEver;                     // Unix time in seconds; from then on the holder may do nothing
  std::optional<std::vector<std::string>> datasets;  // nullopt: all. A name means its times as well (dataset_name.h)
  bool view_only = false;

  bool Shows(std::string_view dataset) const;
  // What its holder reads when it has ended: "the token expired at 2026-11-29T22:00:00Z".
  std::string ExpiredText() const;
  friend bool operator==(const Access&, const Access&) = default;
};

inline constexpr std::size_t kMaxAccessTokenBytes = 4096;
// Who holds a token can try out secrets without asking the server: they must be as long as those that MakeToken makes.
inline constexpr std::size_t kLeastSecretBytes = 22;

std::int64_t UnixNow();

// The access must end. InvalidArgument: the secret is too short, or the token would be too long.
Result<std::string> SignAccess(const Access& access, std::string_view secret);

// A token of any header and claims, which need not be right: texts in JSON.
std::string SignedToken(std::string_view header, std::string_view claims, std::string_view secret);

// What a token gives at the time `now`: all for ever if it is the secret itself, which CheckToken takes. InvalidArgument, in a line to its
// holder: neither that nor signed with it, expired, or its claims are wrong. The comparisons take the same time wherever bytes differ.
Result<Access> CheckAccess(std::string_view token, std::string_view secret, std::int64_t now);

}  // namespace slabstream
