#include "common/transport/authenticator.h"

#include <algorithm>
#include <array>
#include <deque>
#include <iterator>
#include <map>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>
#include <zmq.hpp>

#include "common/base/limited_log.h"
#include "common/threads/guarded.h"
#include "common/transport/context_impl.h"
#include "common/transport/latest_seals.h"
#include "common/transport/socket.h"

namespace slabstream {
namespace {

constexpr char kEndpoint[] = "inproc://zeromq.zap.01";
constexpr char kVersion[] = "1.0";
constexpr std::size_t kKeyBytes = 32;
constexpr std::size_t kMostWaiting = 1024;  // handshakes; more must try again
constexpr std::chrono::milliseconds kBetweenLooks{50}, kUntilAsked{-1};

struct Request {
  std::vector<zmq::message_t> route;  // to where the answer goes, with the empty frame behind it
  std::string id, plane, public_key;
  std::optional<Seal> seal;  // of a sealed connection
  Time asked;
};

std::string KeyText(const zmq::message_t& key) {
  std::array<char, 41> text{};
  if (key.size() != kKeyBytes || zmq_z85_encode(text.data(), static_cast<const std::uint8_t*>(key.data()), kKeyBytes) == nullptr) return "";
  return text.data();
}

}  // namespace

struct Authenticator::Impl {
  explicit Impl(zmq::context_t& context) : socket(context, zmq::socket_type::router) {
    socket.set(zmq::sockopt::linger, 0);
    socket.bind(kEndpoint);
  }

  struct Plane {
    std::set<std::string> admitted;
    Duration patience{};
    std::shared_ptr<LatestSeals> seals;  // null: CURVE
  };
  enum class Verdict { kAdmit, kWait, kNotYet, kRefuse };

  Verdict Judge(const Request& request) {
    const std::lock_guard lock(mutex);
    const auto plane = planes.find(request.plane);
    if (plane == planes.end() || request.public_key.empty()) return Verdict::kRefuse;
    if (plane->second.admitted.contains(request.public_key)) {
      const bool enters = !request.seal || plane->second.seals->Enter(request.public_key, *request.seal);
      return enters ? Verdict::kAdmit : Verdict::kRefuse;
    }
    if (plane->second.patience == Duration::zero()) return Verdict::kRefuse;
    return MonotonicNow() - request.asked < plane->second.patience && waiting.size() < kMostWaiting ? Verdict::kWait : Verdict::kNotYet;
  }

  void Answer(Request& request, Verdict verdict) {
    for (zmq::message_t& part : request.route) socket.send(part, zmq::send_flags::sndmore);
    const bool admit = verdict == Verdict::kAdmit;
    const std::string code = admit ? "200" : verdict == Verdict::kNotYet ? "300" : "400";
    // The key becomes the name of the connection's user.
    const std::array<std::string, 6> parts = {kVersion, request.id, code, admit ? "OK" : "unknown key", request.public_key, ""};
    for (std::size_t i = 0; i < parts.size(); ++i) {
      socket.send(zmq::buffer(parts[i]), i + 1 < parts.size() ? zmq::send_flags::sndmore : zmq::send_flags::none);
    }
    if (verdict == Verdict::kRefuse) complaints.Warning("refused a connection to the " + request.plane + " plane: unknown key");
  }

  // Names the sender and the seal if the ticket is the sender's.
  void ReadTicket(const std::string& public_key, std::string_view ticket, Request& request) {
    std::shared_ptr<LatestSeals> seals;
    {
      const std::lock_guard lock(mutex);
      if (const auto plane = planes.find(request.plane); plane != planes.end()) seals = plane->second.seals;
    }
    if (seals != nullptr) request.seal = seals->Read(ticket, public_key);
    if (request.seal) request.public_key = public_key;
  }

  // False: nothing is there.
  bool Receive() {
    std::vector<zmq::message_t> parts;
    do {
      zmq::message_t& part = parts.emplace_back();
      if (!socket.recv(part, zmq::recv_flags::dontwait)) return false;
    } while (parts.back().more());
    // Route, empty; version, request, domain, address, identity, mechanism, credentials.
    const auto empty = std::ranges::find_if(parts, [](const zmq::message_t& part) { return part.size() == 0; });
    const auto rest = std::size_t(parts.end() - empty);
    if (rest < 8 || empty[1].to_string_view() != kVersion) return true;
    Request request{.id = empty[2].to_string(), .plane = empty[3].to_string(), .asked = MonotonicNow()};
    if (rest == 8 && empty[6].to_string_view() == "CURVE") request.public_key = KeyText(empty[7]);
    if (rest == 9 && empty[6].to_string_view() == "PLAIN") ReadTicket(empty[7].to_string(), empty[8].to_string_view(), request);
    request.route.assign(std::make_move_iterator(parts.begin()), std::make_move_iterator(empty + 1));
    waiting.push_back(std::move(request));
    return true;
  }

  // Waits for requests, for news about keys, or for the end of somebody's patience, and answers whoever can be answered.
  void Serve() {
    std::array<zmq::pollitem_t, 2> items = {{{socket.handle(), 0, ZMQ_POLLIN, 0}, {nullptr, wakeup.file_descriptor(), ZMQ_POLLIN, 0}}};
    zmq::poll(items.data(), items.size(), waiting.empty() ? kUntilAsked : kBetweenLooks);
    wakeup.Drain();
    while (Receive()) {
    }
    for (std::deque<Request> asked = std::exchange(waiting, {}); !asked.empty(); asked.pop_front()) {
      const Verdict verdict = Judge(asked.front());
      if (verdict == Verdict::kWait) {
        waiting.push_back(std::move(asked.front()));
      } else {
        Answer(asked.front(), verdict);
      }
    }
  }

  void Run(const std::stop_token& stop) {
    while (!stop.stop_requested()) {
      const Status served = Guarded("authentication", [this] { Serve(); });  // whoever got no answer tries again
      if (!served.ok()) complaints.Warning(served.message());
    }
  }

  zmq::socket_t socket;
  Wakeup wakeup;
  std::deque<Request> waiting;                                          // the thread's, as is complaints
  LimitedLog complaints{LimitedLog::kAtOnce, std::chrono::minutes(1)};  // a peer with a lost key may try for months
  std::mutex mutex;
  std::map<std::string, Plane> planes;  // guarded by mutex
  std::jthread thread;                  // last member
};

Authenticator::Authenticator(Context& context) : impl_(std::make_unique<Impl>(context.impl().context)) {
  impl_->thread = std::jthread([impl = impl_.get()](const std::stop_token& stop) { impl->Run(stop); });
}

Authenticator::~Authenticator() {
  impl_->thread.request_stop();
  impl_->wakeup.Notify();
}

void Authenticator::AdmitOnly(const std::string& plane, std::set<std::string> public_keys) {
  {
    const std::lock_guard lock(impl_->mutex);
    impl_->planes[plane].admitted = std::move(public_keys);
  }
  impl_->wakeup.Notify();
}

void Authenticator::Forget(const std::string& plane) {
  const std::lock_guard lock(impl_->mutex);
  impl_->planes.erase(plane);
}

void Authenticator::SetSealed(const std::string& plane, std::shared_ptr<LatestSeals> seals) {
  const std::lock_guard lock(impl_->mutex);
  impl_->planes[plane].seals = std::move(seals);
}

void Authenticator::SetPatience(const std::string& plane, Duration patience) {
  const std::lock_guard lock(impl_->mutex);
  impl_->planes[plane].patience = patience;
}

}  // namespace slabstream
