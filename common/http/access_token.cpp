#include "common/http/access_token.h"

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <openssl/evp.h>
#include <openssl/hmac.h>

#include <strings.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <utility>

#include "common/base/check.h"
#include "common/base/printable.h"
#include "common/http/address.h"
#include "common/json/json.h"
#include "common/text/base64.h"

namespace slabstream {
namespace {

constexpr std::string_view kHeader = R"({"alg":"HS256","typ":"JWT"})", kAlgorithm = "HS256";
constexpr std::string_view kWrong =
    "the token is missing or wrong; it is part of the address that the gateway printed, or in its --token-file";

// RFC 4648 5, without the padding.
std::string ToBase64Url(std::string_view bytes) {
  std::string text((bytes.size() + 2) / 3 * 4 + 1, '\0');
  const auto raw = [](auto* p) { return reinterpret_cast<unsigned char*>(const_cast<char*>(p)); };
  text.resize(std::size_t(EVP_EncodeBlock(raw(text.data()), raw(bytes.data()), int(bytes.size()))));
  while (text.ends_with('=')) text.pop_back();
  std::ranges::replace(text, '+', '-');
  std::ranges::replace(text, '/', '_');
  return text;
}

std::optional<std::string> FromBase64Url(std::string_view text) {
  if (text.find_first_of("+/=") != std::string_view::npos) return std::nullopt;
  std::string letters(text);
  std::ranges::replace(letters, '-', '+');
  std::ranges::replace(letters, '_', '/');
  letters.resize((letters.size() + 3) / 4 * 4, '=');
  std::string bytes(letters.size() / 4 * 3, '\0');
  const auto count = DecodeBase64(std::as_bytes(std::span(letters)), std::as_writable_bytes(std::span(bytes)));
  if (!count) return std::nullopt;
  bytes.resize(*count);
  return bytes;
}

std::string Signature(std::string_view text, std::string_view secret) {
  std::array<unsigned char, EVP_MAX_MD_SIZE> mac{};
  unsigned bytes = 0;
  CHECK(HMAC(EVP_sha256(), secret.data(), int(secret.size()), reinterpret_cast<const unsigned char*>(text.data()), text.size(), mac.data(),
             &bytes) != nullptr);
  return ToBase64Url({reinterpret_cast<const char*>(mac.data()), bytes});
}

// An object, or null: no object in JSON in Base64.
Json ObjectOf(std::string_view part) {
  const std::optional<std::string> text = FromBase64Url(part);
  Result<Json> json = text ? Json::Parse(*text, {.depth = 4, .names_differ = true}) : Result<Json>(Json());
  return json.ok() && json->is_object() ? *std::move(json) : Json();
}

Status Mistake(std::string_view why) { return Status::InvalidArgument(fmt::format("the token is signed, but {}", why)); }

// RFC 7515 4.1: what a server does not know of a header is to be ignored, unless `crit` is there, which names extensions that must be
// known. None is known here. `b64` changes what is signed, and must never stand without it.
Status CheckHeader(const Json& header) {
  if (!header.contains("alg") || header["alg"] != Json(kAlgorithm)) return Mistake("its header does not say that its algorithm is HS256");
  for (const char* name : {"crit", "b64"}) {
    if (header.contains(name)) return Mistake(fmt::format("its header has '{}', and no extension of tokens is known here", name));
  }
  const Json type = header.contains("typ") ? header["typ"] : Json("JWT");
  if (type.is_string() && ::strcasecmp(type.get<std::string>().c_str(), "JWT") == 0) return Status::Ok();
  return Mistake("its header says by 'typ' that it is no JWT");
}

Result<Access> AccessOf(const Json& claims) {
  Access access;
  bool ends = false;
  for (const auto& [name, value] : claims.items()) {
    if (name == "exp" && value.is_number()) {
      // Beyond what a double counts exactly, and thousands of years, any time is the same.
      access.until = std::int64_t(std::clamp(value.get<double>(), 0.0, 9e15));
      ends = true;
    } else if (name == "datasets" && value.is_array() && std::ranges::all_of(value, &Json::is_string)) {
      access.datasets = value.get<std::vector<std::string>>();
    } else if (name == "view_only" && value.is_boolean()) {
      access.view_only = value.get<bool>();
    } else if (name != "iat" || !value.is_number()) {
      return Mistake(
          fmt::format("its claim '{}' is none of exp, iat, datasets and view_only with their types", Printable(name.substr(0, 64))));
    }
  }
  if (!ends) return Mistake("it has no claim exp: the Unix time in seconds at which it expires");
  return access;
}

}  // namespace

bool Access::Shows(std::string_view dataset) const {
  return !datasets || std::ranges::find(*datasets, dataset.substr(0, dataset.find('@'))) != datasets->end() ||
         std::ranges::find(*datasets, dataset) != datasets->end();
}

std::string Access::ExpiredText() const {
  constexpr std::int64_t kMost = 253402300799;  // the end of the year 9999
  return fmt::format("the token expired at {:%Y-%m-%dT%H:%M:%SZ}", fmt::gmtime(std::time_t(std::clamp<std::int64_t>(until, 0, kMost))));
}

std::int64_t UnixNow() {
  return std::chrono::duration_cast<std::chrono::seconds>(std::chrono::system_clock::now().time_since_epoch()).count();
}

Result<std::string> SignAccess(const Access& access, std::string_view secret) {
  CHECK(access.until != Access::kForEver);
  if (secret.size() < kLeastSecretBytes) {
    return Status::InvalidArgument(fmt::format("the gateway's own token has {} characters; to sign others it needs at least {}, at random",
                                               secret.size(), kLeastSecretBytes));
  }
  Json claims = {{"exp", access.until}};
  if (access.datasets) claims["datasets"] = *access.datasets;
  if (access.view_only) claims["view_only"] = true;
  std::string token = SignedToken(kHeader, claims.dump(), secret);
  if (token.size() <= kMaxAccessTokenBytes) return token;
  return Status::InvalidArgument(fmt::format("the token of {} datasets has {} bytes, at most {} are possible", access.datasets->size(),
                                             token.size(), kMaxAccessTokenBytes));
}

std::string SignedToken(std::string_view header, std::string_view claims, std::string_view secret) {
  const std::string text = ToBase64Url(header) + "." + ToBase64Url(claims);
  return text + "." + Signature(text, secret);
}

Result<Access> CheckAccess(std::string_view token, std::string_view secret, std::int64_t now) {
  if (SameToken(token, secret)) return Access();
  const std::size_t first = token.find('.'), last = token.rfind('.');
  if (token.size() > kMaxAccessTokenBytes || first == last) return Status::InvalidArgument(std::string(kWrong));
  // Nothing of the token is looked into before its signature is right.
  const std::string_view text = token.substr(0, last);
  if (secret.size() < kLeastSecretBytes || !SameToken(token.substr(last + 1), Signature(text, secret))) {
    return Status::InvalidArgument(std::string(kWrong));
  }
  if (Status status = CheckHeader(ObjectOf(text.substr(0, first))); !status.ok()) return status;
  const Json claims = ObjectOf(text.substr(first + 1));
  if (claims.is_null()) return Mistake("its claims are no JSON object");
  Result<Access> access = AccessOf(claims);
  if (access.ok() && now >= access->until) return Status::InvalidArgument(access->ExpiredText());
  return access;
}

}  // namespace slabstream
