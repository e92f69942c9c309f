#include "gateway/movie_requests.h"

#include <fmt/format.h>

#include <boost/asio/post.hpp>
#include <cmath>
#include <optional>
#include <string>
#include <utility>

#include "client/movie/movie_encoder.h"
#include "client/movie/turntable.h"
#include "client/pictures/picture_writer.h"
#include "client/request/camera_file.h"
#include "client/request/request_options.h"
#include "common/base/printable.h"
#include "common/cli/parse.h"
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
  Result<PathText> path = ParseCameraPath(text);
  if (!path.ok()) return Printable(path.status());
  return path;
}

Result<TurntableRequest> ParseTurntable(PictureFields fields) {
  TurntableRequest request;
  const Result<std::string> path_text = TakeOr(fields, "path", "");
  if (!path_text.ok()) return path_text.status();
  std::optional<PathText> path;
  if (!path_text->empty()) {
    Result<PathText> parsed = ParsePath(*path_text, fields);
    if (!parsed.ok()) return parsed.status();
    path = *std::move(parsed);
  }
  const Result<std::string> frames_text = TakeOr(fields, "frames", ""), turns_text = TakeOr(fields, "turns", "1"),
                            fps_text = TakeOr(fields, "fps", fmt::format("{:g}", MovieShape().frames_per_second));
  for (const Result<std::string>* text : {&frames_text, &turns_text, &fps_text}) {
    if (!text->ok()) return text->status();
  }
  Result<RenderRequest> render = ParseRenderFields(fields);
  if (!render.ok()) return render.status();
  request.render = *std::move(render);
  const Result<int> turns = ParseInteger("turns", *turns_text, 0, kMaxTurns);
  if (!turns.ok()) return Printable(turns.status());
  const Result<double> fps = ParseNumber("fps", *fps_text, {kMinFramesPerSecond, kMaxFramesPerSecond});
  if (!fps.ok()) return Printable(fps.status());
  const std::string usual_frames = std::to_string(path && path->timed ? std::llround(path->seconds() * *fps) + 1 : kMovieFrames);
  const Result<int> frames = ParseInteger("frames", frames_text->empty() ? usual_frames : *frames_text, 1, kMaxMovieFrames);
  if (!frames.ok()) return Printable(frames.status());
  request.frames = *frames;
  request.move.turns = *turns;
  if (path) request.move.cameras = std::move(path->cameras);
  request.frames_per_second = *fps;
  const auto [width, height] = request.render.frame.size;
  if (std::int64_t{width} * height > kMaxMoviePixels) {
    return Status::InvalidArgument(fmt::format("--size {}x{} has {} pixels, frames of movies at most {}", width, height,
                                               std::int64_t{width} * height, kMaxMoviePixels));
  }
  if (request.render.frame.view.eye && request.move.turns > 0) {
    return Status::InvalidArgument(
        "--eye fixes the viewpoint, but a turntable turns by --azimuth, about --look-at; turns=0 fixes the view");
  }
  if (Status status = CheckShape(StreamFormat(), {request.render.frame.size, *fps}); !status.ok()) return status;
  if (Status status = CheckCanDraw(request.render.format.annotations); !status.ok()) return status;
  return request;
}

}  // namespace

void MovieRequests::Turntable(PictureFields fields, ReplyFunction reply, const Gone& gone) {
  Result<TurntableRequest> request = ParseTurntable(std::move(fields));
  if (!request.ok()) return reply(Failure(request.status()));
  if (const Status status = CheckHasMovieEncoder(); !status.ok()) return reply(Failure(501, status.message()));
  if (movies_.size() >= std::size_t(kMaxMovies)) {
    metrics_.CountRefusal("movies");
    return reply(Failure(429, fmt::format("{} movies are under way, which is the limit", movies_.size())));
  }
  const auto movie = std::make_shared<TurntableMovie>(io_, context_, service_, metrics_, *std::move(request));
  movies_.insert(movie);
  boost::asio::post(makers_, [this, movie] {
    Status status = movie->Make();
    boost::asio::post(io_, [this, movie, status = std::move(status)]() mutable {
      movies_.erase(movie);  // first: whoever has read a movie to its end may ask for the next
      movie->End(std::move(status));
    });
  });
  *gone = [this, movie] {
    metrics_.CountRefusal("gone");
    movie->Abandon();
  };
  // The reply begins with the movie's first bytes: until then the service's errors have a status of their own.
  movie->Read([movie, reply = std::move(reply)](Result<std::string> first) {
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
