#include "gateway/movie_requests.h"

#include <fmt/format.h>

#include <algorithm>
#include <boost/asio/post.hpp>
#include <cmath>
#include <optional>
#include <string>
#include <utility>

#include "client/movie/movie_encoder.h"
#include "client/movie/turntable.h"
#include "client/request/camera_file.h"
#include "client/request/request_options.h"
#include "common/cli/parse.h"
#include "common/threads/guarded.h"
#include "gateway/request_fields.h"

namespace slabstream {
namespace {

// The path replaces what the request would say of its view.
Result<PathText> ParsePath(const std::string& text, const PictureFields& fields) {
  for (const PictureField& field : fields) {
    const RequestOption* const option = FindRequestOption(field.name);
    if (field.name == "view" || field.name == "turns" || (option != nullptr && option->path.starts_with("view."))) {
      return Status::InvalidArgument(fmt::format("path excludes {}", field.name));
    }
  }
  return ParseCameraPath(text);
}

Result<TurntableRequest> ParseTurntable(PictureFields fields) {
  FieldReader read(std::move(fields));
  TurntableRequest request;
  const std::string path_text = read.Get("path", "");
  std::optional<PathText> path;
  if (!path_text.empty()) path = read.Value(ParsePath(path_text, read.rest()));
  const std::string frames = read.Get("frames", ""), turns = read.Get("turns", "1"),
                    fps = read.Get("fps", fmt::format("{:g}", MovieShape().frames_per_second));
  const auto time = std::ranges::find(read.rest(), "time", &PictureField::name);
  if (time != read.rest().end() && time->text.find(':') != std::string::npos) {
    request.times = read.Value(ParseTimeSteps("time", read.Get("time", "")));
  }
  request.render = read.Value(ParseRenderFields(read.rest()));
  request.move.turns = read.Value(ParseInteger("turns", turns, 0, kMaxTurns));
  request.frames_per_second = read.Value(ParseNumber("fps", fps, {kMinFramesPerSecond, kMaxFramesPerSecond}));
  const std::int64_t usual_frames = request.times         ? request.times->count()
                                    : path && path->timed ? std::llround(path->seconds() * request.frames_per_second) + 1
                                                          : kMovieFrames;
  request.frames = read.Value(ParseInteger("frames", frames.empty() ? std::to_string(usual_frames) : frames, 1, kMaxMovieFrames));
  if (path) request.move.cameras = std::move(path->cameras);
  const auto [width, height] = request.render.frame.size;
  if (std::int64_t{width} * height > kMaxMoviePixels) {
    read.Refuse(fmt::format("--size {}x{} has {} pixels, frames of movies at most {}", width, height, std::int64_t{width} * height,
                            kMaxMoviePixels));
  }
  if (request.render.frame.view.eye && request.move.turns > 0) {
    read.Refuse("--eye fixes the viewpoint, but a turntable turns by --azimuth, about --look-at; turns=0 fixes the view");
  }
  read.Check(CheckShape(StreamFormat(), {request.render.frame.size, request.frames_per_second}));
  read.Check(CheckCanDraw(request.render.format.annotations));
  if (!read.status().ok()) return read.status();
  return request;
}

}  // namespace

void MovieRequests::Turntable(Asked asked) {
  Result<TurntableRequest> request = ParseTurntable(std::move(asked.fields));
  if (!request.ok()) return asked.reply(Failure(request.status()));
  request->asker = std::move(asked.asker);
  if (const Status status = CheckHasMovieEncoder(); !status.ok()) return asked.reply(Failure(501, status.message()));
  if (movies_.size() >= std::size_t(kMaxMovies)) {
    metrics_.CountRefusal("movies");
    return asked.reply(Failure(429, fmt::format("{} movies are under way, which is the limit", movies_.size())));
  }
  const auto movie = std::make_shared<TurntableMovie>(io_, context_, service_, metrics_, *std::move(request));
  movies_.insert(movie);
  boost::asio::post(makers_, [this, movie] {
    Status status = Guarded("the movie", [&] { return movie->Make(); });
    boost::asio::post(io_, [this, movie, status = std::move(status)]() mutable {
      movies_.erase(movie);  // first: whoever has read a movie to its end may ask for the next
      movie->End(std::move(status));
    });
  });
  *asked.gone = [this, movie] {
    metrics_.CountRefusal("gone");
    movie->Abandon();
  };
  // The reply begins with the movie's first bytes: until then the service's errors have a status of their own.
  movie->Read([movie, reply = std::move(asked.reply)](Result<std::string> first) {
    if (!first.ok()) return reply(Failure(first.status()));
    reply({.type = "video/mp4",
           .body = *std::move(first),
           .headers = {{"Cache-Control", "no-store"}, {"Content-Disposition", "attachment; filename=\"turntable.mp4\""}},
           .rest = movie});
  });
}

void MovieRequests::Stop() {
  for (const std::shared_ptr<TurntableMovie>& movie : movies_) movie->Abandon();
}

}  // namespace slabstream
