#include "client/file_upload.h"

#include <algorithm>
#include <utility>

#include "common/base/time.h"
#include "common/threads/guarded.h"
#include "common/wire/any_message.h"

namespace slabstream {
namespace {

constexpr std::uint64_t kUploadNonce = 1;  // pings have those that follow

}  // namespace

FileUpload::FileUpload(Context& context, const ServiceAddress& service, std::string name, SentFile file, Events events)
    : order_{.nonce = kUploadNonce, .name = std::move(name), .description = {}, .labels = {}, .file = std::move(file)},
      events_(std::move(events)),
      pings_(kUploadNonce) {
  thread_ = std::thread([this, &context, service] { Run(context, service); });
}

FileUpload::~FileUpload() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  wakeup_.Notify();
  thread_.join();
}

void FileUpload::Add(Bytes bytes) {
  {
    const std::lock_guard lock(mutex_);
    added_.push_back(std::move(bytes));
  }
  wakeup_.Notify();
}

void FileUpload::Run(Context& context, const ServiceAddress& service) {
  Result<Socket> socket = Socket::Dealer(context, {.client_keys = service.keys});
  const Status status = Guarded("the upload", [&]() -> Status {
    Status so_far = socket.status();
    if (so_far.ok()) so_far = socket->Connect(service.endpoint);
    if (so_far.ok()) so_far = socket->Send({}, Encode(order_));
    return so_far.ok() ? Serve(*socket) : so_far;
  });
  if (!status.ok()) return events_.changed(status);
  (void)socket->Send({}, Encode(DropVolume{kUploadNonce}));  // it lingers as long as the destructor says
}

Status FileUpload::Serve(Socket& socket) {
  const ClientTiming timing;
  Time next_ping = MonotonicNow(), heard = next_ping;
  while (true) {
    {
      const std::lock_guard lock(mutex_);
      if (stopping_) return Status::Ok();
    }
    if (const Status sent = SendParts(socket); !sent.ok()) return sent;
    const Time now = MonotonicNow();
    if (now >= next_ping) {
      (void)socket.Send({}, Encode(ClientPing{.nonce = ++pings_, .open = {}, .asked = {kUploadNonce}}));
      next_ping = now + timing.ping;
    }
    Socket* const sockets[] = {&socket};
    (void)Wait(sockets, &wakeup_, next_ping - now);
    const Result<bool> received = Receive(socket);
    if (!received.ok()) return received.status();
    if (*received) heard = MonotonicNow();
    if (socket.refused()) return Status::Unavailable("the service refuses the key: it was revoked or is another's");
    if (MonotonicNow() - heard > timing.silence) return Status::Unavailable("the service does not answer");
  }
}

Status FileUpload::SendParts(Socket& socket) {
  const std::uint64_t before = sent_;
  while (sent_ < allowed_) {
    Bytes part;
    {
      const std::lock_guard lock(mutex_);
      if (added_.empty()) break;
      Bytes& next = added_.front();
      const std::size_t bytes = std::min<std::uint64_t>({next.size(), kMaxVolumePartBytes, allowed_ - sent_});
      part = next.Part(0, bytes);
      next = next.Part(bytes, next.size() - bytes);
      if (next.empty()) added_.erase(added_.begin());
    }
    const VolumePart header{.nonce = kUploadNonce, .begin = sent_, .bytes = std::uint32_t(part.size())};
    if (Status sent = socket.Send({}, Encode(header), part); !sent.ok()) return sent;
    sent_ += part.size();
  }
  if (sent_ > before) events_.sent(sent_);
  return Status::Ok();
}

Result<bool> FileUpload::Receive(Socket& socket) {
  bool received = false;
  while (const std::optional<Incoming> incoming = socket.TryReceive()) {
    const Result<CoordinatorToClient> message = Decode<CoordinatorToClient>(incoming->header(), incoming->payload().size());
    if (!message.ok()) return message.status();
    received = true;
    if (const auto* credit = std::get_if<VolumeCredit>(&*message)) allowed_ = std::max(allowed_, credit->allowed);
    if (const auto* refused = std::get_if<OrderRefused>(&*message)) return refused->status;
    if (std::holds_alternative<DataReply>(*message)) events_.changed(Status::Ok());
    if (const auto* pong = std::get_if<ClientPong>(&*message); pong != nullptr && !pong->lost.empty())
      return Status::Unavailable("the service has lost what was sent: it was restarted, or an admin has removed it");
  }
  return received;
}

}  // namespace slabstream
