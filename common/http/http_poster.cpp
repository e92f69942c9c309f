#include "common/http/http_poster.h"

#include <curl/curl.h>
#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cstring>
#include <utility>

#include "common/base/check.h"

namespace slabstream {
namespace {

using Easy = std::unique_ptr<CURL, void (*)(CURL*)>;
using Headers = std::unique_ptr<curl_slist, void (*)(curl_slist*)>;

// libcurl calls it with the next bytes of the answer. Fewer than these: they end the exchange.
std::size_t Append(const char* bytes, std::size_t, std::size_t size, void* to) {
  std::string& body = *static_cast<std::string*>(to);
  if (body.size() + size > HttpPoster::kMostAnswerBytes) return 0;
  body.append(bytes, size);
  return size;
}

std::string WhyNot(CURL* easy, CURLcode result, const char* reason) {
  long error = 0;
  if (result == CURLE_COULDNT_CONNECT) curl_easy_getinfo(easy, CURLINFO_OS_ERRNO, &error);
  if (error != 0) return std::strerror(int(error));
  if (result == CURLE_WRITE_ERROR) return fmt::format("the answer is longer than {} bytes", HttpPoster::kMostAnswerBytes);
  return *reason != '\0' ? reason : curl_easy_strerror(result);
}

}  // namespace

struct HttpPoster::Impl {
  Impl() {
    static const CURLcode started = curl_global_init(CURL_GLOBAL_DEFAULT);
    CHECK_EQ(int(started), int(CURLE_OK));
    multi = curl_multi_init();
    CHECK(multi != nullptr) << "no memory for requests";
  }
  ~Impl() { curl_multi_cleanup(multi); }

  // Works on the one exchange until it ends. False: the time has come first.
  bool Run(Time begin, Duration time, Time& end) {
    for (int running = 1; running > 0;) {
      end = std::min(begin + time, limit.load());
      const Duration left = end - MonotonicNow();
      if (left <= Duration::zero()) return false;
      curl_multi_perform(multi, &running);
      // Longer than it takes: EndBy wakes it up.
      constexpr auto kMost = std::chrono::milliseconds(std::chrono::hours(1));
      const auto wait = std::min(kMost, std::chrono::ceil<std::chrono::milliseconds>(left));
      if (running > 0) curl_multi_poll(multi, nullptr, 0, int(wait.count()), nullptr);
    }
    return true;
  }

  CURLM* multi = nullptr;
  std::atomic<Time> limit{Time::max()};
};

HttpPoster::HttpPoster(HttpUrl url) : url_(std::move(url)), impl_(std::make_unique<Impl>()) {}
HttpPoster::~HttpPoster() = default;

Result<HttpAnswer> HttpPoster::Post(std::string_view type, const std::string& body, Duration time) {
  const Time begin = MonotonicNow();
  const Easy easy(curl_easy_init(), curl_easy_cleanup);
  Headers headers(curl_slist_append(nullptr, fmt::format("Content-Type: {}", type).c_str()), curl_slist_free_all);
  if (easy == nullptr || headers == nullptr) return Status::ResourceExhausted("no memory for a request");
  curl_slist_append(headers.get(), "Expect:");  // the body leaves at once
  HttpAnswer answer;
  char reason[CURL_ERROR_SIZE] = {};
  const auto set = [&](CURLoption option, auto value) { CHECK_EQ(int(curl_easy_setopt(easy.get(), option, value)), int(CURLE_OK)); };
  set(CURLOPT_URL, ToString(url_).c_str());
  set(CURLOPT_PATH_AS_IS, 1L);
  set(CURLOPT_NOPROXY, "*");
  set(CURLOPT_NOSIGNAL, 1L);
  set(CURLOPT_QUICK_EXIT, 1L);  // nobody waits for a name that is still looked up
  set(CURLOPT_FORBID_REUSE, 1L);
  set(CURLOPT_USERAGENT, "slabstream");
  set(CURLOPT_HTTPHEADER, headers.get());
  set(CURLOPT_POSTFIELDSIZE_LARGE, curl_off_t(body.size()));
  set(CURLOPT_POSTFIELDS, body.data());
  set(CURLOPT_WRITEFUNCTION, Append);
  set(CURLOPT_WRITEDATA, static_cast<void*>(&answer.body));
  set(CURLOPT_ERRORBUFFER, reason);

  curl_multi_add_handle(impl_->multi, easy.get());
  Time end;
  const bool ended = impl_->Run(begin, time, end);
  int left = 0;
  const CURLMsg* const message = curl_multi_info_read(impl_->multi, &left);
  const CURLcode result = message != nullptr ? message->data.result : CURLE_OK;
  curl_multi_remove_handle(impl_->multi, easy.get());
  if (!ended) {
    const double allowed = std::chrono::duration<double>(std::max(end - begin, Duration::zero())).count();
    return Status::DeadlineExceeded(fmt::format("{} has not answered within {:.1f} s", HostOf(url_), allowed));
  }
  if (result != CURLE_OK) return Status::Unavailable(fmt::format("{}: {}", HostOf(url_), WhyNot(easy.get(), result, reason)));
  long status = 0;
  curl_easy_getinfo(easy.get(), CURLINFO_RESPONSE_CODE, &status);
  answer.status = unsigned(status);
  return answer;
}

void HttpPoster::EndBy(Time limit) {
  impl_->limit = limit;
  curl_multi_wakeup(impl_->multi);
}

}  // namespace slabstream
