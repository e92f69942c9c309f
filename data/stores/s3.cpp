#include "data/stores/s3.h"

#include <fmt/format.h>

#include <cstdlib>
#include <fstream>
#include <map>

#include "common/base/printable.h"
#include "common/text/trimmed.h"
#include "common/text/url.h"

namespace slabstream {
namespace {

std::string Environment(const char* name) {
  const char* const value = std::getenv(name);
  return value == nullptr ? "" : value;
}

// The values in a section of an INI file; none if there is no such file or section.
std::map<std::string, std::string> ReadSection(const std::string& path, std::string_view section) {
  std::map<std::string, std::string> values;
  std::ifstream file(path);
  bool inside = false;
  for (std::string line; std::getline(file, line);) {
    const std::string_view text = Trimmed(line);
    if (text.starts_with('[')) inside = text == fmt::format("[{}]", section);
    const std::size_t equals = text.find('=');
    if (!inside || text.starts_with('#') || text.starts_with(';') || equals == std::string_view::npos) continue;
    values.try_emplace(std::string(Trimmed(text.substr(0, equals))), Trimmed(text.substr(equals + 1)));
  }
  return values;
}

std::string FileOf(const char* variable, const char* name) {
  const std::string named = Environment(variable);
  return named.empty() ? Environment("HOME") + "/.aws/" + name : named;
}

std::string FirstOf(std::initializer_list<std::string> texts) {
  for (const std::string& text : texts) {
    if (!text.empty()) return text;
  }
  return {};
}

Result<std::optional<S3Access>> FindAccess(const std::string& profile, const std::string& region) {
  if (Environment("AWS_NO_SIGN_REQUEST") == "true") return std::optional<S3Access>();
  S3Access access{Environment("AWS_ACCESS_KEY_ID"), Environment("AWS_SECRET_ACCESS_KEY"), Environment("AWS_SESSION_TOKEN"), region};
  std::string where = "AWS_ACCESS_KEY_ID and AWS_SECRET_ACCESS_KEY";
  if (access.key.empty() && access.secret.empty()) {
    const std::string path = FileOf("AWS_SHARED_CREDENTIALS_FILE", "credentials");
    std::map<std::string, std::string> values = ReadSection(path, profile);
    access = {values["aws_access_key_id"], values["aws_secret_access_key"], values["aws_session_token"], region};
    where = fmt::format("[{}] of {}", profile, path);
  }
  if (access.key.empty() && access.secret.empty()) return std::optional<S3Access>();
  if (access.key.empty() || access.secret.empty()) {
    return Printable(Status::InvalidArgument(where + ": an access key and its secret belong together, but only one of them is there"));
  }
  return std::optional(std::move(access));
}

}  // namespace

Result<S3Place> FindS3Place(const std::string& address) {
  const auto wrong = [&](std::string_view why) { return Printable(Status::InvalidArgument(fmt::format("{}: {}", address, why))); };
  if (!address.starts_with(kBucketScheme)) return wrong("must be s3://BUCKET/PATH");
  const std::size_t mark = std::min(address.find(kEndpointMark), address.size());
  const std::string place = address.substr(kBucketScheme.size(), mark - kBucketScheme.size());
  const std::size_t slash = std::min(place.find('/'), place.size());
  const std::string bucket = place.substr(0, slash), path = EncodedPath(place.substr(slash));
  const bool plain = bucket.find_first_not_of("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789.-_") == std::string::npos;
  if (bucket.empty() || !plain) return wrong(fmt::format("'{}' is no name of a bucket", bucket));
  std::string endpoint = mark < address.size() ? address.substr(mark + kEndpointMark.size()) : Environment("AWS_ENDPOINT_URL");
  while (endpoint.ends_with('/')) endpoint.pop_back();
  if (!endpoint.empty() && !endpoint.starts_with("http://") && !endpoint.starts_with("https://")) {
    return wrong(fmt::format("its endpoint '{}' must begin with http:// or https://", endpoint));
  }
  const std::string profile = FirstOf({Environment("AWS_PROFILE"), "default"});
  const std::string section = profile == "default" ? profile : "profile " + profile;
  const std::string region = FirstOf({Environment("AWS_REGION"), Environment("AWS_DEFAULT_REGION"),
                                      ReadSection(FileOf("AWS_CONFIG_FILE", "config"), section)["region"], "us-east-1"});
  Result<std::optional<S3Access>> access = FindAccess(profile, region);
  if (!access.ok()) return access.status();
  // A certificate of *.s3.REGION.amazonaws.com does not fit a name with dots.
  const bool in_name = endpoint.empty() && bucket.find('.') == std::string::npos;
  if (in_name) return S3Place{fmt::format("https://{}.s3.{}.amazonaws.com{}", bucket, region, path), *std::move(access)};
  if (endpoint.empty()) endpoint = fmt::format("https://s3.{}.amazonaws.com", region);
  return S3Place{fmt::format("{}/{}{}", endpoint, bucket, path), *std::move(access)};
}

}  // namespace slabstream
