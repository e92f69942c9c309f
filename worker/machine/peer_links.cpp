#include "worker/machine/peer_links.h"

namespace slabstream {
namespace {

bool IsTcp(const std::string& endpoint) { return endpoint.starts_with("tcp://"); }

}  // namespace

bool PeerLinks::NeedsPeers() const { return config_.memory_scope != 0 || !config_.images_key.empty() || IsTcp(config_.images_endpoint); }

const Peer* PeerLinks::Find(WorkerId worker) const {
  const auto found = peers_.find(worker);
  return found == peers_.end() ? nullptr : &found->second;
}

void PeerLinks::Begin(Epoch epoch, WorkerId self, WorkerActions& actions) {
  self_ = self;
  peers_.clear();
  Admit({}, actions);
  std::erase_if(to_refuse_, [&](const PartialImage& image) { return image.epoch != epoch; });
  if (std::exchange(epoch_, epoch) == epoch) return;
  takes_frames_only_.clear();
  rates_.ForgetAll();
  actions.push_back(ForgetGroups{.finished_before = std::numeric_limits<FrameId>::max()});
}

void PeerLinks::Name(std::span<const Peer> peers, WorkerActions& actions) {
  if (!NeedsPeers()) return;
  bool news = false;
  for (const Peer& peer : peers) {
    if (Peer& known = peers_[peer.worker]; known != peer) {
      known = peer;
      news = true;
    }
  }
  if (!news) return;
  Admit({}, actions);
  for (const PartialImage& image : std::exchange(to_refuse_, {})) Refuse(image, actions);
}

// A process that is another worker by now keeps its connection.
void PeerLinks::Gone(std::span<const WorkerId> workers, WorkerActions& actions) {
  AdmitKeys admit;
  for (const WorkerId worker : workers) {
    if (const auto gone = peers_.extract(worker)) admit.ended.insert(gone.mapped().images_key);
  }
  if (!admit.ended.empty()) Admit(std::move(admit), actions);
}

void PeerLinks::Admit(AdmitKeys admit, WorkerActions& actions) const {
  if (config_.images_key.empty()) return;
  for (const auto& [worker, peer] : peers_) {
    admit.keys.insert(peer.images_key);
    admit.ended.erase(peer.images_key);
  }
  admit.keys.erase("");  // no key
  admit.ended.erase("");
  actions.push_back(std::move(admit));
}

// Links within a host are not timed: a lack of processor time would look like a slow link, and packing would worsen it.
void PeerLinks::Deliver(SendPartial& send, Time now) {
  const Peer& to = *send.to;
  const bool on_this_host = config_.memory_scope != 0 && to.memory_scope == config_.memory_scope;
  if (on_this_host && config_.lends_memory && !takes_frames_only_.contains(to.worker)) {
    send.delivery.lend = true;
  } else if (config_.compression == LinkCompression::kOn) {
    send.delivery.bytes_per_second = 0;
  } else if (config_.compression == LinkCompression::kAuto && !on_this_host && IsTcp(to.images_endpoint)) {
    send.delivery = {.timed = true, .bytes_per_second = rates_.Of(to.worker)};
    send.message.acknowledge = rates_.Ask(to.worker, now);
  }
}

void PeerLinks::On(const ImageRefused& refused, WorkerActions& actions) {
  actions.push_back(ResendImage{refused, takes_frames_only_.insert(refused.from_worker).second});
}

// Without an answer, the sender asks again.
void PeerLinks::Acknowledge(const PartialImage& image, std::size_t payload_bytes, WorkerActions& actions) {
  if (image.acknowledge == 0 || payload_bytes < kLeastAcknowledgedBytes) return;
  if (const Peer* const to = Find(image.from_worker)) actions.push_back(AnswerPeer{*to, ImageReceived{epoch_, self_, image.acknowledge}});
}

void PeerLinks::Refuse(const PartialImage& image, WorkerActions& actions) {
  if (const Peer* const to = Find(image.from_worker)) {
    actions.push_back(AnswerPeer{*to, ImageRefused{image.epoch, self_, image.key, image.step, image.pixels}});
  } else if (to_refuse_.size() < kMostRefusals) {
    to_refuse_.push_back(image);
  }
}

}  // namespace slabstream
