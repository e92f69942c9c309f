// HttpTransfers: asks HTTP and HTTPS servers for objects and parts of them, many at a time, on a thread of its own (libcurl). Connections
// are kept for the next request; HTTP/2 sends several requests over one.
//
// What may pass is tried again: no connection, a connection that breaks or stalls, and the answers 408, 429, 500, 502, 503 and 504. Pauses
// double from kFirstPause on, and are drawn between half of that and all of it, so that clients that failed together do not come back
// together. A server that says when to come back (Retry-After) is asked no sooner; if that is later than kLongestPause, the request fails.
//
// How long an object is, HEAD tells; if it does not, the answer to a request for the first bytes. What comes whole with a Content-Encoding
// is decoded, although none is asked for; bytes that do not have the encoding that they are said to have are taken as they come.
//
// A bucket that is in another region than its address or its signatures say, as the server tells, is asked there from then on.
//
// Parts of one object that wait for their turn and lie side by side, such as the chunks of a shard, become one request.
//
// Redirects are followed within HTTP and from HTTP to HTTPS, never back. One that leads to another host may end on the internet, or where
// its own server is: at this machine, or in a private network (address_reach.h). So no server on the internet makes this process ask what
// only this machine sees. The address counts, not the name: each connection to a name that a request has must lead where the first one of
// this process did (MayMove).
//
// A host is silent if, for kSilence, no answer of it ends and it sends less than kLeastBytes a second in all, although it is asked. Then
// all requests of it fail, those that wait, too, and so do others that come in the next kRest.
//
// Certificates must be signed by an authority that the system knows, or that is in the file SSL_CERT_FILE of the environment.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "common/base/status.h"
#include "common/base/time.h"
#include "common/base/web_traffic.h"
#include "common/memory/bytes.h"
#include "data/stores/range_reader.h"
#include "data/stores/s3.h"

namespace slabstream {

// What goes along with the requests of a store, as long as no redirect leads to another server.
struct HttpAccess {
  std::string query;                 // added to each address, encoded; empty: none
  std::vector<std::string> headers;  // "NAME: VALUE"
  std::optional<S3Access> s3;        // what signs them
  std::stop_token stop;              // StoresStop
};

struct HttpGet {
  std::string url;                                     // absolute, encoded, without a query
  std::optional<ByteSpan> span;                        // bytes of the object, not empty; none: all of it
  bool only_size = false;                              // no bytes
  std::uint64_t most = 0;                              // bytes of an answer
  std::string known = {};                              // an ETag: if the object still has it, no bytes come
  std::shared_ptr<const HttpAccess> access = nullptr;  // null: nothing goes along
  std::function<bool()> wanted = {};                   // whether somebody still waits for the answer; null: somebody does
};

struct HttpObject {
  // Empty: it is the object. Else the server sent something instead, and this says what: HTTP 403 or 204, or a page of HTML. Many servers
  // answer so for what is not there; others, for what one may not read.
  std::string instead = {};
  Bytes bytes = {};          // fewer than asked for if the object ends before
  std::uint64_t size = 0;    // size of the whole object
  std::string version = {};  // ETag, or else when it was changed; empty: the server tells neither
  bool unchanged = false;    // it is still the one that was known (HttpGet::known)
};

class HttpTransfers {
 public:
  static constexpr std::size_t kMostOfAHost = 32;  // requests under way at a time; others wait for their turn
  // Parts of an object that become one request have at most so many bytes together, and so many unwanted ones between each two: these cost
  // less than another request.
  static constexpr std::uint64_t kMostTogether = std::uint64_t{4} << 20, kMostBetween = std::uint64_t{16} << 10;
  static constexpr int kTries = 6;
  static constexpr Duration kFirstPause = std::chrono::milliseconds(200), kLongestPause = std::chrono::seconds(30);
  static constexpr Duration kConnecting = std::chrono::seconds(10);  // for a connection to be there
  static constexpr Duration kStalled = std::chrono::seconds(20);     // without a byte
  // So long after its first try a request fails, unless at least so many bytes a second come.
  static constexpr Duration kPatience = std::chrono::seconds(60);
  static constexpr std::uint64_t kLeastBytes = 1024;
  // After kSilence a host counts as silent, and requests to it fail for kRest. Two processes may try one after the
  // other, a worker and the coordinator, and a minute is the promise for both.
  static constexpr Duration kSilence = std::chrono::seconds(30), kRest = std::chrono::seconds(10);
  static constexpr Duration kLookAtWanted = std::chrono::milliseconds(200);
  // Limits of an answer: headers and trailers, and what is no object, such as the page of an error.
  static constexpr std::uint64_t kMostOfHead = std::uint64_t{256} << 10, kMostOfPage = std::uint64_t{1} << 20;

  struct Timing {
    Duration first_pause = kFirstPause, connecting = kConnecting, stalled = kStalled, patience = kPatience, silence = kSilence,
             rest = kRest;
    int tries = kTries;  // at least 1
  };

  // That of this process, which is never destroyed, since stores may read until the process ends.
  static HttpTransfers& OfProcess();
  static std::vector<WebTraffic> TrafficOfProcess();  // by server; nothing if it has asked for nothing

  explicit HttpTransfers(const Timing& timing);
  ~HttpTransfers();  // what is under way ends with Cancelled
  HttpTransfers(const HttpTransfers&) = delete;
  HttpTransfers& operator=(const HttpTransfers&) = delete;

  // Calls `done` exactly once, on the thread of the transfers, which it must not hold up. Messages begin with the URL. NotFound: 404, 410.
  // ResourceExhausted: the answer has more than `most` bytes; few of them are read. Unavailable: there is no answer, or one without the
  // bytes; where trying again may help, only the last try fails so. DataLoss: the answer holds other bytes than were asked for. Cancelled:
  // nobody wants it any more; its transfer ends within kLookAtWanted. Any thread.
  using Done = std::function<void(Result<HttpObject>)>;
  void Get(HttpGet get, Done done);

  std::vector<WebTraffic> traffic() const;  // sorted by server; the first kMaxWebServers

 private:
  struct Impl;
  const std::unique_ptr<Impl> impl_;
};

}  // namespace slabstream
