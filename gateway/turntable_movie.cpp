#include "gateway/turntable_movie.h"

#include <fcntl.h>

#include <algorithm>
#include <boost/asio/buffer.hpp>
#include <boost/asio/post.hpp>
#include <cerrno>
#include <cstring>
#include <utility>

#include "gateway/requests_under_way.h"

namespace slabstream {
namespace {

constexpr int kInFlight = 2;  // frames requested and not yet taken
constexpr std::size_t kPartBytes = std::size_t{1} << 16;

}  // namespace

TurntableMovie::TurntableMovie(boost::asio::io_context& io, Context& context, ServiceAddress service, Metrics& metrics,
                               TurntableRequest request)
    : io_(io), context_(context), service_(std::move(service)), metrics_(metrics), request_(std::move(request)), output_(io) {}

// ---- Make's thread

Status TurntableMovie::Make() {
  const Status status = RenderAndEncode();
  // The encoder has ended, well or not: what it wrote before is still read.
  std::unique_ptr<MovieEncoder> encoder;
  {
    const std::lock_guard lock(mutex_);
    encoder = std::move(encoder_);
  }
  encoder.reset();
  return status;
}

Status TurntableMovie::RenderAndEncode() {
  ServiceLink link(context_, service_);  // a client of its own, so that others get their share
  const auto frame_at = [&](int index) {
    FrameRequest frame = request_.render.frame;
    if (request_.times) frame.time = std::to_string(request_.times->At(index, request_.frames));
    return frame;
  };
  std::vector<FrameRequest> volumes;
  for (int i = 0; i < request_.frames; ++i) {
    FrameRequest frame = frame_at(i);
    if (volumes.empty() || volumes.back().time != frame.time) volumes.push_back(std::move(frame));  // times rise
  }
  const AskView ask = [&](ViewQuery query) { return Ask(link, std::move(query)); };
  if (request_.times) {  // one that is not there is told before the first byte
    const Result<ViewReply> last = ask({.frame = volumes.back()});
    if (!last.ok()) return last.status();
  }
  const Result<std::vector<ViewParameters>> views = ViewsOfMovie(request_.move, request_.frames, volumes, ask);
  if (!views.ok()) return views.status();
  const auto request = [&](int index) {
    FrameRequest frame = frame_at(index);
    frame.view = (*views)[std::size_t(index)];
    frame.key = request_.render.format.annotations.needs_key();
    const auto done = [this, index](Result<ServiceLink::Rendered> rendered) {
      const std::lock_guard lock(mutex_);
      pictures_.emplace(index, std::move(rendered));
      changed_.notify_one();
    };
    link.Render(request_.asker, {std::move(frame)}, kAnswerDeadline, {.progress = {}, .done = done});
  };
  for (int i = 0, requested = 0; i < request_.frames; ++i) {
    while (requested < std::min(i + kInFlight, request_.frames)) request(requested++);
    const Result<ServiceLink::Rendered> rendered = Take(i);
    if (!rendered.ok()) return rendered.status();
    const Picture& picture = rendered->pictures.front();
    metrics_.CountFrame(picture.statistics, picture.latency);
    const auto composed =
        ComposedPicture::Make(picture.image, picture.size, WithoutTransparency(request_.render.format), picture.geometry, picture.key);
    if (!composed.ok()) return composed.status();
    const std::vector<std::byte> frame = MovieFrame(*composed);
    // Not before there is a frame: so an error of the service comes before the first byte.
    if (encoder_ == nullptr) {
      if (Status status = StartEncoder(); !status.ok()) return status;
    }
    if (Status status = encoder_->Put(frame); !status.ok()) return status;
  }
  return encoder_->Finish();
}

Status TurntableMovie::StartEncoder() {
  const MovieShape shape{.size = request_.render.frame.size, .frames_per_second = request_.frames_per_second};
  Result<std::unique_ptr<MovieEncoder>> encoder = MovieEncoder::Start(StreamFormat(), shape, "");
  if (!encoder.ok()) return encoder.status();
  FileDescriptor output(::fcntl((*encoder)->output(), F_DUPFD_CLOEXEC, 0));
  if (output.number() < 0) return Status::Unavailable(std::string("cannot read a movie: ") + std::strerror(errno));
  {
    const std::lock_guard lock(mutex_);
    if (abandoned_) return Status::Cancelled("nobody reads it");
    encoder_ = *std::move(encoder);
  }
  boost::asio::post(io_, [self = shared_from_this(), output = std::make_shared<FileDescriptor>(std::move(output))] {
    self->output_.assign(output->Release());
    if (self->next_) self->ReadSome();
  });
  return Status::Ok();
}

Result<ViewReply> TurntableMovie::Ask(ServiceLink& link, ViewQuery query) {
  link.Ask(request_.asker, std::move(query), kAnswerDeadline, [this](Result<ServiceLink::Answer> reply) {
    const std::lock_guard lock(mutex_);
    answer_ = std::move(reply);
    changed_.notify_one();
  });
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [&] { return abandoned_ || answer_; });
  if (abandoned_) return Status::Cancelled("nobody reads it");
  const Result<ServiceLink::Answer> reply = *std::exchange(answer_, std::nullopt);
  if (!reply.ok()) return reply.status();
  return std::get<ViewReply>(*reply);
}

Result<ServiceLink::Rendered> TurntableMovie::Take(int index) {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [&] { return abandoned_ || pictures_.contains(index); });
  if (abandoned_) return Status::Cancelled("nobody reads it");
  return std::move(pictures_.extract(index).mapped());
}

// ---- the io thread

void TurntableMovie::End(Status status) {
  end_ = std::move(status);
  if (next_ && !output_.is_open()) ReadSome();
}

void TurntableMovie::Read(std::function<void(Result<std::string>)> next) {
  next_ = std::move(next);
  if (output_.is_open() || end_) ReadSome();
}

void TurntableMovie::ReadSome() {
  if (!output_.is_open()) return Answer(end_->ok() ? Result<std::string>(std::string()) : *end_);
  part_.resize(kPartBytes);
  output_.async_read_some(boost::asio::buffer(part_), [self = shared_from_this()](boost::system::error_code error, std::size_t size) {
    if (!self->next_) return;
    if (!error) {
      self->part_.resize(size);
      return self->Answer(std::move(self->part_));
    }
    self->output_.close(error);
    if (self->end_) self->ReadSome();  // else the encoder has closed its output, and End says soon how it went
  });
}

void TurntableMovie::Answer(Result<std::string> part) { std::exchange(next_, nullptr)(std::move(part)); }

void TurntableMovie::Abandon() {
  next_ = nullptr;
  boost::system::error_code ignored;
  output_.close(ignored);
  const std::lock_guard lock(mutex_);
  abandoned_ = true;
  if (encoder_ != nullptr) encoder_->Abandon();
  changed_.notify_one();
}

}  // namespace slabstream
