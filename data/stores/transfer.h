// Transfer: one request of HttpTransfers, from its first try to its end, and the libcurl handle of the present try.
#pragma once

#include <curl/curl.h>

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/status.h"
#include "common/base/time.h"
#include "common/memory/pooled_vector.h"
#include "data/stores/http_transfers.h"

namespace slabstream {

std::string PartOf(const std::string& url, CURLUPart part, unsigned flags = 0);  // empty: it has no such part
std::string HostAndPort(const std::string& url);
// The address of the same object in another region; the same address if it is none of Amazon's.
std::string InRegion(const std::string& url, const std::string& region);

struct Transfer {
  // Who waits for an answer, and for which bytes of it.
  struct Asker {
    std::optional<ByteSpan> span;  // bytes of the object; none: all of it
    HttpTransfers::Done done;
    std::function<bool()> wanted;
  };

  Transfer(HttpGet what, HttpTransfers::Done done);

  HttpGet get;
  std::vector<Asker> askers;  // one, or several whose spans get.span covers
  std::string url;            // the address that is asked now: the request's, or where a redirect led
  std::string host;
  std::string region;  // the region of its bucket, as far as the server has told; empty: it has told none
  int tries = 0, redirects = 0;
  bool reads_start = false;  // to learn the object's size, if the server does not answer HEAD
  bool as_sent = false;      // a Content-Encoding says nothing true about the bytes
  std::string led_by;        // the address of the server that led here; redirects > 0
  Time begun;                // the first try
  Duration patience{};       // from then on, for a server that sends little or nothing

  // What follows belongs to the present try.
  Time tried;
  Time asked_wanted;  // when it was last found out that it is
  CURL* easy = nullptr;
  PooledVector<std::byte> body;
  std::string page;              // the beginning of an answer that is no object
  std::uint64_t head_bytes = 0;  // bytes of headers and trailers
  std::uint64_t page_bytes = 0;
  std::uint64_t* heard_bytes = nullptr;  // the host's count of all bytes that come
  std::string* first_place = nullptr;    // where the name was first reached; empty: it was not yet; null: the request names an address
  std::optional<Status> stopped;         // by us, and why
  char reason[CURL_ERROR_SIZE] = {};
  std::unique_ptr<curl_slist, void (*)(curl_slist*)> headers{nullptr, curl_slist_free_all};

  bool IsWanted();         // by one of them; else `stopped` says so
  bool elsewhere() const;  // asks another host than the request
  bool trusted() const;    // asks the server of the request, to which alone its headers and its signature go
  long status() const;
  std::optional<std::uint64_t> length() const;                              // bytes of the body, as the server says
  std::string header(const char* name) const;                               // a header of the answer; empty: there is none
  bool is_encoded() const;                                                  // by a Content-Encoding
  bool says_html() const;                                                   // its Content-Type
  std::string Between(std::string_view begin, std::string_view end) const;  // in the page; empty: it has no such part

  // Whether `other`, which waits, may go along with this one, which begins.
  bool TakesAlong(const Transfer& other) const;
  void TakeAlong(Transfer other);
  // Asks for `where` from now on.
  void Lead(std::string where);
  // Asks for the first bytes, whose answer also says how long the object is.
  void ReadStart();
  // Begins a try with this handle.
  void Prepare(CURL* handle, const HttpTransfers::Timing& timing);

  // Each says whether the try goes on; else `stopped` says why it does not.
  bool OnHead(std::uint64_t bytes);
  bool OnBody(std::span<const std::byte> bytes);
  bool OnProgress(std::uint64_t bytes);           // so many have come in this try
  bool OnPlace(const std::string& address);       // where the server is
  bool OnConnection(const std::string& address);  // which is there, and over which the request would go

 private:
  void AddHeader(const std::string& line);
  void Sign(const S3Access& s3);
};

}  // namespace slabstream
