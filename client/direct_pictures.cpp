#include "client/direct_pictures.h"

#include <algorithm>

#include "common/base/log.h"
#include "common/transport/authenticator.h"
#include "common/transport/endpoint.h"
#include "common/wire/any_message.h"

namespace slabstream {
namespace {

// A worker may connect before the coordinator has named it here.
constexpr Duration kPatience = std::chrono::seconds(3);
constexpr std::size_t kMaxConnections = 4096;
constexpr Duration kLastPictures = std::chrono::minutes(1);  // those of a worker that has left may still be on their way

}  // namespace

std::unique_ptr<DirectPictures> DirectPictures::Open(Context& context, const std::string& service_endpoint) {
  Result<Endpoint> here = ParseEndpoint(service_endpoint, false);
  if (!here.ok() || here->scheme != Scheme::kTcp) return nullptr;
  const KeyPair keys = MakeKeyPair();
  const std::string plane = "pictures-" + keys.public_key;
  const SocketOptions options{.max_connections = kMaxConnections,
                              .server_keys = ServerKeys{.secret_key = keys.secret_key, .plane = plane, .sealed = true}};
  const auto bound = [&](Socket& socket) -> Result<std::string> {
    Result<std::string> host = LocalHostTowards(*here);
    if (!host.ok()) return host.status();
    here->host = *std::move(host);
    here->port = 0;
    return socket.Bind(here->ToString());
  };
  Result<Socket> socket = Socket::Router(context, options);
  const Result<std::string> endpoint = socket.ok() ? bound(*socket) : Result<std::string>(socket.status());
  if (!endpoint.ok()) {
    LogDebug("pictures come through the coordinator: " + endpoint.status().message());
    return nullptr;
  }
  context.authenticator().SetPatience(plane, kPatience);
  const PicturesDoor door{std::uint16_t(ParseEndpoint(*endpoint, true)->port), keys.public_key};
  return std::unique_ptr<DirectPictures>(new DirectPictures(context, *std::move(socket), door, plane));
}

DirectPictures::~DirectPictures() { context_.authenticator().Forget(plane_); }

void DirectPictures::Admit(const PictureSenders& senders, Time now) {
  std::set<std::string> keys(senders.keys.begin(), senders.keys.end());
  for (const std::string& key : admitted_) {
    if (!keys.contains(key)) left_.emplace(key, now);
  }
  std::erase_if(left_, [&](const auto& entry) {
    if (keys.contains(entry.first)) return true;
    if (now - entry.second < kLastPictures) return false;
    socket_.EndConnections(entry.first);
    return true;
  });
  context_.authenticator().AdmitOnly(plane_, keys);
  admitted_ = std::move(keys);
  senders_ = senders.version;
}

std::uint64_t DirectPictures::Receive() {
  std::uint64_t received = 0;
  while (const std::optional<Incoming> incoming = socket_.TryReceive()) {
    const Bytes payload = incoming->payload();
    const Result<WorkerToClient> message = Decode<WorkerToClient>(incoming->header(), payload.size());
    if (!message.ok()) {
      LogWarning("pictures plane: dropped a message: " + message.status().message());
      continue;
    }
    received += payload.size();
    arrived_.emplace_back(std::get<SentPicture>(*message).digest, payload);
    arrived_bytes_ += payload.size();
    while (arrived_bytes_ > kMostUnclaimedBytes && arrived_.size() > 1) {
      arrived_bytes_ -= arrived_.front().second.size();
      arrived_.pop_front();
    }
  }
  return received;
}

std::vector<DirectPictures::Reply> DirectPictures::TakeCome() {
  std::vector<Reply> come;
  std::erase_if(awaited_, [&](Awaited& awaited) {
    if (!Complete(awaited.reply)) return false;
    come.push_back(std::move(awaited.reply));
    return true;
  });
  return come;
}

std::vector<DirectPictures::Lost> DirectPictures::TakeLost(Time now) {
  std::vector<Lost> lost;
  std::erase_if(awaited_, [&](Awaited& awaited) {
    if (now < awaited.until) return false;
    std::uint64_t missing_bytes = 0;
    for (std::size_t share = 0; share < awaited.reply.runs.size(); ++share) {
      const PictureShare& wanted = awaited.reply.message.shares[share];
      if (wanted.direct && awaited.reply.runs[share].empty()) missing_bytes += wanted.runs.encoded_bytes;
    }
    lost.push_back({std::move(awaited.reply.message), missing_bytes});
    return true;
  });
  return lost;
}

Time DirectPictures::NextLoss() const {
  Time next = Time::max();
  for (const Awaited& awaited : awaited_) next = std::min(next, awaited.until);
  return next;
}

void DirectPictures::DropUnclaimed() {
  arrived_.clear();
  arrived_bytes_ = 0;
}

void DirectPictures::Clear() {
  DropUnclaimed();
  awaited_.clear();
}

bool DirectPictures::Complete(Reply& reply) {
  bool complete = true;
  for (std::size_t share = 0; share < reply.runs.size(); ++share) {
    const PictureShare& wanted = reply.message.shares[share];
    if (!wanted.direct || !reply.runs[share].empty()) continue;
    if (std::optional<Bytes> runs = Take(wanted.runs.digest, wanted.runs.encoded_bytes)) {
      reply.runs[share] = *std::move(runs);
    } else {
      complete = false;
    }
  }
  return complete;
}

std::optional<Bytes> DirectPictures::Take(std::uint64_t digest, std::uint64_t bytes) {
  const auto found = std::ranges::find_if(arrived_, [&](const auto& each) { return each.first == digest && each.second.size() == bytes; });
  if (found == arrived_.end()) return std::nullopt;
  Bytes payload = std::move(found->second);
  arrived_bytes_ -= bytes;
  arrived_.erase(found);
  return payload;
}

}  // namespace slabstream
