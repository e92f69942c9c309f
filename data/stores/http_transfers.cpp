#include "data/stores/http_transfers.h"

#include <arpa/inet.h>
#include <curl/curl.h>
#include <fmt/format.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <algorithm>
#include <atomic>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <deque>
#include <iterator>
#include <mutex>
#include <random>
#include <ranges>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include "common/base/check.h"
#include "common/base/log.h"
#include "common/base/parse_number.h"
#include "common/base/pooled_vector.h"
#include "common/base/printable.h"
#include "common/base/version.h"

namespace slabstream {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr int kMostRedirects = 5;

std::atomic<bool> process_asks = false;  // of HttpTransfers::OfProcess

std::string PartOf(const std::string& url, CURLUPart part, unsigned flags = 0) {
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

// What only this machine or its link sees.
bool IsLocal(const sockaddr* address) {
  const auto is_local_v4 = [](std::uint32_t host_order) {
    return host_order >> 24 == 127 || host_order >> 24 == 0 || host_order >> 16 == 0xA9FE;  // 127/8, 0/8, 169.254/16
  };
  if (address->sa_family == AF_INET) {
    sockaddr_in v4{};
    std::memcpy(&v4, address, sizeof v4);
    return is_local_v4(ntohl(v4.sin_addr.s_addr));
  }
  if (address->sa_family != AF_INET6) return true;
  sockaddr_in6 v6{};
  std::memcpy(&v6, address, sizeof v6);
  const in6_addr& at = v6.sin6_addr;
  if (IN6_IS_ADDR_V4MAPPED(&at) || IN6_IS_ADDR_V4COMPAT(&at)) {
    std::uint32_t v4 = 0;
    std::memcpy(&v4, at.s6_addr + 12, sizeof v4);
    return is_local_v4(ntohl(v4));
  }
  return IN6_IS_ADDR_LOOPBACK(&at) || IN6_IS_ADDR_LINKLOCAL(&at) || IN6_IS_ADDR_UNSPECIFIED(&at);
}

bool MayPass(long status) { return status == 408 || status == 429 || status == 500 || status == 502 || status == 503 || status == 504; }

bool MayPass(CURLcode code) {
  switch (code) {
    case CURLE_COULDNT_CONNECT:
    case CURLE_OPERATION_TIMEDOUT:
    case CURLE_PARTIAL_FILE:
    case CURLE_GOT_NOTHING:
    case CURLE_SEND_ERROR:
    case CURLE_RECV_ERROR:
    case CURLE_SSL_CONNECT_ERROR:
    case CURLE_HTTP2:
    case CURLE_HTTP2_STREAM: return true;
    default: return false;
  }
}

// What Retry-After says: seconds, or a date.
seconds SecondsUntil(const std::string& text) {
  constexpr std::uint64_t kMost = 1'000'000;
  if (const std::optional<std::uint64_t> number = ParseNumber<std::uint64_t>(text)) return seconds(std::min(*number, kMost));
  const std::time_t date = curl_getdate(text.c_str(), nullptr), now = std::time(nullptr);
  return seconds(date > now ? std::min(std::uint64_t(date - now), kMost) : 0);
}

// Who waits for an answer, and for which bytes of it.
struct Asker {
  std::optional<ByteSpan> span;  // of the object; none: all of it
  HttpTransfers::Done done;
};

// One request, from its first try to its end.
struct Transfer {
  HttpGet get;
  std::vector<Asker> askers;  // one, or several whose spans get.span covers
  std::string url;            // that is asked now: of the request, or where a redirect led
  std::string host;
  int tries = 0, redirects = 0;
  Time begun;  // the first try

  // Of the present try.
  Time tried;
  CURL* easy = nullptr;
  PooledVector<std::byte> body;
  std::optional<Status> stopped;  // by us, and why
  char reason[CURL_ERROR_SIZE] = {};
  std::unique_ptr<curl_slist, void (*)(curl_slist*)> headers{nullptr, curl_slist_free_all};

  bool elsewhere() const { return PartOf(url, CURLUPART_HOST) != PartOf(get.url, CURLUPART_HOST); }
  long status() const {
    long code = 0;
    curl_easy_getinfo(easy, CURLINFO_RESPONSE_CODE, &code);
    return code;
  }
  std::uint64_t length() const {  // that the server said
    curl_off_t bytes = -1;
    curl_easy_getinfo(easy, CURLINFO_CONTENT_LENGTH_DOWNLOAD_T, &bytes);
    return bytes < 0 ? 0 : std::uint64_t(bytes);
  }

  // Whether `other`, which waits, may go along with this one, which begins.
  bool TakesAlong(const Transfer& other) const {
    const auto is_plain = [](const Transfer& each) {
      return each.get.span && !each.get.only_size && each.tries == 0 && each.redirects == 0;
    };
    if (!is_plain(*this) || !is_plain(other) || get.url != other.get.url) return false;
    if (get.known != other.get.known || get.access != other.get.access) return false;
    const std::uint64_t end = get.span->begin + get.span->bytes, other_end = other.get.span->begin + other.get.span->bytes;
    return other.get.span->begin >= end && other.get.span->begin - end <= HttpTransfers::kMostBetween &&
           other_end - get.span->begin <= HttpTransfers::kMostTogether;
  }
  void TakeAlong(Transfer other) {
    get.span->bytes = other.get.span->begin + other.get.span->bytes - get.span->begin;
    get.most = get.span->bytes;
    std::ranges::move(other.askers, std::back_inserter(askers));
  }

  // The value of a header of the answer; empty: there is none.
  std::string header(const char* name) const {
    curl_header* found = nullptr;
    return curl_easy_header(easy, name, 0, CURLH_HEADER, -1, &found) == CURLHE_OK ? found->value : "";
  }

  bool OnBody(std::span<const std::byte> bytes) {
    const long code = status();
    if (code != 200 && code != 206) return true;  // a page about what is wrong
    // A server that sends whole objects alone may be asked for an object that is no longer than the part.
    const std::uint64_t least = std::max<std::uint64_t>(body.size() + bytes.size(), length());
    if (get.span && code == 200 && (get.span->begin > 0 || least > get.span->bytes)) {
      stopped = Status::Unavailable("the server sends whole objects alone, no parts of them");
    } else if (least > get.most) {
      stopped = Status::ResourceExhausted(fmt::format("has more than {} bytes", get.most));
    } else {
      try {
        if (body.empty()) body.reserve(std::max<std::size_t>(length(), bytes.size()));
        body.insert(body.end(), bytes.begin(), bytes.end());
      } catch (const std::bad_alloc&) {
        stopped = Status::ResourceExhausted("no memory for it");
      }
    }
    return !stopped;
  }
};

std::size_t TakeBody(char* data, std::size_t, std::size_t bytes, void* transfer) {
  return static_cast<Transfer*>(transfer)->OnBody(std::as_bytes(std::span(data, bytes))) ? bytes : 0;
}
curl_socket_t OpenSocket(void* data, curlsocktype, curl_sockaddr* address) {
  auto& transfer = *static_cast<Transfer*>(data);
  if (transfer.elsewhere() && IsLocal(&address->addr)) {
    transfer.stopped = Status::Unavailable(fmt::format("leads to {}, which is an address of this machine or its link", transfer.host));
    return CURL_SOCKET_BAD;
  }
  return ::socket(address->family, address->socktype | SOCK_CLOEXEC, address->protocol);
}

}  // namespace

struct HttpTransfers::Impl {
  explicit Impl(const Timing& timing_) : timing(timing_) {
    static const CURLcode started = curl_global_init(CURL_GLOBAL_DEFAULT);
    CHECK_EQ(int(started), int(CURLE_OK));
    multi = curl_multi_init();
    CHECK(multi != nullptr) << "no memory for transfers";
    thread = std::jthread([this](const std::stop_token& stop) { Run(stop); });
  }
  ~Impl() {
    thread.request_stop();
    curl_multi_wakeup(multi);
    thread.join();
    curl_multi_cleanup(multi);
  }

  using Owned = std::unique_ptr<Transfer>;
  struct Host {
    std::deque<Owned> waiting;
    std::map<CURL*, Owned> active;
  };

  const Timing timing;
  CURLM* multi = nullptr;
  mutable std::mutex mutex;  // guards the next two
  std::vector<Owned> asked;
  std::map<std::string, WebTraffic> traffic;  // by server
  // The thread's own.
  std::map<std::string, Host> hosts;
  std::multimap<Time, Owned> paused;
  std::vector<CURL*> idle;  // to be used again
  std::minstd_rand random{std::random_device{}()};
  std::jthread thread;

  void Run(const std::stop_token& stop) {
    while (!stop.stop_requested()) {
      TakeAsked();
      for (const Time now = MonotonicNow(); !paused.empty() && paused.begin()->first <= now;)
        Wait(std::move(paused.extract(paused.begin()).mapped()));
      for (auto& [name, host] : hosts) {
        while (!host.waiting.empty() && host.active.size() < kMostOfAHost) Start(host);
      }
      int running = 0;
      curl_multi_perform(multi, &running);
      bool ended = false;
      for (int left = 0; const CURLMsg* const message = curl_multi_info_read(multi, &left);) {
        if (message->msg != CURLMSG_DONE) continue;
        End(message->easy_handle, message->data.result);
        ended = true;
      }
      if (ended) continue;  // others may begin
      const Duration until = paused.empty() ? Duration(seconds(1)) : paused.begin()->first - MonotonicNow();
      const auto wait = std::clamp<Duration>(until, Duration(0), seconds(1));
      curl_multi_poll(multi, nullptr, 0, int(std::chrono::ceil<milliseconds>(wait).count()), nullptr);
    }
    DropAll();
  }

  void TakeAsked() {
    std::vector<Owned> taken;
    {
      const std::lock_guard lock(mutex);
      taken.swap(asked);
    }
    for (Owned& transfer : taken) Wait(std::move(transfer));
  }

  void Wait(Owned transfer) { hosts[transfer->host].waiting.push_back(std::move(transfer)); }

  void Start(Host& host) {
    Owned owned = std::move(host.waiting.front());
    host.waiting.pop_front();
    Transfer& transfer = *owned;
    for (auto other = host.waiting.begin(); other != host.waiting.end();) {
      if (transfer.TakesAlong(**other)) {
        transfer.TakeAlong(std::move(**other));
        host.waiting.erase(other);
        other = host.waiting.begin();
      } else {
        ++other;
      }
    }
    transfer.tried = MonotonicNow();
    if (++transfer.tries == 1) transfer.begun = transfer.tried;
    CURL* easy = idle.empty() ? curl_easy_init() : idle.back();
    if (easy == nullptr) return Answer(std::move(owned), Status::ResourceExhausted(transfer.url + ": no memory to ask for it"));
    if (!idle.empty()) idle.pop_back();
    transfer.easy = easy;
    transfer.body = {};
    transfer.stopped.reset();
    transfer.reason[0] = 0;
    curl_easy_setopt(easy, CURLOPT_PRIVATE, &transfer);
    curl_easy_setopt(easy, CURLOPT_URL, transfer.url.c_str());
    curl_easy_setopt(easy, CURLOPT_PROTOCOLS_STR, "http,https");
    curl_easy_setopt(easy, CURLOPT_USERAGENT, UserAgent().c_str());
    if (const char* const authorities = std::getenv("SSL_CERT_FILE")) curl_easy_setopt(easy, CURLOPT_CAINFO, authorities);
    curl_easy_setopt(easy, CURLOPT_NOSIGNAL, 1L);
    curl_easy_setopt(easy, CURLOPT_PIPEWAIT, 1L);  // one connection for all, if the server speaks HTTP/2
    curl_easy_setopt(easy, CURLOPT_CONNECTTIMEOUT_MS, long(std::chrono::ceil<milliseconds>(timing.connecting).count()));
    curl_easy_setopt(easy, CURLOPT_LOW_SPEED_LIMIT, 1L);
    curl_easy_setopt(easy, CURLOPT_LOW_SPEED_TIME, long(std::chrono::ceil<seconds>(timing.stalled).count()));
    curl_easy_setopt(easy, CURLOPT_ERRORBUFFER, transfer.reason);
    curl_easy_setopt(easy, CURLOPT_WRITEFUNCTION, TakeBody);
    curl_easy_setopt(easy, CURLOPT_WRITEDATA, &transfer);
    curl_easy_setopt(easy, CURLOPT_OPENSOCKETFUNCTION, OpenSocket);
    curl_easy_setopt(easy, CURLOPT_OPENSOCKETDATA, &transfer);
    curl_easy_setopt(easy, CURLOPT_NOBODY, transfer.get.only_size ? 1L : 0L);
    if (transfer.get.span) {
      const ByteSpan& span = *transfer.get.span;
      curl_easy_setopt(easy, CURLOPT_RANGE, fmt::format("{}-{}", span.begin, span.begin + span.bytes - 1).c_str());
    }
    transfer.headers.reset();
    if (!transfer.get.known.empty()) AddHeader(transfer, "If-None-Match: " + transfer.get.known);
    if (transfer.get.access != nullptr && !transfer.elsewhere()) Sign(transfer);
    curl_easy_setopt(easy, CURLOPT_HTTPHEADER, transfer.headers.get());
    host.active.emplace(easy, std::move(owned));
    curl_multi_add_handle(multi, easy);
  }

  // Signature version 4 of Amazon Web Services. libcurl 7.88 leaves the header with the payload's digest to us.
  static void Sign(Transfer& transfer) {
    const S3Access& access = *transfer.get.access;
    curl_easy_setopt(transfer.easy, CURLOPT_AWS_SIGV4, fmt::format("aws:amz:{}:s3", access.region).c_str());
    curl_easy_setopt(transfer.easy, CURLOPT_USERNAME, access.key.c_str());
    curl_easy_setopt(transfer.easy, CURLOPT_PASSWORD, access.secret.c_str());
    AddHeader(transfer, "x-amz-content-sha256: UNSIGNED-PAYLOAD");
    if (!access.token.empty()) AddHeader(transfer, "x-amz-security-token: " + access.token);
  }

  static void AddHeader(Transfer& transfer, const std::string& line) {
    transfer.headers.reset(curl_slist_append(transfer.headers.release(), line.c_str()));
  }

  static const std::string& UserAgent() {
    static const std::string agent = fmt::format("slabstream/{}", Version());
    return agent;
  }

  void End(CURL* easy, CURLcode code) {
    Transfer* asked_for = nullptr;
    curl_easy_getinfo(easy, CURLINFO_PRIVATE, &asked_for);
    Transfer& transfer = *asked_for;
    Owned owned = std::move(hosts.at(transfer.host).active.extract(easy).mapped());
    Count(transfer.host, [&](WebTraffic& count) {
      ++count.requests;
      count.retries += transfer.tries > 1 ? 1 : 0;
      count.unchanged += transfer.status() == 304 ? 1 : 0;
      count.bytes += transfer.body.size();
      count.milliseconds += std::uint64_t(std::chrono::duration_cast<milliseconds>(MonotonicNow() - transfer.tried).count());
    });
    curl_multi_remove_handle(multi, easy);
    Decide(std::move(owned), code);  // which asks the handle, and may be the end of the transfer
    curl_easy_reset(easy);
    idle.push_back(easy);
  }

  // Answers, follows a redirect, or tries again later. The transfer's handle is still there.
  void Decide(Owned owned, CURLcode code) {
    Transfer& transfer = *owned;
    const auto fail = [&](StatusCode kind, const std::string& why) { Fail(std::move(owned), kind, why); };
    if (transfer.stopped) return fail(transfer.stopped->code(), transfer.stopped->message());
    const long status = transfer.status();
    if (code != CURLE_OK) {
      const std::string why = transfer.reason[0] != 0 ? transfer.reason : curl_easy_strerror(code);
      return MayPass(code) ? Again(std::move(owned), why) : fail(StatusCode::kUnavailable, why);
    }
    const std::string http = fmt::format("HTTP {}", status);
    if (status == 304 && !transfer.get.known.empty()) {
      return Answer(std::move(owned), HttpObject{.version = transfer.get.known, .unchanged = true});
    }
    if (status >= 300 && status < 400) return Redirect(std::move(owned), http);
    if (status == 404 || status == 410) return fail(StatusCode::kNotFound, "does not exist (" + http + ")");
    if (MayPass(status)) return Again(std::move(owned), http);
    HttpObject object{.bytes = {}, .size = transfer.length(), .version = transfer.header("ETag")};
    if (object.version.empty()) object.version = transfer.header("Last-Modified");
    const std::string content_range = transfer.header("Content-Range");
    const std::string_view range = content_range;
    const std::size_t slash = range.find('/');
    if (transfer.get.span && slash != std::string_view::npos) object.size = ParseNumber<std::uint64_t>(range.substr(slash + 1)).value_or(0);
    if (status == 416 && transfer.get.span) return Answer(std::move(owned), std::move(object));  // it ends before the part begins
    if (status != 200 && status != 206) return fail(StatusCode::kUnavailable, http);
    if (transfer.get.span && status == 206) {
      const std::size_t space = range.find(' '), dash = range.find('-');
      const bool states = range.starts_with("bytes ") && dash != std::string_view::npos && dash > space && slash > dash;
      const auto begin = states ? ParseNumber<std::uint64_t>(range.substr(space + 1, dash - space - 1)) : std::nullopt;
      const bool right = begin == transfer.get.span->begin && transfer.body.size() <= transfer.get.span->bytes;
      if (!right) {
        return fail(StatusCode::kDataLoss, fmt::format("bytes from {} on were asked for, but '{}' came", transfer.get.span->begin, range));
      }
    } else if (!transfer.get.only_size) {
      object.size = transfer.body.size();
    }
    object.bytes = Bytes(std::move(transfer.body));
    Answer(std::move(owned), std::move(object));
  }

  void Redirect(Owned owned, const std::string& http) {
    Transfer& transfer = *owned;
    const auto fail = [&](const std::string& why) { Fail(std::move(owned), StatusCode::kUnavailable, why); };
    const char* target = nullptr;
    curl_easy_getinfo(transfer.easy, CURLINFO_REDIRECT_URL, &target);
    if (target == nullptr) return fail(http + ", which leads nowhere");
    const std::string url = target, scheme = PartOf(url, CURLUPART_SCHEME);
    if (scheme != "https" && (scheme != "http" || transfer.url.starts_with("https:"))) {
      return fail(fmt::format("leads to a {} address, which is not followed", scheme.empty() ? "strange" : scheme));
    }
    if (++transfer.redirects > kMostRedirects) return fail(fmt::format("leads on more than {} times", kMostRedirects));
    transfer.url = url;
    transfer.host = HostAndPort(url);
    --transfer.tries;
    Wait(std::move(owned));
  }

  void Again(Owned owned, const std::string& why) {
    Transfer& transfer = *owned;
    Duration pause = timing.first_pause * (1 << (transfer.tries - 1));
    pause -= Duration(std::uniform_int_distribution<Duration::rep>(0, pause.count() / 2)(random));
    const std::string retry_after = transfer.header("Retry-After");
    const Duration asked_for = SecondsUntil(retry_after);
    const Time next = MonotonicNow() + std::max(pause, asked_for);
    if (transfer.tries == timing.tries || asked_for > kLongestPause || next > transfer.begun + kPatience) {
      const std::string waits = asked_for > kLongestPause ? fmt::format("; the server says to come back in {} s", retry_after) : "";
      return Fail(std::move(owned), StatusCode::kUnavailable,
                  fmt::format("{}, {} {}{}", why, transfer.tries, transfer.tries == 1 ? "try" : "tries", waits));
    }
    LogDebug(fmt::format("{}: {}; asks again", transfer.get.url, why));
    paused.emplace(next, std::move(owned));
  }

  void Fail(Owned owned, StatusCode code, const std::string& why) {
    Status status = Printable(Status(code, fmt::format("{}: {}", owned->get.url, why)));
    Answer(std::move(owned), std::move(status));
  }

  void Answer(Owned owned, Result<HttpObject> answer) {
    // That an object is not there is an answer: volumes leave out chunks that hold nothing.
    if (!answer.ok() && answer.status().code() != StatusCode::kNotFound) Count(owned->host, [](WebTraffic& count) { ++count.failures; });
    for (Asker& asker : owned->askers) {
      if (!answer.ok() || owned->askers.size() == 1) {
        asker.done(answer);
        continue;
      }
      HttpObject part = *answer;
      const std::uint64_t begin = std::min<std::uint64_t>(asker.span->begin - owned->get.span->begin, part.bytes.size());
      part.bytes = part.bytes.Part(begin, std::min<std::uint64_t>(asker.span->bytes, part.bytes.size() - begin));
      asker.done(std::move(part));
    }
  }

  template <class Change>
  void Count(const std::string& host, Change&& change) {
    const std::lock_guard lock(mutex);
    WebTraffic& count = traffic[host];
    count.server = host;
    change(count);
  }

  void DropAll() {
    TakeAsked();
    for (auto& [at, transfer] : paused) Wait(std::move(transfer));
    for (auto& [name, host] : hosts) {
      for (auto& [easy, transfer] : host.active) {
        curl_multi_remove_handle(multi, easy);
        curl_easy_cleanup(easy);
        host.waiting.push_back(std::move(transfer));
      }
      for (Owned& transfer : host.waiting) {
        for (Asker& asker : transfer->askers) asker.done(Status::Cancelled(transfer->get.url + ": the program ends"));
      }
    }
    for (CURL* const easy : idle) curl_easy_cleanup(easy);
  }
};

HttpTransfers& HttpTransfers::OfProcess() {
  process_asks = true;
  static HttpTransfers& transfers = *new HttpTransfers(Timing{});
  return transfers;
}

std::vector<WebTraffic> HttpTransfers::TrafficOfProcess() {
  if (!process_asks) return {};
  return OfProcess().traffic();
}

HttpTransfers::HttpTransfers(const Timing& timing) : impl_(std::make_unique<Impl>(timing)) {}
HttpTransfers::~HttpTransfers() = default;

void HttpTransfers::Get(HttpGet get, Done done) {
  auto transfer = std::make_unique<Transfer>();
  transfer->url = get.url;
  transfer->host = HostAndPort(get.url);
  transfer->get = std::move(get);
  transfer->askers.push_back({transfer->get.span, std::move(done)});
  {
    const std::lock_guard lock(impl_->mutex);
    impl_->asked.push_back(std::move(transfer));
  }
  curl_multi_wakeup(impl_->multi);
}

std::vector<WebTraffic> HttpTransfers::traffic() const {
  const std::lock_guard lock(impl_->mutex);
  std::vector<WebTraffic> all;
  for (const auto& [server, traffic] : impl_->traffic | std::views::take(kMaxWebServers)) all.push_back(traffic);
  return all;
}

}  // namespace slabstream
