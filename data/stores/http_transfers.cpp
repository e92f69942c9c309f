#include "data/stores/http_transfers.h"

#include <curl/curl.h>
#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cctype>
#include <ctime>
#include <deque>
#include <iterator>
#include <map>
#include <mutex>
#include <random>
#include <ranges>
#include <set>
#include <string_view>
#include <thread>
#include <utility>

#include "common/base/check.h"
#include "common/base/log.h"
#include "common/base/printable.h"
#include "common/text/parse_number.h"
#include "common/text/trimmed.h"
#include "common/threads/stop_signals.h"
#include "data/stores/address_reach.h"
#include "data/stores/transfer.h"

namespace slabstream {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr int kMostRedirects = 5;

std::atomic<bool> process_asks = false;  // of HttpTransfers::OfProcess

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

// The beginning of the path: of a store, and often of a bucket.
std::string BeginOf(const std::string& url) {
  const std::size_t path = url.find('/', url.find("//") + 2);
  return url.substr(0, path == std::string::npos ? path : url.find('/', path + 1));
}

// Another region than that of which a server of buckets was asked, and in which it says the bucket is; empty: it says none.
std::string OtherRegion(const Transfer& transfer, long status) {
  if (status != 301 && status != 307 && status != 400 && status != 403) return {};
  std::string region = transfer.header("x-amz-bucket-region");
  if (region.empty()) region = transfer.Between("<Region>", "</Region>");
  const auto in_name = [](char c) { return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '-'; };
  constexpr std::size_t kMost = 32;
  if (region.size() > kMost || !std::ranges::all_of(region, in_name)) return {};
  const bool is_signed = transfer.get.access != nullptr && transfer.get.access->s3;
  const std::string& asked = !transfer.region.empty() || !is_signed ? transfer.region : transfer.get.access->s3->region;
  const bool helps = is_signed ? asked != region : InRegion(transfer.url, region) != transfer.url;
  return transfer.region.empty() && transfer.trusted() && helps ? region : "";
}

// "HTTP 403 (AccessDenied)"
std::string Shown(const Transfer& transfer) {
  const std::string code = transfer.Between("<Code>", "</Code>");
  const auto in_code = [](unsigned char c) { return std::isalnum(c) != 0; };
  constexpr std::size_t kMost = 64;
  const bool is_code = !code.empty() && code.size() <= kMost && std::ranges::all_of(code, in_code);
  return fmt::format("HTTP {}{}", transfer.status(), is_code ? fmt::format(" ({})", code) : "");
}

// What answers for a page that is not there, or that wants a password, with a page of its own.
bool IsPage(const Transfer& transfer) {
  if (!transfer.says_html()) return false;
  constexpr std::size_t kMost = 64;
  std::string text(reinterpret_cast<const char*>(transfer.body.data()), std::min(transfer.body.size(), kMost));
  std::ranges::transform(text, text.begin(), [](unsigned char c) { return char(std::tolower(c)); });
  const std::string_view begin = Trimmed(text);
  return begin.starts_with("<!doctype html") || begin.starts_with("<html");
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
    std::size_t open = 0;           // requests: these and those that pause
    Time heard;                     // last time that an answer ended or enough had come, later by what it was not asked since
    std::uint64_t heard_bytes = 0;  // from then on
    Time left_alone;                // since when it is not asked, if nothing is active
    Time asked_again;               // not before, since it was silent
  };

  const Timing timing;
  CURLM* multi = nullptr;
  mutable std::mutex mutex;  // guards the next two
  std::vector<Owned> asked;
  std::map<std::string, WebTraffic> traffic;  // by server
  // The thread's own.
  std::map<std::string, Host> hosts;
  std::multimap<Time, Owned> paused;
  std::map<std::string, std::string> regions;  // by the beginning of the addresses there
  std::set<std::string> headless;              // hosts that do not say by HEAD how long an object is
  std::map<std::string, std::string> places;   // where the names of stores were first reached
  std::vector<CURL*> idle;                     // to be used again
  Time looked = MonotonicNow();                // for silent hosts
  std::minstd_rand random{std::random_device{}()};
  std::jthread thread;

  void Run(const std::stop_token& stop) {
    BlockStopSignals();  // they are for threads that wait for them
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
      LeaveSilentHosts(MonotonicNow());
      const Duration until = paused.empty() ? Duration(seconds(1)) : paused.begin()->first - MonotonicNow();
      const auto wait = std::clamp<Duration>(until, Duration(0), hosts.empty() ? Duration(seconds(1)) : kLookAtWanted);
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
    for (Owned& transfer : taken) {
      Open(transfer->host);
      Wait(std::move(transfer));
    }
  }

  void Open(const std::string& name) {
    Host& host = hosts[name];
    if (host.open++ > 0) return;
    host.heard = host.left_alone = MonotonicNow();
    host.heard_bytes = 0;
  }
  void Close(const std::string& name) { --hosts.at(name).open; }

  void Lead(Transfer& transfer, const std::string& url) {
    Close(transfer.host);
    transfer.Lead(url);
    Open(transfer.host);
  }

  void Wait(Owned transfer) {
    if (const auto region = regions.find(BeginOf(transfer->get.url)); region != regions.end() && transfer->region.empty()) {
      transfer->region = region->second;
      Lead(*transfer, InRegion(transfer->url, transfer->region));
    }
    if (MonotonicNow() < hosts.at(transfer->host).asked_again) return FailSilent(std::move(transfer));
    if (transfer->get.only_size && headless.contains(transfer->host)) transfer->ReadStart();
    hosts[transfer->host].waiting.push_back(std::move(transfer));
  }

  void Start(Host& host) {
    Owned owned = std::move(host.waiting.front());
    host.waiting.pop_front();
    Transfer& transfer = *owned;
    for (auto other = host.waiting.begin(); other != host.waiting.end();) {
      if (transfer.TakesAlong(**other)) {
        transfer.TakeAlong(std::move(**other));
        Close(transfer.host);
        host.waiting.erase(other);
        other = host.waiting.begin();
      } else {
        ++other;
      }
    }
    if (!transfer.IsWanted()) return Fail(std::move(owned), transfer.stopped->code(), transfer.stopped->message());
    CURL* easy = idle.empty() ? curl_easy_init() : idle.back();
    if (easy == nullptr) return Answer(std::move(owned), Status::ResourceExhausted(transfer.get.url + ": no memory to ask for it"));
    if (!idle.empty()) idle.pop_back();
    transfer.Prepare(easy, timing);
    transfer.heard_bytes = &host.heard_bytes;
    const std::string name = PartOf(transfer.url, CURLUPART_HOST);
    transfer.first_place = transfer.elsewhere() || name.starts_with('[') || IsIp(name) ? nullptr : &places[name];
    if (host.active.empty()) host.heard += transfer.tried - host.left_alone;
    host.active.emplace(easy, std::move(owned));
    curl_multi_add_handle(multi, easy);
  }

  void End(CURL* easy, CURLcode code) {
    Transfer* asked_for = nullptr;
    curl_easy_getinfo(easy, CURLINFO_PRIVATE, &asked_for);
    Transfer& transfer = *asked_for;
    Host& host = hosts.at(transfer.host);
    if (code == CURLE_OK) host.heard = MonotonicNow();
    Owned owned = Take(host, easy);
    Decide(std::move(owned), code);  // which asks the handle, and may be the end of the transfer
    curl_easy_reset(easy);
    idle.push_back(easy);
  }

  // Ends a try. The handle still knows what came.
  Owned Take(Host& host, CURL* easy) {
    Owned owned = std::move(host.active.extract(easy).mapped());
    if (host.active.empty()) host.left_alone = MonotonicNow();
    Count(owned->host, [&](WebTraffic& count) {
      ++count.requests;
      count.retries += owned->tries > 1 ? 1 : 0;
      count.unchanged += owned->status() == 304 ? 1 : 0;
      count.bytes += owned->body.size();
      count.milliseconds += std::uint64_t(std::chrono::duration_cast<milliseconds>(MonotonicNow() - owned->tried).count());
    });
    curl_multi_remove_handle(multi, easy);
    return owned;
  }

  void LeaveSilentHosts(Time now) {
    constexpr Duration kStoodStill = seconds(5);  // a process that was stopped has heard nobody
    const Duration since = now - std::exchange(looked, now);
    const std::uint64_t enough = kLeastBytes * std::uint64_t(std::chrono::ceil<seconds>(timing.silence).count());
    for (auto& [name, host] : hosts) {
      if (since > kStoodStill) host.heard += since;
      if (host.heard_bytes >= enough) {
        host.heard = now;
        host.heard_bytes = 0;
      }
      if (!host.active.empty() && now > host.heard + timing.silence) Leave(name, host, now);
    }
    std::erase_if(hosts, [&](const auto& each) { return each.second.open == 0 && now >= each.second.asked_again; });
  }

  void Leave(const std::string& name, Host& host, Time now) {
    host.asked_again = now + timing.rest;
    std::vector<Owned> left;
    while (!host.active.empty()) {
      CURL* const easy = host.active.begin()->first;
      left.push_back(Take(host, easy));
      curl_easy_reset(easy);
      idle.push_back(easy);
    }
    std::ranges::move(host.waiting, std::back_inserter(left));
    host.waiting.clear();
    for (auto each = paused.begin(); each != paused.end();) {
      const auto next = std::next(each);
      if (each->second->host == name) left.push_back(std::move(paused.extract(each).mapped()));
      each = next;
    }
    for (Owned& transfer : left) FailSilent(std::move(transfer));
  }

  void FailSilent(Owned owned) {
    const std::string why = fmt::format("no answer from {} within {} s, or less than {} bytes a second", owned->host,
                                        std::chrono::ceil<seconds>(timing.silence).count(), kLeastBytes);
    Fail(std::move(owned), StatusCode::kUnavailable, why);
  }

  // Answers, follows a redirect, or tries again later. The transfer's handle is still there.
  void Decide(Owned owned, CURLcode code) {
    Transfer& transfer = *owned;
    const auto fail = [&](StatusCode kind, const std::string& why) { Fail(std::move(owned), kind, why); };
    if (transfer.stopped) return fail(transfer.stopped->code(), transfer.stopped->message());
    const long status = transfer.status();
    if (code == CURLE_BAD_CONTENT_ENCODING && !transfer.as_sent) {
      transfer.as_sent = true;
      return Once(std::move(owned));
    }
    if (code != CURLE_OK) {
      const std::string why = transfer.reason[0] != 0 ? transfer.reason : curl_easy_strerror(code);
      return MayPass(code) ? Again(std::move(owned), why) : fail(StatusCode::kUnavailable, why);
    }
    const std::string http = Shown(transfer);
    if (status == 304 && !transfer.get.known.empty()) {
      return Answer(std::move(owned), HttpObject{.version = transfer.get.known, .unchanged = true});
    }
    if (const std::string region = OtherRegion(transfer, status); !region.empty()) {
      regions[BeginOf(transfer.get.url)] = region;
      return Once(std::move(owned));
    }
    if (status >= 300 && status < 400) return Redirect(std::move(owned), http);
    if (status == 404 || status == 410) return fail(StatusCode::kNotFound, "does not exist (" + http + ")");
    if (MayPass(status)) return Again(std::move(owned), http);
    if (transfer.get.only_size && !transfer.reads_start) {
      if (status == 200 && transfer.length() && !transfer.is_encoded() && !transfer.says_html()) {
        return Answer(std::move(owned), HttpObject{.size = *transfer.length(), .version = VersionOf(transfer)});
      }
      if (status != 403 && (status != 200 || !transfer.length())) headless.insert(transfer.host);
      transfer.ReadStart();
      return Once(std::move(owned));
    }
    HttpObject object{.size = transfer.length().value_or(0), .version = VersionOf(transfer)};
    const std::string content_range = transfer.header("Content-Range");
    const std::string_view range = content_range;
    const std::size_t slash = range.find('/');
    const auto total = slash == std::string_view::npos ? std::nullopt : ParseNumber<std::uint64_t>(range.substr(slash + 1));
    if (transfer.get.span && slash != std::string_view::npos) object.size = total.value_or(0);
    if (status == 416 && transfer.get.span) return Answer(std::move(owned), std::move(object));  // it ends before the part begins
    if (status == 403 || status == 204) return Answer(std::move(owned), HttpObject{.instead = http});
    if (status != 200 && status != 206) return fail(StatusCode::kUnavailable, http);
    if (IsPage(transfer)) return Answer(std::move(owned), HttpObject{.instead = "a page of HTML came"});
    if (transfer.get.span && status == 206) {
      const std::size_t space = range.find(' '), dash = range.find('-');
      const bool states = range.starts_with("bytes ") && dash != std::string_view::npos && dash > space && slash > dash;
      const auto begin = states ? ParseNumber<std::uint64_t>(range.substr(space + 1, dash - space - 1)) : std::nullopt;
      const bool right = begin == transfer.get.span->begin && transfer.body.size() <= transfer.get.span->bytes;
      if (!right) {
        return fail(StatusCode::kDataLoss, fmt::format("bytes from {} on were asked for, but '{}' came", transfer.get.span->begin, range));
      }
      if (transfer.reads_start && !total) return fail(StatusCode::kUnavailable, "the server does not say how long it is");
    } else {
      object.size = transfer.body.size();
    }
    if (!transfer.reads_start) object.bytes = Bytes(std::move(transfer.body));
    Answer(std::move(owned), std::move(object));
  }

  // One that is too long to remember for each object tells nothing.
  static std::string VersionOf(const Transfer& transfer) {
    constexpr std::size_t kMost = 512;
    const std::string tag = transfer.header("ETag"), version = tag.empty() ? transfer.header("Last-Modified") : tag;
    return version.size() <= kMost ? version : "";
  }

  // The same request in another way, which counts as the same try.
  void Once(Owned owned) {
    --owned->tries;
    Wait(std::move(owned));
  }

  void Redirect(Owned owned, const std::string& http) {
    Transfer& transfer = *owned;
    const auto fail = [&](const std::string& why) { Fail(std::move(owned), StatusCode::kUnavailable, why); };
    const char* target = nullptr;
    curl_easy_getinfo(transfer.easy, CURLINFO_REDIRECT_URL, &target);
    const std::string region = transfer.header("x-amz-bucket-region");
    if (target == nullptr && !region.empty()) return fail(fmt::format("{}: the bucket is in the region '{}'", http, region));
    if (target == nullptr) return fail(http + ", which leads nowhere");
    const std::string url = target, scheme = PartOf(url, CURLUPART_SCHEME);
    if (scheme != "https" && (scheme != "http" || transfer.url.starts_with("https:"))) {
      return fail(fmt::format("leads to a {} address, which is not followed", scheme.empty() ? "strange" : scheme));
    }
    if (++transfer.redirects > kMostRedirects) return fail(fmt::format("leads on more than {} times", kMostRedirects));
    const char* address = nullptr;
    curl_easy_getinfo(transfer.easy, CURLINFO_PRIMARY_IP, &address);
    transfer.led_by = address == nullptr ? "" : address;
    Lead(transfer, url);
    Once(std::move(owned));
  }

  void Again(Owned owned, const std::string& why) {
    Transfer& transfer = *owned;
    Duration pause = timing.first_pause * (1 << (transfer.tries - 1));
    pause -= Duration(std::uniform_int_distribution<Duration::rep>(0, pause.count() / 2)(random));
    const std::string retry_after = transfer.header("Retry-After");
    const Duration asked_for = SecondsUntil(retry_after);
    const Time next = MonotonicNow() + std::max(pause, asked_for);
    if (transfer.tries == timing.tries || asked_for > kLongestPause || next > transfer.begun + timing.patience) {
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
    const StatusCode code = answer.status().code();
    if (!answer.ok() && code != StatusCode::kNotFound && code != StatusCode::kCancelled)
      Count(owned->host, [](WebTraffic& count) { ++count.failures; });
    Close(owned->host);
    for (Transfer::Asker& asker : owned->askers) {
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
    constexpr std::size_t kMostCounted = 4096;  // a server may lead to any number of others
    const std::lock_guard lock(mutex);
    if (traffic.size() >= kMostCounted && !traffic.contains(host)) return;
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
        for (Transfer::Asker& asker : transfer->askers) asker.done(Status::Cancelled(transfer->get.url + ": the program ends"));
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
  auto transfer = std::make_unique<Transfer>(std::move(get), std::move(done));
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
