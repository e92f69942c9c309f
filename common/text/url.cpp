#include "common/text/url.h"

#include <fmt/format.h>

#include <algorithm>

#include "common/text/parse_number.h"

namespace slabstream {
namespace {

bool IsLetter(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'); }
bool IsDigit(char c) { return c >= '0' && c <= '9'; }
bool IsOfScheme(char c) { return IsLetter(c) || IsDigit(c) || c == '+' || c == '-' || c == '.'; }

std::string Encoded(std::string_view text, bool (*stays)(char)) {
  std::string url;
  for (const char c : text) url += stays(c) ? std::string(1, c) : fmt::format("%{:02X}", static_cast<unsigned char>(c));
  return url;
}

}  // namespace

std::string_view SchemeOf(std::string_view text) {
  const std::size_t end = text.find("://");
  const bool has_scheme =
      end != std::string_view::npos && end > 0 && IsLetter(text[0]) && std::ranges::all_of(text.substr(0, end), IsOfScheme);
  return text.substr(0, has_scheme ? end : 0);
}

std::string EncodedPath(std::string_view path) {
  return Encoded(path, [](char c) { return IsLetter(c) || IsDigit(c) || std::string_view("-._~/").find(c) != std::string_view::npos; });
}

std::string EncodedUrl(std::string_view url) {
  return Encoded(url, [](char c) { return c > ' ' && c < 0x7F && std::string_view("\"<>\\^`{}|").find(c) == std::string_view::npos; });
}

std::string DecodedPath(std::string_view path) {
  std::string decoded;
  for (std::size_t i = 0; i < path.size(); ++i) {
    unsigned byte = 0;
    const char* const digits = path.data() + i + 1;
    const bool is_code = path[i] == '%' && i + 2 < path.size() && std::from_chars(digits, digits + 2, byte, 16).ptr == digits + 2;
    decoded += is_code ? char(byte) : path[i];
    if (is_code) i += 2;
  }
  return decoded;
}

std::string Redacted(std::string text) {
  constexpr std::string_view kHidden = "...";
  for (std::size_t slashes = text.find("://"); slashes != std::string::npos; slashes = text.find("://", slashes)) {
    const std::size_t host = slashes + 3;
    const auto end = [&] { return std::min(text.find_first_of(" \t\r\n'\"", host), text.size()); };
    const std::size_t authority = std::min(text.find_first_of("/?#", host), end());
    if (const std::size_t at = text.substr(host, authority - host).rfind('@'); at != std::string::npos) text.replace(host, at, kHidden);
    std::size_t query = std::min(text.find('?', host), end());
    if (text.compare(query, kEndpointMark.size(), kEndpointMark) == 0) query = std::min(text.find_first_of(",?&", query + 1), end());
    const std::size_t shown = std::min(query + 1, end());
    const std::size_t last = text.substr(0, end()).find_last_not_of(":,;.)");  // these belong to the sentence around it
    if (last != std::string::npos && last >= shown) text.replace(shown, last + 1 - shown, kHidden);
    slashes = host;
  }
  return text;
}

}  // namespace slabstream
