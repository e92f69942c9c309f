// Requests for movies. All calls on the io thread.
#pragma once

#include <boost/asio/thread_pool.hpp>
#include <memory>
#include <set>

#include "client/request/picture_fields.h"
#include "gateway/requests_under_way.h"
#include "gateway/turntable_movie.h"

namespace slabstream {

inline constexpr char kFramesHelp[] = "Number of frames, spread evenly over turns, path and times: at most 1000";
inline constexpr int kMaxMovies = 2;             // under way
inline constexpr int kMaxMovieFrames = 1000;     // the most frames of a movie
inline constexpr int kMovieFrames = 120;         // if the request does not say
inline constexpr int kMaxMoviePixels = 1 << 22;  // the most pixels of a frame

class MovieRequests {
 public:
  // All must outlive this.
  MovieRequests(boost::asio::io_context& io, Context& context, ServiceAddress service, Metrics& metrics)
      : io_(io), context_(context), service_(std::move(service)), metrics_(metrics), makers_(kMaxMovies) {}
  ~MovieRequests() { Join(); }

  void Turntable(Asked asked);

  // Gives up all movies.
  void Stop();
  // Any thread, when the io thread has ended: waits for the encoders' end.
  void Join() { makers_.join(); }

 private:
  boost::asio::io_context& io_;
  Context& context_;
  const ServiceAddress service_;
  Metrics& metrics_;
  std::set<std::shared_ptr<TurntableMovie>> movies_;
  boost::asio::thread_pool makers_;
};

}  // namespace slabstream
