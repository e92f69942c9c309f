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

#include "client/image_io/image_writer.h"
#include "client/report/dataset_text.h"
#include "client/report/status_text.h"
#include "client/report/volume_text.h"
#include "client/request/picture_record.h"
#include "client/request/values.h"
#include "common/base/log.h"
#include "common/base/printable.h"
#include "common/base/version.h"
#include "common/planning/validate_request.h"
#include "gateway/assets.h"
#include "gateway/content_coding.h"
#include "gateway/metrics.h"
#include "gateway/openapi.h"
#include "gateway/page_message.h"
#include "gateway/service_link.h"
#include "gateway/service_monitor.h"
#include "gateway/target.h"
#include "gateway/view_session.h"

namespace slabstream {
namespace {

namespace asio = boost::asio;

constexpr Duration kRenderDeadline = std::chrono::minutes(2);
constexpr int kMaxQuestions = 32;  // under way: fewer than a client may have
static_assert(kMaxQuestions < int(kMaxOpenQuestions));
constexpr std::string_view kViewProtocol = "slabstream.view.v1", kTokenProtocol = "slabstream.token.";

using ReplyFunction = std::function<void(HttpReply)>;
using Gone = std::shared_ptr<std::function<void()>>;  // HttpRequest::gone

std::string TextOf(const Json& json) { return json.dump(-1, ' ', false, Json::error_handler_t::replace) + "\n"; }

HttpReply JsonReply(const Json& json) { return {.body = TextOf(json)}; }
HttpReply Failure(unsigned status, std::string_view message) { return {.status = status, .body = TextOf({{"error", message}})}; }

unsigned HttpStatus(StatusCode code) {
  switch (code) {
    case StatusCode::kOk: return 200;
    case StatusCode::kInvalidArgument: return 400;
    case StatusCode::kNotFound: return 404;
    case StatusCode::kUnavailable:
    case StatusCode::kResourceExhausted:
    case StatusCode::kCancelled: return 503;
    case StatusCode::kDeadlineExceeded: return 504;
    case StatusCode::kDataLoss:
    case StatusCode::kInternal: break;
  }
  return 500;
}
HttpReply Failure(const Status& status) { return Failure(HttpStatus(status.code()), status.message()); }

// The fields of the address and, of a POST, those of the body. Takes the token out of them.
Result<PictureFields> FieldsOf(const Target& target, const HttpRequest& request) {
  PictureFields fields;
  for (const PictureField& field : target.fields) {
    if (field.name != "token") fields.push_back(field);
  }
  if (request.method != "POST" || request.body.empty()) return fields;
  const Result<Json> json = ParseJson(request.body);
  if (!json.ok()) return Status::InvalidArgument("the body: " + json.status().message());
  Result<PictureFields> more = FieldsOfJson(*json);
  if (!more.ok()) return more.status();
  fields.insert(fields.end(), more->begin(), more->end());
  return fields;
}

// Takes the field out. InvalidArgument: it is missing, or there are several.
Result<std::string> Take(PictureFields& fields, const std::string& name, std::string_view purpose) {
  const auto found = std::ranges::find(fields, name, &PictureField::name);
  if (found == fields.end()) return Status::InvalidArgument(fmt::format("{} is missing: {}", name, purpose));
  std::string text = std::move(found->text);
  fields.erase(found);
  if (std::ranges::find(fields, name, &PictureField::name) != fields.end()) return Status::InvalidArgument(name + " is given twice");
  return text;
}

// Of fields that name a dataset and nothing else.
Result<std::string> OnlyDataset(PictureFields fields) {
  Result<std::string> dataset = Take(fields, "dataset", "the name of a dataset of the service");
  if (!dataset.ok()) return dataset;
  if (!fields.empty()) return Status::InvalidArgument(fmt::format("there is no option '{}'", Printable(fields.front().name.substr(0, 64))));
  if (dataset->empty() || dataset->size() > kMaxNameBytes) {
    return Status::InvalidArgument(fmt::format("dataset has {} bytes, but must have 1 to {}", dataset->size(), kMaxNameBytes));
  }
  return dataset;
}

}  // namespace

class Gateway::Impl : public HttpApplication {
 public:
  Impl(Context& context, ServiceAddress service, GatewayOptions options)
      : context_(context),
        service_(std::move(service)),
        options_(std::move(options)),
        rules_(options_.listen, options_.tls.has_value(), options_.proxy_origin),
        work_(asio::make_work_guard(io_)),
        encoders_(std::max(2U, std::thread::hardware_concurrency())),
        routes_(Routes()) {}

  ~Impl() override {
    RequestStop();
    if (thread_.joinable()) thread_.join();
  }

  Status Start() {
    if (!options_.listen.loopback && !options_.tls && options_.proxy_origin.empty()) {
      return Status::InvalidArgument(
          fmt::format("--listen {} leaves this machine: that needs --tls-cert and --tls-key, or --behind-proxy", options_.listen.host));
    }
    if (Status status = CheckToken(options_.token); !status.ok()) return status;
    Result<std::unique_ptr<HttpServer>> server =
        HttpServer::Start(io_, options_.listen.host, options_.listen.port, options_.tls, options_.limits, *this);
    if (!server.ok()) return server.status();
    server_ = *std::move(server);
    port_ = server_->port();
    link_ = std::make_unique<ServiceLink>(context_, service_);
    monitor_ = std::make_unique<ServiceMonitor>(context_, service_, [this](std::shared_ptr<const ServiceNews> news) {
      asio::post(io_, [this, news = std::move(news)]() mutable { OnNews(std::move(news)); });
    });
    thread_ = std::thread([this] { io_.run(); });
    return Status::Ok();
  }

  std::uint16_t port() const { return port_; }

  std::string url() const {
    const bool v6 = options_.listen.host.find(':') != std::string::npos;
    const std::string host = v6 ? "[" + options_.listen.host + "]" : options_.listen.host;
    const std::string origin =
        !options_.proxy_origin.empty() ? options_.proxy_origin : fmt::format("{}://{}:{}", options_.tls ? "https" : "http", host, port_);
    return fmt::format("{}/#token={}", origin, options_.token);
  }

  void RequestStop() {
    if (stopping_.exchange(true)) return;
    asio::post(io_, [this] { Stop(); });
  }

  void WaitUntilStopped() {
    if (thread_.joinable()) thread_.join();
    monitor_.reset();
    link_.reset();
    encoders_.join();
  }

  // ---- HttpApplication

  void Handle(HttpRequest request, ReplyFunction reply) override {
    const auto counted = [this, reply = std::move(reply)](HttpReply answer) {
      metrics_.CountResponse(answer.status);
      reply(std::move(answer));
    };
    if (auto refusal = OriginRefusal(request)) return counted(*std::move(refusal));
    const Result<Target> target = ParseTarget(request.target);
    if (!target.ok()) return counted(Failure(target.status()));
    const auto route = routes_.find(target->path);
    if (route == routes_.end()) {
      if (const Asset* asset = FindAsset(target->path); asset != nullptr && (request.method == "GET" || request.method == "HEAD")) {
        return counted(AssetReply(*asset, request));
      }
      return counted(Failure(404, fmt::format("there is nothing at '{}'", Shown(target->path))));
    }
    if (!route->second.open && !MayAsk(request, *target)) return counted(NoToken());
    const bool get = request.method == "GET" || request.method == "HEAD";
    if (!get && !(request.method == "POST" && route->second.takes_post)) {
      HttpReply answer = Failure(405, fmt::format("{} is not a method of {}", Shown(request.method), target->path));
      answer.headers.emplace_back("Allow", route->second.takes_post ? "GET, HEAD, POST" : "GET, HEAD");
      return counted(std::move(answer));
    }
    route->second.handle(request, *target, counted);
  }

  std::variant<HttpReply, WebSocketAccepted> Accept(const HttpRequest& request) override {
    if (auto refusal = OriginRefusal(request)) return *std::move(refusal);
    const Result<Target> target = ParseTarget(request.target);
    if (!target.ok()) return Failure(target.status());
    if (target->path != "/api/v1/view") return Failure(404, "the WebSocket is /api/v1/view");
    if (!MayAsk(request, *target)) return NoToken();
    if (std::ranges::find(request.subprotocols, kViewProtocol) == request.subprotocols.end()) {
      return Failure(400, fmt::format("the WebSocket needs the subprotocol {}", kViewProtocol));
    }
    if (sessions_.size() >= std::size_t(options_.max_sessions)) {
      CountRefusal("sessions");
      return Failure(429, fmt::format("there are {} views already, which is the limit", sessions_.size()));
    }
    auto session = std::make_shared<ViewSession>(SessionSurroundings{.io = io_, .encoders = encoders_, .metrics = metrics_},
                                                 std::make_unique<ServiceLink>(context_, service_), news_,
                                                 [this](ViewSession& closed) { sessions_.erase(&closed); });
    sessions_.insert(session.get());
    return WebSocketAccepted{.session = std::move(session), .subprotocol = std::string(kViewProtocol)};
  }

  std::vector<std::pair<std::string, std::string>> CommonHeaders() const override {
    std::string frames = "'self' http://localhost:* http://127.0.0.1:*";  // notebooks
    if (!options_.proxy_origin.empty()) frames += " " + options_.proxy_origin;
    return {
        {"Content-Security-Policy",
         fmt::format("default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob: data:; connect-src 'self'; font-src "
                     "'self'; base-uri 'none'; form-action 'none'; frame-ancestors {}",
                     frames)},
        {"X-Content-Type-Options", "nosniff"},
        {"Referrer-Policy", "no-referrer"}};
  }

  void CountRefusal(std::string_view reason) override { metrics_.CountRefusal(reason); }

 private:
  struct Route {
    bool open = false;  // needs no token
    bool takes_post = false;
    std::function<void(const HttpRequest&, const Target&, ReplyFunction)> handle;
  };

  static std::string Shown(const std::string& text) { return text.substr(0, 128); }

  std::map<std::string, Route, std::less<>> Routes() {
    const auto answer = [](std::function<HttpReply()> make) {
      return [make = std::move(make)](const HttpRequest&, const Target&, const ReplyFunction& reply) { reply(make()); };
    };
    std::map<std::string, Route, std::less<>> routes;
    routes["/livez"] = {.open = true, .handle = answer([] { return HttpReply{.type = "text/plain", .body = "ok\n"}; })};
    routes["/readyz"] = {.open = true, .handle = answer([this] {
                                         if (news_->health == ServiceHealth::kReady) return HttpReply{.type = "text/plain", .body = "ok\n"};
                                         return Failure(503, news_->reason);
                                       })};
    routes["/metrics"] = {.handle =
                              answer([this] { return HttpReply{.type = "text/plain; version=0.0.4", .body = metrics_.Text(*news_)}; })};
    routes["/api/v1/openapi.json"] = {.open = true, .handle = answer([] {
                                                      static const std::string text = TextOf(OpenApi());
                                                      return HttpReply{.body = text};
                                                    })};
    routes["/api/v1/status"] = {
        .handle = answer([this] { return news_->health == ServiceHealth::kGone ? ServiceGone() : JsonReply(StatusJson(news_->status)); })};
    routes["/api/v1/datasets"] = {.handle = answer([this] {
                                    if (news_->health == ServiceHealth::kGone) return ServiceGone();
                                    Json datasets = Json::array();
                                    for (const DatasetStatus& dataset : news_->status.datasets) datasets.push_back(DatasetJson(dataset));
                                    return JsonReply({{"datasets", std::move(datasets)}});
                                  })};
    const auto bind = [this](auto method) {
      return [this, method](const HttpRequest& request, const Target& target, ReplyFunction reply) {
        Result<PictureFields> fields = FieldsOf(target, request);
        if (!fields.ok()) return reply(Failure(fields.status()));
        (this->*method)(*std::move(fields), std::move(reply), request.gone);
      };
    };
    routes["/api/v1/render.png"] = {.takes_post = true, .handle = bind(&Impl::RenderPng)};
    routes["/api/v1/slice.png"] = {.takes_post = true, .handle = bind(&Impl::SlicePng)};
    routes["/api/v1/command"] = {.takes_post = true, .handle = bind(&Impl::Command)};
    routes["/api/v1/histogram"] = {.handle = bind(&Impl::Histogram)};
    routes["/api/v1/labels"] = {.handle = bind(&Impl::Labels)};
    routes["/api/v1/value"] = {.handle = bind(&Impl::Value)};
    routes["/api/v1/pick"] = {.takes_post = true, .handle = bind(&Impl::Pick)};
    routes["/api/v1/transfer"] = {.handle = bind(&Impl::Transfer)};
    routes["/api/v1/view"] = {.handle = answer([] { return Failure(426, "this is a WebSocket"); })};
    return routes;
  }

  static HttpReply AssetReply(const Asset& asset, const HttpRequest& request) {
    HttpReply reply{.type = std::string(asset.type), .body = {}, .headers = {{"Cache-Control", "no-cache"}, {"Vary", "Accept-Encoding"}}};
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

  bool MayAsk(const HttpRequest& request, const Target& target) const {
    constexpr std::string_view kBearer = "Bearer ";
    if (request.authorization && std::string_view(*request.authorization).starts_with(kBearer)) {
      return SameToken(std::string_view(*request.authorization).substr(kBearer.size()), options_.token);
    }
    for (const std::string& protocol : request.subprotocols) {
      if (protocol.starts_with(kTokenProtocol)) return SameToken(std::string_view(protocol).substr(kTokenProtocol.size()), options_.token);
    }
    const auto field = std::ranges::find(target.fields, "token", &PictureField::name);
    return field != target.fields.end() && SameToken(field->text, options_.token);
  }

  HttpReply NoToken() {
    CountRefusal("token");
    HttpReply answer = Failure(401, "the token is missing or wrong; it stands in the address that the gateway printed");
    answer.headers.emplace_back("WWW-Authenticate", "Bearer");
    return answer;
  }

  void OnNews(std::shared_ptr<const ServiceNews> news) {
    if (news->health != news_->health) {
      Log(news->health == ServiceHealth::kReady ? LogLevel::kInfo : LogLevel::kWarning,
          fmt::format("the service is {}{}{}", NameOf(news->health), news->reason.empty() ? "" : ": ", news->reason));
    }
    news_ = std::move(news);
    for (ViewSession* session : std::set<ViewSession*>(sessions_)) session->OnNews(news_);
  }

  void Stop() {
    monitor_->RequestStop();
    link_->RequestStop();
    for (ViewSession* session : std::set<ViewSession*>(sessions_)) session->End();
    // Farewells get a moment to leave.
    auto timer = std::make_shared<asio::steady_timer>(io_, std::chrono::milliseconds(200));
    timer->async_wait([this, timer](boost::system::error_code) {
      server_->Stop();
      work_.reset();  // the io thread ends when all connections have
    });
  }

  // ---- pictures

  // Renders the frames, has `encode` make a PNG of the pictures on an encoder's thread, and replies with it.
  using EncodeFunction = std::function<Result<std::vector<std::byte>>(std::vector<Picture>)>;
  void MakePng(std::vector<FrameRequest> frames, EncodeFunction encode, ReplyFunction reply, const Gone& gone) {
    if (renders_ >= options_.max_renders) {
      CountRefusal("renders");
      return reply(Failure(429, fmt::format("{} pictures are under way, which is the limit", renders_)));
    }
    ++renders_;
    const auto ended = std::make_shared<bool>(false);  // of the io thread
    const auto finish = [this, reply = std::move(reply), ended](Result<std::vector<std::byte>> png) {
      asio::post(io_, [this, reply, ended, png = std::move(png)] {
        if (std::exchange(*ended, true)) return;  // nobody waits for it any more
        --renders_;
        if (!png.ok()) return reply(Failure(png.status()));
        reply({.type = "image/png",
               .body = std::string(reinterpret_cast<const char*>(png->data()), png->size()),
               .headers = {{"Cache-Control", "no-store"}}});
      });
    };
    const ServiceLink::Ticket ticket =
        link_->Render(std::move(frames), kRenderDeadline,
                      {.progress = {}, .done = [this, encode = std::move(encode), finish](Result<std::vector<Picture>> pictures) {
                         if (!pictures.ok()) return finish(pictures.status());
                         metrics_.CountFrame(pictures->front().statistics, pictures->front().latency);
                         // Handlers of asio are copied nowhere, but std::function would copy the pictures.
                         auto held = std::make_shared<std::vector<Picture>>(*std::move(pictures));
                         asio::post(encoders_, [this, encode, finish, held] {
                           const Time begin = MonotonicNow();
                           Result<std::vector<std::byte>> png = encode(std::move(*held));
                           if (png.ok()) metrics_.CountPicture("file", png->size(), MonotonicNow() - begin);
                           finish(std::move(png));
                         });
                       }});
    *gone = [this, ended, ticket] {
      if (std::exchange(*ended, true)) return;
      --renders_;
      CountRefusal("gone");
      link_->Cancel(ticket);
    };
  }

  void RenderPng(const PictureFields& fields, ReplyFunction reply, const Gone& gone) {
    Result<RenderRequest> render = ParseRenderFields(fields);
    if (!render.ok()) return reply(Failure(render.status()));
    const auto encode = [request = *render](std::vector<Picture> pictures) {
      const Picture& picture = pictures.front();
      const PictureNotes notes{.geometry = picture.geometry,
                               .record = RecordText(request.frame.dataset, request.frame, request.format, picture.geometry)};
      return PngFile(picture.image, picture.size, request.format, notes);
    };
    MakePng({render->frame}, encode, std::move(reply), gone);
  }

  void SlicePng(const PictureFields& fields, ReplyFunction reply, const Gone& gone) {
    Result<SliceRequest> slice = ParseSliceFields(fields);
    if (!slice.ok()) return reply(Failure(slice.status()));
    Result<std::vector<FrameRequest>> frames = FramesOf(*slice);
    if (!frames.ok()) return reply(Failure(frames.status()));
    const auto encode = [request = *slice](std::vector<Picture> pictures) {
      std::vector<LocalImage> images;
      for (Picture& picture : pictures) images.push_back(std::move(picture.image));
      return PngFile(SideBySide(images, request.frame.size), request.size(), request.format);
    };
    MakePng(*std::move(frames), encode, std::move(reply), gone);
  }

  // ---- questions about what datasets hold

  using JsonFunction = std::function<HttpReply(const QuestionReply&)>;
  void Ask(std::string_view name, Question question, JsonFunction make, ReplyFunction reply, const Gone& gone) {
    if (questions_ >= kMaxQuestions) {
      CountRefusal("questions");
      return reply(Failure(429, fmt::format("{} questions are under way, which is the limit", questions_)));
    }
    ++questions_;
    const auto ended = std::make_shared<bool>(false);  // of the io thread
    const auto done = [this, name, ended, make = std::move(make), reply = std::move(reply),
                       begin = MonotonicNow()](Result<QuestionReply> answer) {
      asio::post(io_, [this, name, ended, make, reply, begin, answer = std::move(answer)] {
        if (std::exchange(*ended, true)) return;
        --questions_;
        if (!answer.ok()) return reply(Failure(answer.status()));
        metrics_.CountAnswer(name, MonotonicNow() - begin);
        HttpReply made = make(*answer);
        made.headers.emplace_back("Cache-Control", "no-store");
        reply(std::move(made));
      });
    };
    const ServiceLink::Ticket ticket = link_->Ask(std::move(question), kRenderDeadline, done);
    *gone = [this, ended, ticket] {
      if (std::exchange(*ended, true)) return;
      --questions_;
      CountRefusal("gone");
      link_->Cancel(ticket);
    };
  }

  void Histogram(const PictureFields& fields, ReplyFunction reply, const Gone& gone) {
    Result<std::string> dataset = OnlyDataset(fields);
    if (!dataset.ok()) return reply(Failure(dataset.status()));
    const auto make = [name = *dataset](const QuestionReply& answer) {
      return JsonReply(HistogramJson(name, std::get<SummaryReply>(answer)));
    };
    Ask("histogram", SummaryQuery{.dataset = *dataset, .transfer = {}}, make, std::move(reply), gone);
  }

  void Labels(const PictureFields& fields, ReplyFunction reply, const Gone& gone) {
    Result<std::string> dataset = OnlyDataset(fields);
    if (!dataset.ok()) return reply(Failure(dataset.status()));
    const auto make = [name = *dataset](const QuestionReply& answer) {
      return JsonReply(LabelsJson(name, std::get<SummaryReply>(answer)));
    };
    Ask("labels", SummaryQuery{.dataset = *dataset, .transfer = {}}, make, std::move(reply), gone);
  }

  void Value(PictureFields fields, ReplyFunction reply, const Gone& gone) {
    const Result<std::string> at = Take(fields, "at", kPointHelp);
    if (!at.ok()) return reply(Failure(at.status()));
    const Result<Vec3> point = ParsePoint("at", *at);
    if (!point.ok()) return reply(Failure(Printable(point.status())));
    const Result<std::string> dataset = OnlyDataset(fields);
    if (!dataset.ok()) return reply(Failure(dataset.status()));
    const auto make = [](const QuestionReply& answer) { return JsonReply(SampleJson(std::get<SampleReply>(answer).samples.at(0))); };
    Ask("value", SampleQuery{.dataset = *dataset, .points = {*point}}, make, std::move(reply), gone);
  }

  void Pick(PictureFields fields, ReplyFunction reply, const Gone& gone) {
    const Result<std::string> x_text = Take(fields, "x", kPixelXHelp), y_text = Take(fields, "y", kPixelYHelp);
    for (const Result<std::string>* text : {&x_text, &y_text}) {
      if (!text->ok()) return reply(Failure(text->status()));
    }
    const Result<RenderRequest> render = ParseRenderFields(fields);
    if (!render.ok()) return reply(Failure(render.status()));
    const Result<double> x = ParseNumber("x", *x_text, {0, double(render->frame.size.width)});
    const Result<double> y = ParseNumber("y", *y_text, {0, double(render->frame.size.height)});
    for (const Result<double>* number : {&x, &y}) {
      if (!number->ok()) return reply(Failure(Printable(number->status())));
    }
    const auto make = [](const QuestionReply& answer) { return JsonReply(PickJson(std::get<PickReply>(answer))); };
    Ask("pick", PickQuery{.frame = render->frame, .x = *x, .y = *y}, make, std::move(reply), gone);
  }

  void Transfer(const PictureFields& fields, ReplyFunction reply, const Gone& gone) {
    for (const PictureField& field : fields) {
      if (field.name != "dataset" && field.name != "transfer" && field.name != "scalar-range") {
        return reply(Failure(
            400, fmt::format("there is no option '{}': dataset, transfer and scalar-range are taken", Shown(Printable(field.name)))));
      }
    }
    const Result<RenderRequest> render = ParseRenderFields(fields);
    if (!render.ok()) return reply(Failure(render.status()));
    const auto* preset = std::get_if<std::string>(&render->frame.transfer.choice);
    const auto make = [name = preset != nullptr ? *preset : "function"](const QuestionReply& answer) {
      return HttpReply{.body = FormatParaViewColorMap(std::get<SummaryReply>(answer).transfer, name)};
    };
    Ask("transfer", SummaryQuery{.dataset = render->frame.dataset, .transfer = render->frame.transfer}, make, std::move(reply), gone);
  }

  void Command(const PictureFields& fields, const ReplyFunction& reply, const Gone&) {
    const Result<RenderRequest> render = ParseRenderFields(fields);
    if (!render.ok()) return reply(Failure(render.status()));
    PictureRecord record;
    record.source = render->frame.dataset;
    record.request = render->frame;
    record.format = render->format;
    Json files = Json::object();  // those that the line names
    const auto add = [&files](const TransferChoice& transfer, const char* name) {
      const auto* function = std::get_if<TransferFunction>(&transfer.choice);
      if (function != nullptr) files[name] = FormatParaViewColorMap(*function, name);
    };
    add(render->frame.transfer, kColorMapFile);
    if (render->frame.overlay) add(render->frame.overlay->transfer, kOverlayMapFile);
    reply(JsonReply({{"command", CommandText(record, "picture.png")}, {"files", std::move(files)}}));
  }

  Context& context_;
  const ServiceAddress service_;
  const GatewayOptions options_;
  const OriginRules rules_;
  Metrics metrics_;
  asio::io_context io_{1};
  asio::executor_work_guard<asio::io_context::executor_type> work_;
  asio::thread_pool encoders_;
  const std::map<std::string, Route, std::less<>> routes_;
  std::unique_ptr<HttpServer> server_;
  std::uint16_t port_ = 0;
  std::unique_ptr<ServiceLink> link_;
  std::unique_ptr<ServiceMonitor> monitor_;
  std::atomic<bool> stopping_ = false;
  // Of the io thread.
  std::set<ViewSession*> sessions_;
  std::shared_ptr<const ServiceNews> news_ = std::make_shared<const ServiceNews>();
  int renders_ = 0, questions_ = 0;
  std::thread thread_;
};

Gateway::Gateway(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Gateway::~Gateway() {
  RequestStop();
  WaitUntilStopped();
}

Result<std::unique_ptr<Gateway>> Gateway::Start(Context& context, ServiceAddress service, GatewayOptions options) {
  auto impl = std::make_unique<Impl>(context, std::move(service), std::move(options));
  if (Status status = impl->Start(); !status.ok()) return status;
  return std::unique_ptr<Gateway>(new Gateway(std::move(impl)));
}

std::uint16_t Gateway::port() const { return impl_->port(); }
std::string Gateway::url() const { return impl_->url(); }
void Gateway::RequestStop() { impl_->RequestStop(); }
void Gateway::WaitUntilStopped() { impl_->WaitUntilStopped(); }

}  // namespace slabstream
