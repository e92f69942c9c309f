// Addresses of objects behind web servers and in buckets (S3), which stand where paths of files may stand.
#pragma once

#include <string>
#include <string_view>

namespace slabstream {

inline constexpr std::string_view kBucketScheme = "s3://";
inline constexpr std::string_view kEndpointMark = "?endpoint=";  // behind the address of a bucket: its server follows

inline bool IsUrl(std::string_view path) {
  return path.starts_with("http://") || path.starts_with("https://") || path.starts_with(kBucketScheme);
}

// What stands in front of "://", such as "https"; empty: the text does not begin with a scheme.
std::string_view SchemeOf(std::string_view text);

// The path of a URL: all bytes but letters, digits, "-._~" and '/' as %XX (RFC 3986).
std::string EncodedPath(std::string_view path);
// A URL that a person wrote: bytes that no URL may hold, such as blanks and umlauts, as %XX; a % stays.
std::string EncodedUrl(std::string_view url);
// %XX as the byte. A % without two hexadecimal digits behind it stays.
std::string DecodedPath(std::string_view path);

// The text without what addresses in it may hold of secrets: names, passwords, and queries, of which an endpoint alone is shown. All
// messages of a Status and of the log pass through here.
std::string Redacted(std::string text);

}  // namespace slabstream
