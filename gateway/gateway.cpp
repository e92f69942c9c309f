#include "gateway/gateway.h"

#include <fmt/format.h>

#include <algorithm>
#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/thread_pool.hpp>
#include <functional>
#include <map>
#include <set>
#include <thread>
#include <utility>

#include "client/report/dataset_text.h"
#include "client/report/status_text.h"
#include "common/base/log.h"
#include "common/threads/guarded.h"
#include "gateway/assets.h"
#include "gateway/content_coding.h"
#include "gateway/metrics.h"
#include "gateway/movie_requests.h"
#include "gateway/openapi.h"
#include "gateway/picture_requests.h"
#include "gateway/question_requests.h"
#include "gateway/reply.h"
#include "gateway/request_fields.h"
#include "gateway/request_trace.h"
#include "gateway/rights.h"
#include "gateway/service_link.h"
#include "gateway/service_news.h"
#include "gateway/view_session.h"

namespace slabstream {
namespace {

namespace asio = boost::asio;

constexpr std::string_view kViewProtocol = "slabstream.view.v1", kTokenProtocol = "slabstream.token.", kBearer = "Bearer ";

// Pages that may show the viewer and ask the gateway: those of this machine, such as notebooks, and those that --origin names.
std::vector<std::string> PagesOf(const GatewayOptions& options) {
  std::vector<std::string> pages = {"http://localhost:*", "http://127.0.0.1:*"};
  pages.insert(pages.end(), options.pages.begin(), options.pages.end());
  return pages;
}

// A body that is cut off when the token that it was asked for with expires.
class EndingStream final : public BodyStream {
 public:
  EndingStream(std::shared_ptr<BodyStream> body, Access access) : body_(std::move(body)), access_(std::move(access)) {}

  void Read(std::function<void(Result<std::string>)> next) override {
    body_->Read([access = access_, next = std::move(next)](Result<std::string> part) {
      next(UnixNow() < access.until ? std::move(part) : Result<std::string>(Status::Unavailable(access.ExpiredText())));
    });
  }
  void Abandon() override { body_->Abandon(); }

 private:
  const std::shared_ptr<BodyStream> body_;
  const Access access_;
};

}  // namespace

class Gateway::Impl : public HttpApplication {
 public:
  Impl(Context& context, ServiceAddress service, GatewayOptions options)
      : context_(context),
        service_(std::move(service)),
        options_(std::move(options)),
        rules_(options_.listen, options_.tls.has_value(), options_.proxy.origin, PagesOf(options_)),
        work_(asio::make_work_guard(io_)),
        traces_(options_.collector ? std::make_shared<TraceSender>(*options_.collector, ThisProcess("slabstream-gateway")) : nullptr),
        encoders_(std::max(2U, std::thread::hardware_concurrency())),
        movies_(std::make_unique<MovieRequests>(io_, context_, service_, metrics_)),
        uploads_(std::make_unique<Uploads>(io_, context_, service_, metrics_, options_.max_upload_bytes)),
        routes_(Routes()) {}

  ~Impl() override {
    stopping_ = true;
    asio::post(io_, [this] { Stop(); });
    if (thread_.joinable()) thread_.join();
    monitor_.reset();
    link_.reset();
    movies_->Join();
    encoders_.join();
  }

  Status Start() {
    if (!options_.listen.loopback && !options_.tls && options_.proxy.origin.empty()) {
      return Status::InvalidArgument(
          fmt::format("--listen {} is not loopback: it needs --tls-cert and --tls-key, or --behind-proxy", options_.listen.host));
    }
    if (Status status = CheckToken(options_.token); !status.ok()) return status;
    HttpLimits limits = options_.limits;
    if (!options_.proxy.origin.empty()) limits.connections_an_address = limits.connections;  // a proxy's are those of many
    Result<std::unique_ptr<HttpServer>> server =
        HttpServer::Start(io_, options_.listen.host, options_.listen.port, options_.tls, limits, *this);
    if (!server.ok()) return server.status();
    server_ = *std::move(server);
    link_ = std::make_unique<ServiceLink>(context_, service_);
    pictures_.emplace(io_, encoders_, metrics_, *link_, options_.max_renders);
    questions_.emplace(io_, metrics_, *link_);
    monitor_ = std::make_unique<ServiceLink>(context_, service_);
    asio::post(io_, [this] {
      AskStatus();
      Beat();
    });
    thread_ = std::thread([this] { Run(); });
    return Status::Ok();
  }

  // A request that finds no memory must not end the others: what its handler throws goes no further.
  void Run() {
    while (true) {
      const Status ran = Guarded("a request", [this] { io_.run(); });
      if (ran.ok()) return;
      LogError(ran.message());
    }
  }

  std::string url(bool with_token) const {
    const std::string host = HostOf({.host = options_.listen.host, .port = server_->port()});
    const std::string own = fmt::format("{}://{}", options_.tls ? "https" : "http", host);
    return (options_.proxy.origin.empty() ? own : options_.proxy.origin) + options_.proxy.path +
           (with_token ? "/#token=" + options_.token : "/");
  }

  // ---- HttpApplication

  void Handle(HttpRequest request, ReplyFunction reply) override {
    if (auto refusal = OriginRefusal(request)) {
      metrics_.CountResponse(refusal->status);
      return reply(*std::move(refusal));
    }
    const auto counted = [this, origin = request.origin, reply = std::move(reply)](HttpReply answer) {
      metrics_.CountResponse(answer.status);
      if (origin) {
        answer.headers.emplace_back("Access-Control-Allow-Origin", *origin);
        answer.headers.emplace_back("Access-Control-Expose-Headers", "Slabstream-Renderer");
      }
      reply(std::move(answer));
    };
    Result<Target> target = ParseTarget(request.target);
    if (!target.ok()) return counted(Failure(target.status()));
    const std::string& base = options_.proxy.path;
    if (!base.empty() && target->path == base) {  // the page's addresses are relative: they need the slash
      return counted({.status = 308, .body = {}, .headers = {{"Location", base + "/" + request.target.substr(base.size())}}});
    }
    target->path = BelowBase(target->path);
    const auto route = routes_.find(target->path);
    if (request.method == "OPTIONS" && request.origin && (route != routes_.end() || FindAsset(target->path) != nullptr)) {
      return counted(Preflight());
    }
    if (route == routes_.end()) {
      if (const Asset* asset = FindAsset(target->path); asset != nullptr && (request.method == "GET" || request.method == "HEAD")) {
        return counted(AssetReply(*asset, request));
      }
      return counted(Failure(404, fmt::format("there is nothing at '{}'", Shown(target->path))));
    }
    const bool get = request.method == "GET" || request.method == "HEAD", post = request.method == "POST";
    const std::optional<Right> right = get ? route->second.get : post ? route->second.post : std::nullopt;
    if (!right) {
      HttpReply answer = Failure(405, fmt::format("{} is not a method of {}", Shown(request.method), target->path));
      answer.headers.emplace_back("Allow", !route->second.post ? "GET, HEAD" : !route->second.get ? "POST" : "GET, HEAD, POST");
      return counted(std::move(answer));
    }
    Result<Asker> asker = *right == Right::kNone ? Asker() : AskerOf(request, *target);
    if (!asker.ok()) return counted(NoToken(asker.status()));
    if (const auto why = WhyNot(*right, asker->access)) return counted(NoRight(*why));
    Result<PictureFields> fields = FieldsOf(*target, post && !route->second.takes_bytes ? std::string_view(request.body) : "");
    if (!fields.ok()) return counted(Failure(fields.status()));
    const auto shown = [counted, access = asker->access](HttpReply answer) {
      if (answer.rest != nullptr && access.until != Access::kForEver) answer.rest = std::make_shared<EndingStream>(answer.rest, access);
      counted(std::move(answer));
    };
    const auto trace =
        route->second.traced ? RequestTrace::Begin(traces_, request, options_.tls ? "https" : "http", route->first) : nullptr;
    const auto traced = [shown, trace](HttpReply answer) {
      if (trace != nullptr) trace->End(answer.status);
      shown(std::move(answer));
    };
    route->second.handle({*std::move(fields), std::move(request.body), post, *std::move(asker), traced, request.gone, trace});
  }

  std::variant<HttpReply, WebSocketAccepted> Accept(const HttpRequest& request) override {
    if (auto refusal = OriginRefusal(request)) return *std::move(refusal);
    const Result<Target> target = ParseTarget(request.target);
    if (!target.ok()) return Failure(target.status());
    if (BelowBase(target->path) != "/api/v1/view") return Failure(404, "the WebSocket is /api/v1/view");
    Result<Asker> asker = AskerOf(request, *target);
    if (!asker.ok()) return NoToken(asker.status());
    if (std::ranges::find(request.subprotocols, kViewProtocol) == request.subprotocols.end()) {
      return Failure(400, fmt::format("the WebSocket needs the subprotocol {}", kViewProtocol));
    }
    if (sessions_.size() >= std::size_t(options_.max_sessions)) {
      CountRefusal("sessions");
      std::vector<SessionPlace> places;
      for (const ViewSession* session : sessions_) places.push_back(session->place());
      const auto leaving = WhoMakesRoom(places, asker->token, MonotonicNow());
      if (!leaving) return Failure(429, fmt::format("there are {} views already, which is the limit", sessions_.size()));
      const auto session = std::next(sessions_.begin(), std::ptrdiff_t(*leaving));
      (*session)->End(kMadeRoom, "another page has this place: change the view to come back");
      sessions_.erase(session);
    }
    auto session = std::make_shared<ViewSession>(SessionSurroundings{.io = io_, .encoders = encoders_, .metrics = metrics_},
                                                 std::make_unique<ServiceLink>(context_, service_), news_, *std::move(asker),
                                                 [this](ViewSession& closed) { sessions_.erase(&closed); });
    sessions_.insert(session.get());
    return WebSocketAccepted{.session = std::move(session), .subprotocol = std::string(kViewProtocol)};
  }

  std::vector<std::pair<std::string, std::string>> CommonHeaders() const override {
    std::string frames = fmt::format("'self' {}", fmt::join(PagesOf(options_), " "));
    if (!options_.proxy.origin.empty()) frames += " " + options_.proxy.origin;
    return {
        {"Content-Security-Policy",
         fmt::format("default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob: data:; connect-src 'self'; font-src "
                     "'self'; base-uri 'none'; form-action 'none'; frame-ancestors {}",
                     frames)},
        {"X-Content-Type-Options", "nosniff"},
        {"Referrer-Policy", "no-referrer"},
        {"Vary", "Origin"}};
  }

  void CountRefusal(std::string_view reason) override { metrics_.CountRefusal(reason); }

 private:
  struct Route {
    // The right that each method needs. One that is not named is not taken.
    std::optional<Right> get;  // HEAD, too
    std::optional<Right> post;
    bool traced = false;
    bool takes_bytes = false;  // the body is no JSON
    std::function<void(Asked)> handle;
  };

  static std::string Shown(const std::string& text) { return text.substr(0, 128); }

  std::map<std::string, Route, std::less<>> Routes() {
    const auto answer = [](std::function<HttpReply(const Access&)> make) {
      return [make = std::move(make)](const Asked& asked) { asked.reply(make(asked.asker.access)); };
    };
    const auto text = [&](std::string (*make)()) {
      return answer([make, made = std::string()](const Access&) mutable {
        if (made.empty()) made = make();
        return HttpReply{.body = made};
      });
    };
    using enum Right;
    std::map<std::string, Route, std::less<>> routes;
    routes["/livez"] = {.get = kNone, .handle = answer([](const Access&) { return HttpReply{.type = "text/plain", .body = "ok\n"}; })};
    routes["/readyz"] = {.get = kNone, .handle = answer([this](const Access&) {
                                         if (news_->health == ServiceHealth::kReady) return HttpReply{.type = "text/plain", .body = "ok\n"};
                                         return Failure(503, news_->reason);
                                       })};
    routes["/metrics"] = {.get = kWatch, .handle = answer([this](const Access&) {
                                           const TraceSender::Counts traces =
                                               traces_ != nullptr ? traces_->counts() : TraceSender::Counts();
                                           return HttpReply{.type = "text/plain; version=0.0.4", .body = metrics_.Text(*news_, traces)};
                                         })};
    routes["/api/v1/openapi.json"] = {.get = kNone, .handle = text([] { return OpenApi().dump() + "\n"; })};
    routes["/api/v1/options"] = {.get = kNone, .handle = text([] { return OfferedOptions().dump() + "\n"; })};
    routes["/api/v1/access"] = {.get = kView, .handle = answer([this](const Access& access) {
                                                return JsonReply(AccessJson(access, options_.max_upload_bytes > 0));
                                              })};
    routes["/api/v1/status"] = {.get = kView, .handle = answer([this](const Access& access) {
                                                if (news_->health == ServiceHealth::kGone) return ServiceGone();
                                                return JsonReply(StatusJson(ShownStatus(news_->status, access)));
                                              })};
    routes["/api/v1/datasets"] = {.get = kView,
                                  .handle = answer([this](const Access& access) {
                                    if (news_->health == ServiceHealth::kGone) return ServiceGone();
                                    return JsonReply({{"datasets", DatasetsJson(ShownStatus(news_->status, access).datasets)}});
                                  })};
    const auto bind = [](auto& requests, auto method) {
      return [&requests, method](Asked asked) { std::invoke(method, *requests, std::move(asked)); };
    };
    const auto picture = [this](auto method, PictureFileType type) {
      return [this, method, type](Asked asked) { std::invoke(method, *pictures_, type, std::move(asked)); };
    };
    for (const PictureFileTypeNames& names : PictureFileTypes()) {
      const auto route = [&](const char* kind) -> Route& { return routes[fmt::format("/api/v1/{}{}", kind, names.ending)]; };
      route("render") = {.get = kView, .post = kView, .traced = true, .handle = picture(&PictureRequests::Render, names.type)};
      route("slice") = {.get = kView, .post = kView, .traced = true, .handle = picture(&PictureRequests::Slice, names.type)};
    }
    routes["/api/v1/command"] = {.get = kView, .post = kView, .handle = bind(pictures_, &PictureRequests::Command)};
    routes["/api/v1/turntable.mp4"] = {.get = kView, .post = kView, .handle = bind(movies_, &MovieRequests::Turntable)};
    routes["/api/v1/histogram"] = {.get = kView, .traced = true, .handle = bind(questions_, &QuestionRequests::Histogram)};
    routes["/api/v1/joint-histogram"] = {.get = kView, .traced = true, .handle = bind(questions_, &QuestionRequests::JointHistogram)};
    routes["/api/v1/labels"] = {.get = kView, .traced = true, .handle = bind(questions_, &QuestionRequests::Labels)};
    routes["/api/v1/value"] = {.get = kView, .traced = true, .handle = bind(questions_, &QuestionRequests::Value)};
    routes["/api/v1/profile"] = {.get = kView, .traced = true, .handle = bind(questions_, &QuestionRequests::Profile)};
    routes["/api/v1/statistics"] = {.get = kView, .traced = true, .handle = bind(questions_, &QuestionRequests::Statistics)};
    routes["/api/v1/pick"] = {.get = kView, .post = kView, .traced = true, .handle = bind(questions_, &QuestionRequests::Pick)};
    routes["/api/v1/transfer"] = {.get = kView, .traced = true, .handle = bind(questions_, &QuestionRequests::Transfer)};
    routes["/api/v1/parameters"] = {.get = kView, .post = kSteer, .handle = bind(questions_, &QuestionRequests::Parameters)};
    routes["/api/v1/upload"] = {.post = kSend, .takes_bytes = true, .handle = [this](Asked asked) {
                                  std::vector<std::string> taken;
                                  for (const DatasetStatus& dataset : news_->status.datasets) taken.push_back(dataset.name);
                                  uploads_->Handle(std::move(asked), taken);
                                }};
    routes["/api/v1/view"] = {.get = kView, .handle = answer([](const Access&) { return Failure(426, "this is a WebSocket"); })};
    return routes;
  }

  // A proxy may leave the path of its address in requests, or take it away.
  std::string BelowBase(const std::string& path) const {
    const std::string& base = options_.proxy.path;
    return path.starts_with(base + "/") ? path.substr(base.size()) : path;
  }

  // What a browser asks before it lets a page of another origin send a token or JSON.
  static HttpReply Preflight() {
    return {.status = 204,
            .body = {},
            .headers = {{"Access-Control-Allow-Methods", "GET, HEAD, POST"},
                        {"Access-Control-Allow-Headers", "Authorization, Content-Type"},
                        {"Access-Control-Max-Age", "600"}}};
  }

  static HttpReply AssetReply(const Asset& asset, const HttpRequest& request) {
    HttpReply reply{
        .type = std::string(asset.type), .body = {}, .headers = {{"Cache-Control", "no-cache"}, {"Vary", "Accept-Encoding, Origin"}}};
    if (AcceptsGzip(request.accept_encoding)) {
      reply.body = GzippedBytes(asset);
      reply.headers.emplace_back("Content-Encoding", "gzip");
    } else {
      reply.body = asset.bytes;
    }
    return reply;
  }

  HttpReply ServiceGone() const { return Failure(503, news_->reason); }

  std::optional<HttpReply> OriginRefusal(const HttpRequest& request) {
    const std::optional<std::string_view> origin = request.origin ? std::optional<std::string_view>(*request.origin) : std::nullopt;
    const std::optional<std::string> why = rules_.Refusal(request.host, origin);
    if (!why) return std::nullopt;
    CountRefusal("origin");
    return Failure(403, *why);
  }

  Result<Asker> AskerOf(const HttpRequest& request, const Target& target) {
    std::string_view token;
    const auto protocol = std::ranges::find_if(request.subprotocols, [](const auto& each) { return each.starts_with(kTokenProtocol); });
    const auto field = std::ranges::find(target.fields, "token", &PictureField::name);
    if (request.authorization && request.authorization->starts_with(kBearer)) {
      token = std::string_view(*request.authorization).substr(kBearer.size());
    } else if (protocol != request.subprotocols.end()) {
      token = std::string_view(*protocol).substr(kTokenProtocol.size());
    } else if (field != target.fields.end()) {
      token = field->text;
    }
    Result<Access> access = CheckAccess(token, options_.token, UnixNow());
    if (!access.ok()) return access.status();
    // Files that pages have sent stay while somebody looks at them.
    const auto reading = [this](const std::string& dataset) {
      asio::post(io_, [this, dataset] { uploads_->Touch(dataset, MonotonicNow()); });
    };
    return Asker{*std::move(access), std::string(token), reading};
  }

  HttpReply NoToken(const Status& why) {
    CountRefusal("token");
    HttpReply answer = Failure(401, why.message());
    answer.headers.emplace_back("WWW-Authenticate", "Bearer");
    return answer;
  }

  HttpReply NoRight(const std::string& why) {
    CountRefusal("right");
    return Failure(403, why);
  }

  // How the service is, once a second, and more often while it is gone.
  void AskStatus() {
    constexpr Duration kPatience = std::chrono::seconds(2);
    monitor_->Ask({}, StatusQuery{}, kPatience, [this](Result<ServiceLink::Answer> answer) {
      asio::post(io_, [this, answer = std::move(answer)] {
        if (!stopping_) OnStatus(answer);
      });
    });
  }

  void OnStatus(const Result<ServiceLink::Answer>& answer) {
    // First: it must ask again even if there is no memory for what follows.
    next_status_.expires_after(answer.ok() ? std::chrono::milliseconds(1000) : std::chrono::milliseconds(250));
    next_status_.async_wait([this](boost::system::error_code error) {
      if (!error && !stopping_) AskStatus();
    });
    auto news = std::make_shared<ServiceNews>(*news_);
    news->health = ServiceHealth::kGone;
    news->reason = answer.status().message();
    if (answer.ok()) {
      news->status = std::get<StatusReply>(*answer);
      const bool alone = news->status.workers.empty();
      news->health = alone ? ServiceHealth::kNoWorkers : ServiceHealth::kReady;
      news->reason = alone ? "the service has no workers" : "";
    }
    OnNews(std::move(news));
  }

  void OnNews(std::shared_ptr<const ServiceNews> news) {
    if (news->health != news_->health) {
      Log(news->health == ServiceHealth::kReady ? LogLevel::kInfo : LogLevel::kWarning,
          fmt::format("the service is {}{}{}", NameOf(news->health), news->reason.empty() ? "" : ": ", news->reason));
    }
    news_ = std::move(news);
    for (ViewSession* session : std::set<ViewSession*>(sessions_)) session->OnNews(news_);
  }

  // Once a second, even while the service does not answer: so pages notice when their connection has died without a word.
  void Beat() {
    beat_.expires_after(std::chrono::seconds(1));
    beat_.async_wait([this](boost::system::error_code error) {
      if (!error && !stopping_) Beat();
    });
    const Time now = MonotonicNow();
    for (ViewSession* session : std::set<ViewSession*>(sessions_)) {
      session->SendStatus();
      for (const std::string& name : session->datasets()) uploads_->Touch(name, now);
    }
    uploads_->RemoveUnseen(now);
  }

  void Stop() {
    beat_.cancel();
    next_status_.cancel();
    monitor_->RequestStop();
    link_->RequestStop();
    movies_->Stop();
    uploads_->Stop();
    for (ViewSession* session : std::set<ViewSession*>(sessions_)) session->End(1001, "the gateway ends");
    // Farewells get a moment to leave.
    auto timer = std::make_shared<asio::steady_timer>(io_, std::chrono::milliseconds(200));
    timer->async_wait([this, timer](boost::system::error_code) {
      server_->Stop();
      work_.reset();  // the io thread ends when all connections have
    });
  }

  Context& context_;
  const ServiceAddress service_;
  const GatewayOptions options_;
  const OriginRules rules_;
  Metrics metrics_;
  asio::io_context io_{1};
  asio::executor_work_guard<asio::io_context::executor_type> work_;
  asio::steady_timer beat_{io_}, next_status_{io_};
  const std::shared_ptr<TraceSender> traces_;  // null: nobody wants any
  asio::thread_pool encoders_;
  std::unique_ptr<HttpServer> server_;
  std::unique_ptr<ServiceLink> link_;
  std::unique_ptr<ServiceLink> monitor_;
  std::optional<PictureRequests> pictures_;
  std::optional<QuestionRequests> questions_;
  const std::unique_ptr<MovieRequests> movies_;
  const std::unique_ptr<Uploads> uploads_;
  const std::map<std::string, Route, std::less<>> routes_;
  std::atomic<bool> stopping_ = false;
  // Of the io thread.
  std::set<ViewSession*> sessions_;
  std::shared_ptr<const ServiceNews> news_ = std::make_shared<const ServiceNews>();
  std::thread thread_;
};

Gateway::Gateway(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Gateway::~Gateway() = default;

Result<std::unique_ptr<Gateway>> Gateway::Start(Context& context, ServiceAddress service, GatewayOptions options) {
  auto impl = std::make_unique<Impl>(context, std::move(service), std::move(options));
  if (Status status = impl->Start(); !status.ok()) return status;
  return std::unique_ptr<Gateway>(new Gateway(std::move(impl)));
}

std::string Gateway::url(bool with_token) const { return impl_->url(with_token); }

}  // namespace slabstream
