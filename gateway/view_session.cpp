#include "gateway/view_session.h"

#include <algorithm>
#include <boost/asio/post.hpp>
#include <chrono>
#include <utility>

#include "client/pictures/picture_writer.h"
#include "client/report/status_text.h"
#include "common/base/version.h"
#include "common/threads/guarded.h"
#include "gateway/next_times.h"

namespace slabstream {
namespace {

namespace asio = boost::asio;

constexpr Duration kDeadline = std::chrono::minutes(10);  // volumes may have to be loaded first
constexpr std::size_t kLargePicture = 100'000;            // bytes: on its way, it may keep other messages waiting
constexpr double kMostDetail = 1000;                      // FrameRequest::detail

std::string TextOf(const Json& json) { return json.dump(); }

std::string_view NameOf(FramePhase phase) {
  switch (phase) {
    case FramePhase::kQueued: return "queued";
    case FramePhase::kLoading: return "loading";
    case FramePhase::kRunning: break;
  }
  return "running";
}

bool AllFinest(const FrameStatistics& statistics) {
  return std::ranges::all_of(statistics.levels, [](const LevelUse& use) { return use.level == 0; });
}

int Scaled(int pixels, double scale) { return std::max(1, int(double(pixels) * scale + 0.5)); }

}  // namespace

ViewSession::ViewSession(SessionSurroundings surroundings, std::unique_ptr<ServiceLink> link, std::shared_ptr<const ServiceNews> news,
                         Asker asker, std::function<void(ViewSession&)> closed)
    : around_(surroundings),
      link_(std::move(link)),
      news_(std::move(news)),
      asker_(std::move(asker)),
      closed_(std::move(closed)),
      timer_(surroundings.io) {}

void ViewSession::OnOpen(WebSocketPeer& peer) {
  peer_ = &peer;
  around_.metrics.CountSession(1);
  peer_->SendText(TextOf({{"type", "hello"},
                          {"version", 1},
                          {"program", std::string("slabstream ") + std::string(Version())},
                          {"still_after_ms", std::chrono::duration_cast<std::chrono::milliseconds>(kStillAfter).count()}}));
  SendStatus();
}

void ViewSession::OnClosed(const std::string&) {
  if (link_ == nullptr) return;
  if (std::exchange(peer_, nullptr) != nullptr) around_.metrics.CountSession(-1);
  timer_.cancel();
  if (given_up_ != nullptr) *given_up_ = true;
  link_->RequestStop();
  // The end of a link may take a while, which the io thread has not. It cancels what the service still works on.
  asio::post(around_.encoders, [link = std::shared_ptr<ServiceLink>(std::move(link_))] {});
  closed_(*this);
}

void ViewSession::End(std::uint16_t code, const std::string& why) {
  if (peer_ != nullptr) peer_->Close(code, why);
}

bool ViewSession::HasExpired() {
  if (UnixNow() < asker_.access.until) return false;
  End(kExpired, asker_.access.ExpiredText());
  return true;
}

void ViewSession::OnText(std::string_view text) {
  if (HasExpired()) return;
  Result<PageMessage> message = ParsePageMessage(text);
  if (!message.ok()) {
    around_.metrics.CountRefusal("message");
    return peer_->Close(1008, message.status().message());
  }
  if (auto* view = std::get_if<ViewMessage>(&*message)) return Handle(*std::move(view));
  if (const auto* pong = std::get_if<PongMessage>(&*message)) {
    if (pong->ping == pings_) machine_.OnEcho(MonotonicNow() - pinged_at_, MonotonicNow());
    return;
  }
  const auto& ack = std::get<AckMessage>(*message);
  const ViewMachine::Actions actions = machine_.OnAck(ack.frame, ack.in_page, MonotonicNow());
  around_.metrics.CountRoundTrip(machine_.link().last_round_trip());
  Do(actions);
}

void ViewSession::Handle(ViewMessage view) {
  if (view_ && view.seq <= view_->seq) {
    return peer_->Close(1008, "seq " + std::to_string(view.seq) + " does not rise: the last one was " + std::to_string(view_->seq));
  }
  const std::uint64_t seq = view.seq;
  const bool video = view.video;
  view_ = std::move(view);
  Do(machine_.OnView(seq, video, MonotonicNow()));
}

void ViewSession::OnNews(std::shared_ptr<const ServiceNews> news) {
  const bool differs = news->health != news_->health;
  news_ = std::move(news);
  if (peer_ == nullptr) return;
  if (differs) SendStatus();
  if (news_->health != ServiceHealth::kGone) Do(machine_.OnServiceBack(MonotonicNow()));
}

void ViewSession::SendStatus() {
  if (peer_ == nullptr || HasExpired()) return;
  Json json = {{"type", "status"}, {"service", slabstream::NameOf(news_->health)}, {"reason", news_->reason}};
  const Json status = StatusJson(ShownStatus(news_->status, asker_.access));
  for (const char* field : {"workers", "workers_lost", "queued", "running", "frames_done", "datasets"}) json[field] = status[field];
  peer_->SendText(TextOf(json));
  pinged_at_ = MonotonicNow();
  peer_->SendText(TextOf(Json{{"type", "ping"}, {"ping", ++pings_}}));
}

void ViewSession::SendError(std::uint64_t seq, const Status& status) {
  if (peer_ == nullptr) return;
  peer_->SendText(TextOf({{"type", "error"}, {"seq", seq}, {"code", ToString(status.code())}, {"error", status.message()}}));
}

void ViewSession::Do(const ViewMachine::Actions& actions) {
  for (const ViewAction& action : actions) {
    switch (action.kind) {
      case ViewActionKind::kRender: Render(action); break;
      case ViewActionKind::kCancelRender:
        if (rendering_) link_->Cancel(rendering_->ticket);
        rendering_.reset();
        break;
      case ViewActionKind::kEncode: Encode(action.coding, action.quality); break;
      case ViewActionKind::kCancelEncode:
        *given_up_ = true;
        ++encoding_;
        break;
      case ViewActionKind::kSend: Send(action.frame); break;
    }
  }
  SetTimer();
}

void ViewSession::SetTimer() {
  if (peer_ == nullptr || !machine_.wake_time()) {
    timer_.cancel();
    return;
  }
  timer_.expires_at(*machine_.wake_time());
  timer_.async_wait([weak = weak_from_this()](boost::system::error_code error) {
    const auto self = weak.lock();
    if (!error && self != nullptr && self->peer_ != nullptr) self->Do(self->machine_.OnTime(MonotonicNow()));
  });
}

void ViewSession::Render(const ViewAction& action) {
  const std::uint64_t seq = action.seq;
  const double scale = action.scale, coarseness = action.coarseness;
  const std::uint64_t order = ++orders_;
  Result<PictureJob> job = MakePictureJob(view_->kind, view_->options);
  if (!job.ok()) {
    SendError(seq, job.status());
    rendering_ = Rendering{.order = order};
    // Not now: the machine is still at work.
    asio::post(around_.io, [self = shared_from_this(), order] {
      if (!self->rendering_ || self->rendering_->order != order || self->peer_ == nullptr) return;
      self->rendering_.reset();
      self->Do(self->machine_.OnRefused(MonotonicNow()));
    });
    return;
  }
  const bool shadowed = std::ranges::any_of(job->frames, [](const FrameRequest& frame) { return frame.shading.needs_light_volume(); });
  // Letters keep their size on the page.
  if (auto& letters = job->format.annotations.font_size) letters = *letters * scale;
  for (FrameRequest& frame : job->frames) {
    frame.straight8 = HoldsStraight8(job->format);
    frame.straight8_over = OpaqueBackground(job->format);
    frame.key = job->format.annotations.needs_key();
    if (action.plain) frame.shading.shadows = frame.shading.ambient_occlusion = 0;
    frame.size = {Scaled(frame.size.width, scale), Scaled(frame.size.height, scale)};
    if (coarseness > 1) frame.detail = std::min((frame.detail == 0 ? 1 : frame.detail) * coarseness, kMostDetail);
  }
  // A level that the view names is drawn, however coarse pictures may be.
  const bool names_level = std::ranges::any_of(job->frames, [](const FrameRequest& frame) { return LevelNumber(frame.level).has_value(); });
  Rendering rendering{.order = order, .ticket = 0, .view = {}, .frame = job->frames.front(), .shadowed = shadowed};
  rendering.view.seq = seq;
  rendering.view.scale = scale;
  rendering.view.coarseness = names_level ? 1 : coarseness;
  rendering.view.format = std::move(job->format);
  rendering.view.timeline = view_->timeline;
  const auto self = shared_from_this();
  rendering.ticket = link_->Render(asker_, std::move(job->frames), kDeadline,
                                   {.progress =
                                        [self, order](const FrameProgress& progress) {
                                          asio::post(self->around_.io, [self, order, progress] { self->OnProgress(order, progress); });
                                        },
                                    .done =
                                        [self, order](Result<ServiceLink::Rendered> rendered) {
                                          asio::post(self->around_.io, [self, order, rendered = std::move(rendered)]() mutable {
                                            self->OnFrames(order, std::move(rendered));
                                          });
                                        }});
  rendering_ = std::move(rendering);
}

void ViewSession::OnProgress(std::uint64_t order, const FrameProgress& progress) {
  if (peer_ == nullptr || !rendering_ || rendering_->order != order) return;
  if (progress.phase == FramePhase::kLoading) machine_.OnLoading(MonotonicNow());
  peer_->SendText(TextOf({{"type", "progress"},
                          {"seq", rendering_->view.seq},
                          {"phase", NameOf(progress.phase)},
                          {"queue_position", progress.queue_position},
                          {"groups_done", progress.groups_done},
                          {"group_count", progress.group_count},
                          {"attempt", progress.attempt},
                          {"workers", progress.workers},
                          {"read_percent", progress.read_percent}}));
}

void ViewSession::OnFrames(std::uint64_t order, Result<ServiceLink::Rendered> rendered) {
  if (peer_ == nullptr || !rendering_ || rendering_->order != order) return;
  Rendering rendering = *std::exchange(rendering_, std::nullopt);
  if (!rendered.ok()) {
    const bool unavailable = rendered.status().code() == StatusCode::kUnavailable;
    // A service that is there has a reason that people must see, such as a store that does not answer; the picture is tried again.
    if (!unavailable || (news_->health != ServiceHealth::kGone && told_unavailable_ != rendering.view.seq)) {
      SendError(rendering.view.seq, rendered.status());
      told_unavailable_ = rendering.view.seq;
    }
    if (unavailable) return Do(machine_.OnUnavailable(MonotonicNow()));
    return Do(machine_.OnRefused(MonotonicNow()));
  }
  FetchNextTimes(rendering.frame);
  RenderedView view = JoinPictures(std::move(rendered->pictures), rendering.frame.size);
  view.seq = rendering.view.seq;
  view.scale = rendering.view.scale;
  const bool finest = rendering.view.coarseness == 1 || AllFinest(view.statistics);
  view.coarseness = finest ? 1 : rendering.view.coarseness;
  view.format = std::move(rendering.view.format);
  view.timeline = rendering.view.timeline;
  around_.metrics.CountFrame(view.statistics, view.latency);
  rendered_ = std::make_shared<const RenderedView>(std::move(view));
  Do(machine_.OnRendered(finest, rendering.shadowed, MonotonicNow()));
}

// While times are played: those that follow, so that workers read them while the page shows this one.
void ViewSession::FetchNextTimes(const FrameRequest& shown) {
  const FrameRequest before = std::exchange(shown_, shown);
  if (before.dataset != shown.dataset) return;
  const auto dataset = std::ranges::find(news_->status.datasets, shown.dataset, &DatasetStatus::name);
  const int times = dataset == news_->status.datasets.end() || !dataset->fields ? 1 : dataset->fields->times.count;
  std::vector<FrameRequest> next = NextTimes(shown, before.time, times);
  if (next.empty()) return;
  if (fetching_ != 0) link_->Cancel(fetching_);
  fetching_ = link_->Render(asker_, std::move(next), kDeadline, {.progress = {}, .done = [](const Result<ServiceLink::Rendered>&) {}});
}

void ViewSession::Encode(PictureCoding coding, int quality) {
  given_up_ = std::make_shared<std::atomic<bool>>(false);
  const std::uint64_t number = ++encoding_;
  asio::post(around_.encoders, [self = shared_from_this(), view = rendered_, coding, quality, given_up = given_up_, number]() mutable {
    Result<EncodedView> encoded = Guarded("the picture", [&] { return EncodeView(*view, coding, quality, self->video_, *given_up); });
    view.reset();
    auto& io = self->around_.io;
    asio::post(io,
               [self = std::move(self), number, encoded = std::move(encoded)]() mutable { self->OnEncoded(number, std::move(encoded)); });
  });
}

void ViewSession::OnEncoded(std::uint64_t number, Result<EncodedView> encoded) {
  if (peer_ == nullptr || number != encoding_) return;
  if (!encoded.ok()) {
    if (encoded.status().code() == StatusCode::kCancelled) return;
    SendError(rendered_->seq, encoded.status());
    return Do(machine_.OnEncodeFailed(MonotonicNow()));
  }
  around_.metrics.CountPicture(encoded->type, encoded->bytes->size(), encoded->encoding);
  encoded_ = *std::move(encoded);
  Do(machine_.OnEncoded(MonotonicNow()));
}

void ViewSession::Send(std::uint64_t frame) {
  EncodedView encoded = *std::exchange(encoded_, std::nullopt);
  if (encoded.bytes->size() >= kLargePicture) peer_->SendText(TextOf(Json{{"type", "picture"}, {"bytes", encoded.bytes->size()}}));
  peer_->SendBinary(HeadOf(std::move(encoded.header), frame, machine_.link().round_trip()), std::move(encoded.bytes));
}

}  // namespace slabstream
