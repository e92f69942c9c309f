#include "client/api/slabstream/client.h"

#include <atomic>
#include <limits>
#include <mutex>
#include <variant>

#include "client/client.h"
#include "client/pictures/picture_writer.h"
#include "client/report/status_text.h"
#include "client/request/picture_fields.h"
#include "client/request/picture_record.h"
#include "client/service/service_state.h"
#include "common/base/time.h"
#include "common/json/json.h"

namespace slabstream {
inline namespace v0 {
namespace {

constexpr Duration kCancellationTime = std::chrono::milliseconds(20);  // between looks at whether a call was cancelled

void ThrowUnlessOk(const Status& status) {
  if (!status.ok()) throw Error(ErrorCode(status.code()), status.message());
}

template <class T>
T ValueOf(Result<T> result) {
  ThrowUnlessOk(result.status());
  return *std::move(result);
}

RenderRequest ParseRequest(const std::string& dataset, const Options& options) {
  PictureFields fields = {{"dataset", dataset}};
  for (const auto& [name, text] : options) fields.push_back({name, text});
  return ValueOf(ParseRenderFields(fields));
}

Progress ProgressOf(const FrameProgress& progress) {
  return {.phase = Progress::Phase(progress.phase),
          .queue_position = int(progress.queue_position),
          .read_percent = int(progress.read_percent),
          .groups_done = int(progress.groups_done),
          .group_count = int(progress.group_count),
          .workers = int(progress.workers)};
}

// Calls function(y, first) for each row y of the bounds. Its first pixel has the index `first` in a picture of `width` pixels a row.
template <class Function>
void ForEachRow(const PixelBounds& bounds, int width, Function&& function) {
  for (int y = bounds.y_begin; y < bounds.y_end; ++y) function(y, std::size_t(y) * std::size_t(width) + std::size_t(bounds.x_begin));
}

// A request that is under way; cancelled unless it has ended.
class OpenRender {
 public:
  OpenRender(Client& client, const FrameRequest& frame, Duration deadline) : client_(client), id_(client.Submit(frame, deadline)) {}
  ~OpenRender() {
    if (!ended_) client_.Cancel(id_);
  }
  OpenRender(const OpenRender&) = delete;
  OpenRender& operator=(const OpenRender&) = delete;

  // Its next event, if there is one within kCancellationTime.
  std::optional<ClientEvent> Next() {
    std::optional<ClientEvent> event = client_.Next(kCancellationTime);
    if (!event || event->request != id_) return std::nullopt;
    const auto* picture = std::get_if<Picture>(&event->what);
    ended_ = std::holds_alternative<Status>(event->what) || (picture != nullptr && picture->final);
    return event;
  }

 private:
  Client& client_;
  RequestId id_;
  bool ended_ = false;
};

}  // namespace

// ---- Error

Error::Error(ErrorCode code, const std::string& message) : std::runtime_error(message), code_(code) {}
Error::Error(const Error&) noexcept = default;
Error::~Error() = default;

// ---- Image

struct __attribute__((visibility("hidden"))) Image::Impl {
  Picture picture;
  PictureFormat format;
  PictureNotes notes;
};

Image::Image(std::shared_ptr<const Impl> impl) noexcept : impl_(std::move(impl)) {}
Image::Image(const Image&) noexcept = default;
Image& Image::operator=(const Image&) noexcept = default;
Image::~Image() = default;

int Image::width() const noexcept { return impl_->picture.size.width; }
int Image::height() const noexcept { return impl_->picture.size.height; }
bool Image::final() const noexcept { return impl_->picture.final; }
int Image::groups_done() const noexcept { return int(impl_->picture.groups_done); }
int Image::group_count() const noexcept { return int(impl_->picture.group_count); }
std::chrono::nanoseconds Image::latency() const noexcept { return impl_->picture.latency; }

std::vector<float> Image::Rgba() const {
  const PictureImage& image = impl_->picture.image;
  std::vector<float> rgba(4 * std::size_t(width()) * std::size_t(height()));
  ForEachRow(image.bounds(), width(), [&](int y, std::size_t first) { image.ReadColors(y, &rgba[4 * first]); });
  return rgba;
}

std::vector<float> Image::Depth() const {
  const PictureImage& image = impl_->picture.image;
  if (!image.has_depth()) return {};
  std::vector<float> depth(std::size_t(width()) * std::size_t(height()), std::numeric_limits<float>::infinity());
  ForEachRow(image.bounds(), width(), [&](int y, std::size_t first) { image.ReadDepths(y, &depth[first]); });
  return depth;
}

std::vector<std::byte> Image::Png() const {
  return ValueOf(PictureFile(PictureFileType::kPng, impl_->picture.image, impl_->picture.size, impl_->format, impl_->notes));
}

std::vector<std::byte> Image::Jpeg(int quality) const {
  if (quality < 1 || quality > 100) throw Error(ErrorCode::kInvalidArgument, "quality " + std::to_string(quality) + " is not in [1, 100]");
  PictureFormat format = impl_->format;
  format.quality = quality;
  return ValueOf(PictureFile(PictureFileType::kJpeg, impl_->picture.image, impl_->picture.size, format, impl_->notes));
}

void Image::Save(const std::string& path) const {
  ThrowUnlessOk(WritePicture(impl_->picture.image, impl_->picture.size, path, impl_->format, impl_->notes));
}

// ---- Cancellation

struct __attribute__((visibility("hidden"))) Cancellation::Impl {
  std::atomic<bool> cancelled = false;
};

Cancellation::Cancellation() : impl_(std::make_shared<Impl>()) {}
Cancellation::Cancellation(const Cancellation&) noexcept = default;
Cancellation& Cancellation::operator=(const Cancellation&) noexcept = default;
Cancellation::~Cancellation() = default;

void Cancellation::Cancel() const noexcept { impl_->cancelled = true; }
bool Cancellation::cancelled() const noexcept { return impl_->cancelled; }

// ---- Service

struct __attribute__((visibility("hidden"))) Service::Impl {
  static std::unique_ptr<Impl> Connect(const Address& address, std::chrono::milliseconds timeout) {
    const ServiceAddress service = ValueOf(ResolveService({.endpoint = address.endpoint, .file = address.service_file}));
    auto impl = std::make_unique<Impl>();
    impl->client.emplace(ValueOf(Client::Connect(impl->context, service, timeout)));
    return impl;
  }

  std::mutex mutex;  // for the client
  Context context;
  std::optional<Client> client;
};

Service::Service(std::unique_ptr<Impl> impl) noexcept : impl_(std::move(impl)) {}
Service::Service(Service&&) noexcept = default;
Service& Service::operator=(Service&&) noexcept = default;
Service::~Service() = default;

Service Service::Connect(const Address& address, std::chrono::milliseconds timeout) { return Service(Impl::Connect(address, timeout)); }

Image Service::Render(const std::string& dataset, const Options& options, const RenderCall& call) {
  if (call.deadline < std::chrono::milliseconds(1) || call.deadline > std::chrono::hours(24)) {
    throw Error(ErrorCode::kInvalidArgument, "deadline of " + std::to_string(call.deadline.count()) + " ms is not in [1 ms, 24 h]");
  }
  RenderRequest request = ParseRequest(dataset, options);
  request.frame.previews = call.on_preview != nullptr;
  request.frame.key = request.format.annotations.needs_key();
  ThrowUnlessOk(CheckCanDraw(request.format.annotations));

  const std::lock_guard lock(impl_->mutex);
  const auto image_of = [&](Picture picture) {
    const FrameRequest made = AsMade(request.frame, picture.statistics);
    PictureNotes notes{.geometry = picture.geometry,
                       .key = std::move(picture.key),
                       .record = RecordText(dataset, made, request.format, picture.geometry, {}, picture.statistics.levels)};
    return Image(std::make_shared<const Image::Impl>(Image::Impl{std::move(picture), request.format, std::move(notes)}));
  };
  OpenRender render(*impl_->client, request.frame, call.deadline);
  while (!call.cancellation.cancelled()) {
    std::optional<ClientEvent> event = render.Next();
    if (!event) continue;
    if (const auto* status = std::get_if<Status>(&event->what)) ThrowUnlessOk(*status);
    if (const auto* progress = std::get_if<FrameProgress>(&event->what); progress != nullptr && call.on_progress) {
      call.on_progress(ProgressOf(*progress));
    }
    if (auto* picture = std::get_if<Picture>(&event->what)) {
      const bool final = picture->final;
      const Image image = image_of(std::move(*picture));
      if (final) return image;
      if (call.on_preview) call.on_preview(image);
    }
  }
  throw Error(ErrorCode::kCancelled, "the picture of dataset '" + dataset + "' was cancelled");
}

void Service::Steer(const std::string& dataset, const std::vector<std::pair<std::string, double>>& values) {
  SteerDataset order{.dataset = dataset};
  for (const auto& [name, value] : values) order.values.push_back({name, value});
  const std::lock_guard lock(impl_->mutex);
  ThrowUnlessOk(impl_->client->Steer(std::move(order)).status());
}

std::vector<std::string> Service::Datasets() {
  const std::lock_guard lock(impl_->mutex);
  std::vector<std::string> names;
  for (DatasetStatus& dataset : ValueOf(impl_->client->OrderData({.action = DataAction::kList}))) names.push_back(std::move(dataset.name));
  return names;
}

std::string Service::StatusJson() {
  const std::lock_guard lock(impl_->mutex);
  const StatusReply reply = ValueOf(impl_->client->QueryStatus());
  return slabstream::StatusJson(reply).dump(2);
}

}  // namespace v0
}  // namespace slabstream
