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

// The path of a URL: all bytes but letters, digits, "-._~" and '/' as %XX (RFC 3986).
std::string EncodedPath(std::string_view path);

}  // namespace slabstream
