#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <filesystem>

#include "common/base/did_you_mean.h"
#include "common/base/find_named.h"
#include "common/text/trimmed.h"
#include "common/text/url.h"
#include "data/volume_io/read_options.h"

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

// The path of a file, or an address (IsUrl, common/text/url.h), that `text` names. `text` begins with a scheme and has no query.
//
//   zarr://URL, zarr2://, zarr3://, n5://, precomputed://    URL: which format it is, is seen there
//   URL|zarr3:PATH|, and so on                               URL/PATH
//   gs://BUCKET/PATH, gcs://                                 https://storage.googleapis.com/BUCKET/PATH
//   s3+https://HOST/BUCKET/PATH                              s3://BUCKET/PATH?endpoint=https://HOST
//   file:///PATH                                             /PATH, with %XX decoded
//
// InvalidArgument: another scheme; the message says what to write, where that is known.
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

constexpr std::string_view kEndpoint = kEndpointMark.substr(1, kEndpointMark.size() - 2);

// The end of the option that begins at `begin`: a comma with a name and = behind it, since values may hold commas too.
std::size_t OptionEnd(std::string_view source, std::size_t begin) {
  const auto in_name = [](char c) { return (c >= 'a' && c <= 'z') || c == '-'; };
  for (std::size_t comma = source.find(',', begin); comma != std::string_view::npos; comma = source.find(',', comma + 1)) {
    std::size_t behind = comma + 1;
    while (behind < source.size() && in_name(source[behind])) ++behind;
    if (behind > comma + 1 && behind < source.size() && source[behind] == '=') return comma;
  }
  return source.size();
}

// Names in a bucket may hold question marks.
bool MayHaveQuery(std::string_view source) { return !SchemeOf(source).empty() && !source.starts_with(kBucketScheme); }

// Where the options of an address begin. Its own query stands before them.
std::size_t OptionsOfAddress(std::string_view address) {
  const std::size_t mark = address.find('?');
  for (std::size_t at = mark; at != std::string_view::npos; at = address.find_first_of("?,", at + 1)) {
    const std::string_view name = address.substr(at + 1, std::min(address.find('=', at), address.size()) - at - 1);
    const bool is_option = name == kEndpoint || FindNamed(ReadOptionList(), name) != nullptr;
    if (is_option || (at != mark && address[at] == '?')) return at + 1;
  }
  return std::string_view::npos;
}

// Where the options of `source` begin, behind a question mark or, in an address with a query of its own, a comma; npos: it has none.
std::size_t OptionsBegin(std::string_view source) {
  std::error_code error;
  if (std::filesystem::exists(source, error)) return std::string_view::npos;
  if (MayHaveQuery(source)) return OptionsOfAddress(source);
  const std::size_t mark = source.rfind('?');
  return mark != std::string_view::npos && source.find('=', mark) != std::string_view::npos ? mark + 1 : std::string_view::npos;
}

struct OptionText {
  std::string name, value;
};

struct Parts {
  std::string place;  // before the options and the query
  std::string query;
  std::vector<OptionText> options;
};

Parts Divide(std::string_view source) {
  const std::size_t begin = OptionsBegin(source);
  Parts parts{std::string(source.substr(0, begin == std::string_view::npos ? begin : begin - 1)), {}, {}};
  if (const std::size_t mark = parts.place.find('?'); mark != std::string::npos && MayHaveQuery(source)) {
    parts.query = parts.place.substr(mark + 1);
    parts.place.resize(mark);
    // Other spellings end in '|'.
    if (const std::size_t bar = parts.query.find('|'); bar != std::string::npos) {
      parts.place += parts.query.substr(bar);
      parts.query.resize(bar);
    }
  }
  for (std::size_t at = begin; at <= source.size();) {
    const std::size_t end = OptionEnd(source, at), equals = std::min(source.find('=', at), end);
    parts.options.push_back({std::string(source.substr(at, equals - at)),
                             std::string(source.substr(std::min(equals + 1, end), end - std::min(equals + 1, end)))});
    at = end + 1;
  }
  return parts;
}

// Whether a name of a query is rather an option that was misspelled: other letters at most between what both begin and end with.
bool LooksLikeOption(std::string_view name) {
  return std::ranges::any_of(ReadOptionList(), [&](const ReadOption& option) {
    const std::string_view wanted = option.name;
    const std::size_t most = std::min(name.size(), wanted.size());
    const auto begin = std::size_t(std::ranges::mismatch(name, wanted).in1 - name.begin());
    std::size_t end = 0;
    while (end < most - begin && name[name.size() - 1 - end] == wanted[wanted.size() - 1 - end]) ++end;
    return most >= 3 && begin + end + 1 >= std::max(name.size(), wanted.size());
  });
}

std::string JoinedOptions(const std::vector<OptionText>& options) {
  std::string text;
  for (const auto& [name, value] : options) text += fmt::format("{}{}={}", text.empty() ? '?' : ',', name, value);
  return text;
}

}  // namespace

Result<SourceText> ParseSourceText(const std::string& text) {
  const bool is_address = !SchemeOf(Trimmed(text)).empty();
  Parts parts = Divide(is_address ? Trimmed(text) : std::string_view(text));
  SourceText source{parts.place, {}, {}};
  const auto wrong = [&](const std::string& why) { return Status::InvalidArgument(fmt::format("'{}': {}", ShownSource(text), why)); };
  const auto no_option = [&](std::string_view name) {
    return wrong(fmt::format("'{}' is no option for reading a file, which are {}{}", name, NamesOf(ReadOptionList()),
                             DidYouMean(name, ReadOptionList())));
  };
  std::error_code error;
  if (is_address && !std::filesystem::exists(parts.place, error)) {
    Result<std::string> plain = WithoutOtherSpellings(parts.place);
    if (!plain.ok()) return plain.status();
    source.path = *std::move(plain);
    source.options.query = EncodedUrl(parts.query);
    const std::string_view first = std::string_view(parts.query).substr(0, parts.query.find('='));
    if (LooksLikeOption(first)) return no_option(first);
    if (parts.query.starts_with("source=http")) return wrong("is the page of a viewer: write what stands behind 'source='");
  }
  for (auto option = parts.options.begin(); option != parts.options.end();) {
    const auto& [name, value] = *option;
    if (name == kEndpoint && source.path.starts_with(kBucketScheme)) {
      if (source.path.find(kEndpointMark) != std::string::npos) return wrong("endpoint is given twice");
      source.path += std::string(kEndpointMark) + value;
      option = parts.options.erase(option);
      continue;
    }
    const ReadOption* const known = FindNamed(ReadOptionList(), name);
    if (known == nullptr) return no_option(name);
    if (known->given(source.options) && !known->of_addresses) return wrong(fmt::format("{} is given twice", name));
    if (Status status = known->set(source.options, fmt::format("'{}': {}", ShownSource(text), name), value); !status.ok()) return status;
    option = known->of_addresses ? parts.options.erase(option) : option + 1;
  }
  source.options_text = JoinedOptions(parts.options);
  return source;
}

bool MayBeThere(const SourceText& source) {
  std::error_code error;
  // A '*' stands for the names of several files (data/open/file_times.h).
  const bool is_pattern = std::filesystem::path(source.path).filename().string().find('*') != std::string::npos;
  return IsUrl(source.path) || is_pattern || std::filesystem::exists(source.path, error);
}

std::string WithReadOption(const std::string& source, std::string_view name, std::string_view value) {
  const bool has_query = MayHaveQuery(source) && source.find('?') != std::string::npos;
  return fmt::format("{}{}{}={}", source, has_query || OptionsBegin(source) != std::string::npos ? ',' : '?', name, value);
}

std::string WithoutReadOption(const std::string& source, std::string_view name) {
  Parts parts = Divide(source);
  std::erase_if(parts.options, [&](const OptionText& option) { return option.name == name; });
  std::string others = parts.query.empty() ? parts.place : fmt::format("{}?{}", parts.place, parts.query);
  for (const auto& [kept, value] : parts.options) others = WithReadOption(others, kept, value);
  return others;
}

std::string AtTime(const std::string& source, std::optional<int> time) {
  const std::string others = WithoutReadOption(source, "time");
  return time ? WithReadOption(others, "time", std::to_string(*time)) : others;
}

std::string ShownSource(const std::string& source) {
  Parts parts = Divide(source);
  for (OptionText& option : parts.options) {
    const std::size_t colon = option.value.find(':');
    const bool names_file = colon != std::string::npos && option.value.find(":@") == colon;
    if (option.name == "header" && !names_file)
      option.value = (colon == std::string::npos ? "" : option.value.substr(0, colon + 1)) + "...";
  }
  return Redacted(parts.place) + (parts.query.empty() ? "" : "?...") + JoinedOptions(parts.options);
}

}  // namespace slabstream
