#include "data/stores/transfer.h"

#include <fmt/format.h>
#include <sys/socket.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <iterator>
#include <new>
#include <utility>

#include "common/base/version.h"
#include "data/stores/address_reach.h"

namespace slabstream {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr std::size_t kKeptOfPage = 4096;

std::size_t TakeHead(char*, std::size_t, std::size_t bytes, void* transfer) {
  return static_cast<Transfer*>(transfer)->OnHead(bytes) ? bytes : 0;
}

std::size_t TakeBody(char* data, std::size_t, std::size_t bytes, void* transfer) {
  return static_cast<Transfer*>(transfer)->OnBody(std::as_bytes(std::span(data, bytes))) ? bytes : 0;
}

int TakeProgress(void* transfer, curl_off_t, curl_off_t bytes, curl_off_t, curl_off_t) {
  return static_cast<Transfer*>(transfer)->OnProgress(std::uint64_t(bytes)) ? 0 : 1;
}

// Before a connection is made. What is refused hears nothing from us, and another address of the same name may be asked.
curl_socket_t OpenSocket(void* transfer, curlsocktype, curl_sockaddr* address) {
  if (!static_cast<Transfer*>(transfer)->OnPlace(TextOf(&address->addr))) return CURL_SOCKET_BAD;
  return ::socket(address->family, address->socktype | SOCK_CLOEXEC, address->protocol);
}

// Before a request goes out, perhaps over a connection that was there.
int CheckPlace(void* transfer, char* address, char*, int, int) {
  return static_cast<Transfer*>(transfer)->OnConnection(address) ? CURL_PREREQFUNC_OK : CURL_PREREQFUNC_ABORT;
}

const std::string& UserAgent() {
  static const std::string agent = fmt::format("slabstream/{}", Version());
  return agent;
}

// What such names hold is compressed by its writer, whatever a server that goes by names says of it.
bool NamesCompressed(std::string_view url) {
  return url.ends_with(".gz") || url.ends_with(".br") || url.ends_with(".zst") || url.ends_with(".zstd");
}

std::string UrlOf(const HttpGet& get) {
  return get.access == nullptr || get.access->query.empty() ? get.url : fmt::format("{}?{}", get.url, get.access->query);
}

}  // namespace

std::string PartOf(const std::string& url, CURLUPart part, unsigned flags) {
  const std::unique_ptr<CURLU, void (*)(CURLU*)> parsed(curl_url(), curl_url_cleanup);
  char* text = nullptr;
  if (parsed == nullptr || curl_url_set(parsed.get(), CURLUPART_URL, url.c_str(), 0) != CURLUE_OK ||
      curl_url_get(parsed.get(), part, &text, flags) != CURLUE_OK) {
    return {};
  }
  std::string value(text);
  curl_free(text);
  return value;
}

std::string HostAndPort(const std::string& url) {
  return fmt::format("{}:{}", PartOf(url, CURLUPART_HOST), PartOf(url, CURLUPART_PORT, CURLU_DEFAULT_PORT));
}

std::string InRegion(const std::string& url, const std::string& region) {
  constexpr std::string_view kAmazon = ".amazonaws.com", kService = "s3";
  const std::string host = PartOf(url, CURLUPART_HOST);
  if (!host.ends_with(kAmazon)) return url;
  // "s3", "s3.REGION" or "s3-REGION" stands behind the bucket, if that is in the name.
  const std::string front = host.substr(0, host.size() - kAmazon.size());
  std::size_t service = front.rfind('.');
  service = service == std::string::npos ? 0 : service + 1;
  if (front.compare(service, kService.size(), kService) != 0 && service >= 2) {
    service = front.rfind('.', service - 2);
    service = service == std::string::npos ? 0 : service + 1;
  }
  const std::string_view name = std::string_view(front).substr(service);
  if (name != kService && !name.starts_with("s3.") && !name.starts_with("s3-")) return url;
  std::string other = url;
  return other.replace(url.find(host), host.size(), fmt::format("{}s3.{}{}", front.substr(0, service), region, kAmazon));
}

Transfer::Transfer(HttpGet what, HttpTransfers::Done done) : get(std::move(what)) {
  askers.push_back({get.span, std::move(done), get.wanted});
  Lead(UrlOf(get));
}

bool Transfer::IsWanted() {
  const bool dropped = get.access != nullptr && get.access->stop.stop_requested();
  if (!dropped && std::ranges::any_of(askers, [](const Asker& asker) { return !asker.wanted || asker.wanted(); })) {
    asked_wanted = MonotonicNow();
    return true;
  }
  stopped = Status::Cancelled("nobody waits for it any more");
  return false;
}

bool Transfer::elsewhere() const { return PartOf(url, CURLUPART_HOST) != PartOf(InRegion(get.url, region), CURLUPART_HOST); }

bool Transfer::trusted() const {
  const std::string own = HostAndPort(InRegion(get.url, region));
  const auto is_at = [](std::string_view server, std::string_view port) { return server.ends_with(port); };
  // The same server may lead from HTTP to HTTPS.
  return host == own || (!elsewhere() && is_at(own, ":80") && is_at(host, ":443") && url.starts_with("https:"));
}

long Transfer::status() const {
  long code = 0;
  curl_easy_getinfo(easy, CURLINFO_RESPONSE_CODE, &code);
  return code;
}

std::optional<std::uint64_t> Transfer::length() const {
  curl_off_t bytes = -1;
  curl_easy_getinfo(easy, CURLINFO_CONTENT_LENGTH_DOWNLOAD_T, &bytes);
  return bytes < 0 ? std::nullopt : std::optional(std::uint64_t(bytes));
}

std::string Transfer::header(const char* name) const {
  curl_header* found = nullptr;
  return curl_easy_header(easy, name, 0, CURLH_HEADER, -1, &found) == CURLHE_OK ? found->value : "";
}

bool Transfer::is_encoded() const {
  const std::string encoding = header("Content-Encoding");
  return !encoding.empty() && encoding != "identity";
}

bool Transfer::says_html() const { return header("Content-Type").starts_with("text/html"); }

std::string Transfer::Between(std::string_view begin, std::string_view end) const {
  const std::size_t from = page.find(begin), to = from == std::string::npos ? from : page.find(end, from);
  return to == std::string::npos ? "" : page.substr(from + begin.size(), to - from - begin.size());
}

bool Transfer::TakesAlong(const Transfer& other) const {
  const auto is_plain = [](const Transfer& each) { return each.get.span && !each.get.only_size && each.tries == 0 && each.redirects == 0; };
  if (!is_plain(*this) || !is_plain(other) || get.url != other.get.url) return false;
  if (get.known != other.get.known || get.access != other.get.access) return false;
  const std::uint64_t end = get.span->begin + get.span->bytes, other_end = other.get.span->begin + other.get.span->bytes;
  return other.get.span->begin >= end && other.get.span->begin - end <= HttpTransfers::kMostBetween &&
         other_end - get.span->begin <= HttpTransfers::kMostTogether;
}

void Transfer::TakeAlong(Transfer other) {
  get.span->bytes = other.get.span->begin + other.get.span->bytes - get.span->begin;
  get.most = get.span->bytes;
  std::ranges::move(other.askers, std::back_inserter(askers));
}

void Transfer::Lead(std::string where) {
  url = std::move(where);
  host = HostAndPort(url);
}

void Transfer::ReadStart() {
  constexpr std::uint64_t kStart = 64;  // enough to tell a page from an object
  reads_start = true;
  get.span = ByteSpan{0, kStart};
  get.most = kStart;
}

void Transfer::Prepare(CURL* handle, const HttpTransfers::Timing& timing) {
  easy = handle;
  tried = MonotonicNow();
  patience = timing.patience;
  if (begun == Time()) begun = tried;
  ++tries;
  body = {};
  page.clear();
  head_bytes = page_bytes = 0;
  stopped.reset();
  reason[0] = 0;
  headers.reset();
  curl_easy_setopt(easy, CURLOPT_PRIVATE, this);
  curl_easy_setopt(easy, CURLOPT_URL, url.c_str());
  curl_easy_setopt(easy, CURLOPT_PROTOCOLS_STR, "http,https");
  curl_easy_setopt(easy, CURLOPT_USERAGENT, UserAgent().c_str());
  if (const char* const authorities = std::getenv("SSL_CERT_FILE")) curl_easy_setopt(easy, CURLOPT_CAINFO, authorities);
  curl_easy_setopt(easy, CURLOPT_NOSIGNAL, 1L);
  curl_easy_setopt(easy, CURLOPT_QUICK_EXIT, 1L);  // the end of a transfer does not wait for a name that is still looked for
  // One connection for all, if the server speaks HTTP/2, which it says when the connection is encrypted.
  curl_easy_setopt(easy, CURLOPT_PIPEWAIT, url.starts_with("https:") ? 1L : 0L);
  curl_easy_setopt(easy, CURLOPT_CONNECTTIMEOUT_MS, long(std::chrono::ceil<milliseconds>(timing.connecting).count()));
  curl_easy_setopt(easy, CURLOPT_LOW_SPEED_LIMIT, 1L);
  curl_easy_setopt(easy, CURLOPT_LOW_SPEED_TIME, long(std::chrono::ceil<seconds>(timing.stalled).count()));
  curl_easy_setopt(easy, CURLOPT_ERRORBUFFER, reason);
  curl_easy_setopt(easy, CURLOPT_HEADERFUNCTION, TakeHead);
  curl_easy_setopt(easy, CURLOPT_HEADERDATA, this);
  curl_easy_setopt(easy, CURLOPT_WRITEFUNCTION, TakeBody);
  curl_easy_setopt(easy, CURLOPT_WRITEDATA, this);
  curl_easy_setopt(easy, CURLOPT_NOPROGRESS, 0L);
  curl_easy_setopt(easy, CURLOPT_XFERINFOFUNCTION, TakeProgress);
  curl_easy_setopt(easy, CURLOPT_XFERINFODATA, this);
  curl_easy_setopt(easy, CURLOPT_OPENSOCKETFUNCTION, OpenSocket);
  curl_easy_setopt(easy, CURLOPT_OPENSOCKETDATA, this);
  curl_easy_setopt(easy, CURLOPT_PREREQFUNCTION, CheckPlace);
  curl_easy_setopt(easy, CURLOPT_PREREQDATA, this);
  curl_easy_setopt(easy, CURLOPT_NOBODY, get.only_size && !reads_start ? 1L : 0L);
  if (get.span) {
    curl_easy_setopt(easy, CURLOPT_RANGE, fmt::format("{}-{}", get.span->begin, get.span->begin + get.span->bytes - 1).c_str());
  } else if (!as_sent && !NamesCompressed(get.url)) {
    // Nothing encoded is asked for, but what comes encoded all the same is decoded. Parts of it would be no parts of the object.
    curl_easy_setopt(easy, CURLOPT_ACCEPT_ENCODING, "");
    AddHeader("Accept-Encoding:");
  }
  if (!get.known.empty()) AddHeader("If-None-Match: " + get.known);
  if (get.access != nullptr && trusted()) {
    for (const std::string& line : get.access->headers) AddHeader(line);
    if (get.access->s3) Sign(*get.access->s3);
  }
  curl_easy_setopt(easy, CURLOPT_HTTPHEADER, headers.get());
}

// Signature version 4 of Amazon Web Services. libcurl 7.88 leaves the header with the payload's digest to us.
void Transfer::Sign(const S3Access& s3) {
  curl_easy_setopt(easy, CURLOPT_AWS_SIGV4, fmt::format("aws:amz:{}:s3", region.empty() ? s3.region : region).c_str());
  curl_easy_setopt(easy, CURLOPT_USERNAME, s3.key.c_str());
  curl_easy_setopt(easy, CURLOPT_PASSWORD, s3.secret.c_str());
  AddHeader("x-amz-content-sha256: UNSIGNED-PAYLOAD");
  if (!s3.token.empty()) AddHeader("x-amz-security-token: " + s3.token);
}

void Transfer::AddHeader(const std::string& line) { headers.reset(curl_slist_append(headers.release(), line.c_str())); }

bool Transfer::OnHead(std::uint64_t bytes) {
  *heard_bytes += bytes;
  head_bytes += bytes;
  if (head_bytes > HttpTransfers::kMostOfHead)
    stopped = Status::Unavailable(fmt::format("the server sends more than {} bytes of headers", HttpTransfers::kMostOfHead));
  return !stopped;
}

bool Transfer::OnBody(std::span<const std::byte> bytes) {
  *heard_bytes += bytes.size();
  const long code = status();
  if (code != 200 && code != 206) {
    page_bytes += bytes.size();
    page.append(reinterpret_cast<const char*>(bytes.data()), std::min(bytes.size(), kKeptOfPage - page.size()));
    if (page_bytes > HttpTransfers::kMostOfPage)
      stopped = Status::Unavailable(fmt::format("HTTP {}, with a page of more than {} bytes", code, HttpTransfers::kMostOfPage));
    return !stopped;
  }
  // A server that sends whole objects alone may be asked for an object that is no longer than the part.
  const std::uint64_t said = is_encoded() ? 0 : length().value_or(0), least = std::max<std::uint64_t>(body.size() + bytes.size(), said);
  if (get.span && code == 200 && (get.span->begin > 0 || least > get.span->bytes)) {
    stopped = Status::Unavailable("the server sends whole objects alone, no parts of them");
  } else if (least > get.most) {
    stopped = Status::ResourceExhausted(fmt::format("has more than {} bytes", get.most));
  } else {
    try {
      if (body.empty()) body.reserve(std::max<std::size_t>(said, bytes.size()));
      body.insert(body.end(), bytes.begin(), bytes.end());
    } catch (const std::bad_alloc&) {
      stopped = Status::ResourceExhausted("no memory for it");
    }
  }
  return !stopped;
}

bool Transfer::OnProgress(std::uint64_t bytes) {
  const Time now = MonotonicNow();
  if (now >= asked_wanted + HttpTransfers::kLookAtWanted && !IsWanted()) return false;
  if (now < begun + patience) return true;
  const auto in_seconds = [](Duration time) { return std::uint64_t(std::chrono::duration_cast<seconds>(time).count()); };
  if (bytes > in_seconds(now - tried) * HttpTransfers::kLeastBytes) return true;
  stopped = Status::Unavailable(fmt::format("no answer from {} within {} s, or less than {} bytes a second; {} {}", host,
                                            in_seconds(patience), HttpTransfers::kLeastBytes, tries, tries == 1 ? "try" : "tries"));
  return false;
}

bool Transfer::OnPlace(const std::string& address) {
  const auto shown = [](const std::string& each) { return fmt::format("{}, which is an address of {}", each, ToString(ReachOf(each))); };
  if (elsewhere()) {
    if (MayLead(ReachOf(led_by), ReachOf(address))) return true;
    stopped =
        Status::Unavailable(fmt::format("leads to {}, which is an address of {} and was not named", host, ToString(ReachOf(address))));
  } else {
    if (first_place == nullptr || first_place->empty() || MayMove(*first_place, address)) return true;
    stopped = Status::Unavailable(fmt::format("{} is now at {}; at first it was at {}", host, shown(address), shown(*first_place)));
  }
  return false;
}

bool Transfer::OnConnection(const std::string& address) {
  if (!OnPlace(address)) return false;
  stopped.reset();  // another address of the name was refused
  if (first_place != nullptr && first_place->empty()) *first_place = address;
  return true;
}

}  // namespace slabstream
