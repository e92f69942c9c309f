// Gateway: pictures of a service over HTTP and WebSockets (docs/http.md). Its parts, and their threads:
//
//   HttpServer (http.h)   sockets and limits                                         io thread
//   Gateway               who may ask; routes                                        io thread
//   ViewSession           one view of one page                                       io thread
//   ServiceLink           a client of the service: one for all requests over HTTP,   one each
//                         one for each session, one for each movie, and one that
//                         asks how the service is, once a second
//   PictureRequests, QuestionRequests, MovieRequests                               io thread
//                         what is asked for over HTTP
//   encoders              compress pictures                                          one a core
//   makers                make movies (turntable_movie.h)                            one for each movie
//   TraceSender           sends traces of requests (request_trace.h)                 its own
//
// Threads hand results over by posting them to the io thread, which alone changes the state of the gateway and its sessions.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "client/client.h"
#include "common/base/status.h"
#include "common/http/address.h"
#include "common/http/http.h"
#include "gateway/uploads.h"

namespace slabstream {

struct GatewayOptions {
  ListenAddress listen;
  std::optional<TlsFiles> tls;
  ProxyAddress proxy;                // --behind-proxy; the page and the interface are below its path, too
  std::vector<std::string> pages;    // those that may show the viewer in a frame and ask, as ParsePageSource gives them
  std::string token;                 // CheckToken
  std::optional<HttpUrl> collector;  // OpenTelemetry's collector, which gets traces of requests; none: there are no traces
  HttpLimits limits;
  int max_sessions = 64;
  int max_renders = 16;                           // pictures over HTTP under way
  std::uint64_t max_upload_bytes = kUploadBytes;  // the most bytes of a file that a page sends; 0: no file is taken
};

class Gateway {
 public:
  // Serves at once, on a thread of its own, until it is destroyed, whether the service answers or not. `context` must outlive it.
  // InvalidArgument: options, among them an address off loopback without TLS or proxy; Unavailable: the address.
  static Result<std::unique_ptr<Gateway>> Start(Context& context, ServiceAddress service, GatewayOptions options);
  ~Gateway();

  std::string url(bool with_token) const;

 private:
  class Impl;
  explicit Gateway(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace slabstream
