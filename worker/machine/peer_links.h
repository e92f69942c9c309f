// PeerLinks: what a worker knows of the others, and how its images and answers reach them. Part of the worker machine.
//
//   - The coordinator names workers in its assignments. The images plane admits their keys until the coordinator says that they have gone,
//     or until this worker registers anew, since it may not have heard of all who went meanwhile.
//   - Workers of this host read images in place, until they refuse one. Links to other hosts are timed, so that images are packed for slow
//     ones.
//   - An image that cannot be read in place here is refused, as soon as its sender has been named.
#pragma once

#include <map>
#include <set>
#include <span>
#include <vector>

#include "worker/machine/link_rates.h"
#include "worker/machine/worker_machine.h"

namespace slabstream {

class PeerLinks {
 public:
  static constexpr std::size_t kMostRefusals = 4096;  // refusals that wait for their receivers to be named

  explicit PeerLinks(const WorkerConfig& config) : config_(config) {}

  const Peer* Find(WorkerId worker) const;  // null: not named, or gone

  // The coordinator of `epoch` has registered this worker as `self`.
  void Begin(Epoch epoch, WorkerId self, WorkerActions& actions);
  void Name(std::span<const Peer> peers, WorkerActions& actions);
  void Gone(std::span<const WorkerId> workers, WorkerActions& actions);

  void Deliver(SendPartial& send, Time now);  // fills in `delivery` and message.acknowledge
  void On(const PartialSent& sent, Time now) { rates_.Sent(sent.to, sent.acknowledge, sent.bytes, now); }
  void On(const ImageReceived& received, Time now) { rates_.Received(received.from_worker, received.number, now); }
  void On(const ImageRefused& refused, WorkerActions& actions);

  void Acknowledge(const PartialImage& image, std::size_t payload_bytes, WorkerActions& actions);
  void Refuse(const PartialImage& image, WorkerActions& actions);

 private:
  // False: nobody will lend to this worker, time the link to it, or need its leave to connect.
  bool NeedsPeers() const;
  void Admit(AdmitKeys admit, WorkerActions& actions) const;  // fills in `keys`

  const WorkerConfig& config_;
  Epoch epoch_ = 0;
  WorkerId self_ = 0;
  std::map<WorkerId, Peer> peers_;
  std::set<WorkerId> takes_frames_only_;  // workers that cannot map memory though they have the same scope
  std::vector<PartialImage> to_refuse_;
  LinkRates rates_;
};

}  // namespace slabstream
