#include "common/http/http_poster.h"

#include <curl/curl.h>
#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cstring>
#include <memory>

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

// libcurl calls it now and then, at least once a second. Not 0: it ends the exchange.
int HasEnded(void* limit, curl_off_t, curl_off_t, curl_off_t, curl_off_t) {
  return int(MonotonicNow() >= static_cast<std::atomic<Time>*>(limit)->load());
}

}  // namespace

Result<HttpAnswer> HttpPoster::Post(std::string_view type, const std::string& body, Duration time) {
  static const CURLcode started = curl_global_init(CURL_GLOBAL_DEFAULT);
  CHECK_EQ(int(started), int(CURLE_OK));
  const Time begin = MonotonicNow();
  const auto too_late = [&] {
    const Duration allowed = std::max(std::min(time, limit_.load() - begin), Duration::zero());
    return Status::DeadlineExceeded(
        fmt::format("{} has not answered within {:.1f} s", HostOf(url_), std::chrono::duration<double>(allowed).count()));
  };
  if (time <= Duration::zero() || limit_.load() <= begin) return too_late();
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
  set(CURLOPT_TIMEOUT_MS, long(std::chrono::ceil<std::chrono::milliseconds>(time).count()));
  set(CURLOPT_NOPROGRESS, 0L);
  set(CURLOPT_XFERINFOFUNCTION, HasEnded);
  set(CURLOPT_XFERINFODATA, static_cast<void*>(&limit_));

  const CURLcode result = curl_easy_perform(easy.get());
  if (result == CURLE_OPERATION_TIMEDOUT || result == CURLE_ABORTED_BY_CALLBACK) return too_late();
  if (result != CURLE_OK) return Status::Unavailable(fmt::format("{}: {}", HostOf(url_), WhyNot(easy.get(), result, reason)));
  long status = 0;
  curl_easy_getinfo(easy.get(), CURLINFO_RESPONSE_CODE, &status);
  answer.status = unsigned(status);
  return answer;
}

}  // namespace slabstream
