// TurntableMovie: a movie that is rendered, encoded and sent at the same time. Whoever reads it slowly slows down the rest.
#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/posix/stream_descriptor.hpp>
#include <condition_variable>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "client/client.h"
#include "client/movie/camera_moves.h"
#include "client/movie/movie_encoder.h"
#include "client/movie/time_steps.h"
#include "client/request/picture_fields.h"
#include "common/http/http.h"
#include "common/transport/context.h"
#include "gateway/metrics.h"
#include "gateway/service_link.h"

namespace slabstream {

struct TurntableRequest {
  RenderRequest render;  // the request of the first frame
  Asker asker = {};
  int frames = 0;
  std::optional<TimeSteps> times = {};  // over which the frames are spread; none: the time of `render`
  CameraMove move = {};
  double frames_per_second = 25;
};

class TurntableMovie final : public BodyStream, public std::enable_shared_from_this<TurntableMovie> {
 public:
  // `io`, `context` and `metrics` must outlive it.
  TurntableMovie(boost::asio::io_context& io, Context& context, ServiceAddress service, Metrics& metrics, TurntableRequest request);

  // On a thread that stays as long as the process (Child): makes the movie, until it is done or abandoned. Says how it went.
  Status Make();
  // What Make has returned, on the io thread: whoever reads the movie learns of its end by this.
  void End(Status status);

  // BodyStream. Read's errors: those of the service before the first bytes, and of the encoder.
  void Read(std::function<void(Result<std::string>)> next) override;
  void Abandon() override;

 private:
  Status RenderAndEncode();
  Status StartEncoder();
  // Waits for the answer. Errors as of Take.
  Result<ViewReply> Ask(ServiceLink& link, ViewQuery query);
  // Waits for the frame. Errors are the service's; Cancelled: it is no longer read.
  Result<ServiceLink::Rendered> Take(int index);
  void ReadSome();
  void Answer(Result<std::string> part);

  boost::asio::io_context& io_;
  Context& context_;
  const ServiceAddress service_;
  Metrics& metrics_;
  const TurntableRequest request_;
  // Used by the io thread alone.
  boost::asio::posix::stream_descriptor output_;  // the encoder's output, while it is open
  std::function<void(Result<std::string>)> next_;
  std::optional<Status> end_;
  std::string part_;
  // Shared.
  std::mutex mutex_;
  std::condition_variable changed_;
  std::unique_ptr<MovieEncoder> encoder_;                  // made and ended by Make's thread
  std::map<int, Result<ServiceLink::Rendered>> pictures_;  // pictures that have come, and were not taken yet
  std::optional<Result<ServiceLink::Answer>> answer_;      // an answer that has come, and was not taken yet
  bool abandoned_ = false;
};

}  // namespace slabstream
