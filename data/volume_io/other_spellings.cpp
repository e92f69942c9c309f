#include "data/volume_io/other_spellings.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>

#include "common/text/url.h"

namespace slabstream {
namespace {

constexpr std::array<std::string_view, 8> kFormats = {"zarr", "zarr2", "zarr3", "ome-zarr", "n5", "precomputed", "neuroglancer-precomputed",
                                                      "auto"};

bool IsFormat(std::string_view name) { return std::ranges::find(kFormats, name) != kFormats.end(); }

// "https" of "HTTPS://HOST".
std::string LowerScheme(std::string_view text) {
  std::string scheme(SchemeOf(text));
  std::ranges::transform(scheme, scheme.begin(), [](unsigned char c) { return char(std::tolower(c)); });
  return scheme;
}

std::string WithoutSlashes(std::string_view text) {
  while (text.ends_with('/')) text.remove_suffix(1);
  return std::string(text);
}

// Of Azure. "container@account.host/path", or "container/path".
std::string AzureAddress(std::string_view place) {
  const std::size_t at = place.find('@'), slash = std::min(place.find('/'), place.size());
  if (at > slash) return fmt::format("https://ACCOUNT.blob.core.windows.net/{}", place);
  const std::string_view host = place.substr(at + 1, slash - at - 1);
  return fmt::format("https://{}.blob.core.windows.net/{}{}", host.substr(0, host.find('.')), place.substr(0, at), place.substr(slash));
}

}  // namespace

Result<std::string> WithoutOtherSpellings(std::string_view text) {
  const auto wrong = [&](const std::string& why) { return Status::InvalidArgument(fmt::format("'{}': {}", text, why)); };
  // What stands behind '|' says in turn how what stands before it is read.
  const std::size_t bar = std::min(text.find('|'), text.size());
  std::string below;
  for (std::string_view rest = text.substr(bar); !rest.empty();) {
    rest.remove_prefix(1);
    const std::string_view step = rest.substr(0, rest.find('|')), kind = step.substr(0, step.find(':'));
    rest.remove_prefix(step.size());
    if (step.empty() && rest.empty()) break;
    if (!IsFormat(kind)) return wrong(fmt::format("'{}' is no format that is read from an address", kind));
    std::string_view path = step.substr(std::min(kind.size() + 1, step.size()));
    while (path.starts_with('/')) path.remove_prefix(1);
    if (!path.empty()) below += fmt::format("/{}", WithoutSlashes(path));
  }
  text = text.substr(0, bar);
  std::string scheme = LowerScheme(text);
  if (IsFormat(scheme)) {
    text.remove_prefix(scheme.size() + 3);
    scheme = LowerScheme(text);
  }
  if (scheme.empty()) return std::string(text) + below;
  const std::string_view place = text.substr(scheme.size() + 3);
  if (scheme == "http" || scheme == "https") return fmt::format("{}://{}{}", scheme, WithoutSlashes(EncodedUrl(place)), EncodedUrl(below));
  if (scheme == "s3") return fmt::format("s3://{}{}", WithoutSlashes(place), below);
  if (scheme == "gs" || scheme == "gcs") {
    return fmt::format("https://storage.googleapis.com/{}{}", WithoutSlashes(EncodedPath(place)), EncodedPath(below));
  }
  if (scheme == "s3+http" || scheme == "s3+https") {
    const std::size_t host = place.find('/');
    if (host == std::string_view::npos) return wrong(fmt::format("must be {}://HOST/BUCKET/PATH", scheme));
    return fmt::format("s3://{}{}{}{}://{}", WithoutSlashes(place.substr(host + 1)), below, kEndpointMark, scheme.substr(3),
                       place.substr(0, host));
  }
  if (scheme == "file") {
    const std::size_t root = place.find('/');
    const std::string_view host = place.substr(0, root);
    if (root != std::string_view::npos && (host.empty() || host == "localhost")) return DecodedPath(place.substr(root)) + below;
    return wrong("file:// must be followed by an absolute path, as in file:///data/scan.zarr");
  }
  if (scheme == "az" || scheme == "azure" || scheme == "abfs" || scheme == "abfss" || scheme == "wasb" || scheme == "wasbs") {
    return wrong(fmt::format("write {}, with the SAS token behind it after a question mark if there is one", AzureAddress(place)));
  }
  return wrong(fmt::format("'{}' is none of the schemes http, https, s3, gs and file", scheme));
}

}  // namespace slabstream
