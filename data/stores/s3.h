// Volumes in buckets of S3 and of servers that speak its protocol: where their objects are, and whose requests are signed.
#pragma once

#include <optional>
#include <string>

#include "common/base/status.h"

namespace slabstream {

struct S3Access {
  std::string key, secret;  // access key, secret access key
  std::string token;        // the token of a session; empty: there is none
  std::string region;
};

struct S3Place {
  std::string url;                 // what the address names, by HTTP or HTTPS
  std::optional<S3Access> access;  // none: requests are anonymous
};

// `address`: "s3://BUCKET/PATH", with the path as objects are called, not encoded; or with "?endpoint=URL" behind it for another server
// than Amazon's. What it leaves open is taken from where other programs look: AWS_ENDPOINT_URL, AWS_REGION, AWS_DEFAULT_REGION,
// AWS_ACCESS_KEY_ID, AWS_SECRET_ACCESS_KEY, AWS_SESSION_TOKEN and AWS_PROFILE of the environment; then the files ~/.aws/credentials and
// ~/.aws/config (AWS_SHARED_CREDENTIALS_FILE, AWS_CONFIG_FILE). With AWS_NO_SIGN_REQUEST=true, or without credentials, requests are
// anonymous. InvalidArgument: another address, or half of the credentials.
Result<S3Place> FindS3Place(const std::string& address);

}  // namespace slabstream
