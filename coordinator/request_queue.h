// RequestQueue: requested frames that do not run yet. Each client has a queue of its own; clients are served in turn, one frame each, so
// that a turntable of a thousand frames delays another client's picture by one frame and not by a thousand.
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <list>
#include <memory>
#include <optional>
#include <vector>

#include "common/base/time.h"
#include "common/wire/client_messages.h"
#include "coordinator/peer_token.h"
#include "coordinator/plan_request.h"

namespace slabstream {

struct OpenRequest {
  PeerToken client = 0;
  SubmitFrame submit;
  Time arrived;
  bool needs_occupancy = false;                 // of its policy (NeedsOccupancy)
  std::optional<ClassifiedVolume> volume;       // none: its dataset is not loaded yet
  PlanId plan = 0;                              // the requested plan; 0: none
  std::uint64_t planned_for = 0;                // LiveRoster::version() when it was
  std::shared_ptr<const PlannedFrame> planned;  // null: not yet
  int fit = 1;                                  // such frames fit the workers' memory at a time (FramesThatFit), >= 1; once planned

  Time deadline() const { return arrived + std::chrono::milliseconds(submit.deadline_ms); }
  bool Is(PeerToken of_client, RequestId id) const { return client == of_client && submit.request == id; }
};

class RequestQueue {
 public:
  using Predicate = std::function<bool(const OpenRequest&)>;

  void Push(OpenRequest request);
  // The first request that is `ready` of the first client in turn that has one; null: none is.
  const OpenRequest* FindNext(const Predicate& ready) const;
  // Takes out what FindNext has found; its client then goes to the end of the turn.
  OpenRequest Take(const OpenRequest& next);
  std::vector<OpenRequest> Extract(const Predicate& wanted);  // takes all of them out, wherever they stand

  void ForEach(const std::function<void(OpenRequest&)>& visit);  // in turn of clients, then in order of arrival
  // In the order in which they are served if all are ready, until `visit` returns false.
  void VisitInTurn(const std::function<bool(OpenRequest&)>& visit);
  bool Contains(PeerToken client, RequestId request) const;
  std::size_t size() const;
  std::size_t CountOf(PeerToken client) const;
  // Frames that are served before this one if all are ready. All of them, if it is not there.
  std::uint32_t PositionOf(PeerToken client, RequestId request);

 private:
  struct ClientQueue {
    PeerToken client = 0;
    std::deque<OpenRequest> requests;  // never empty
  };
  std::list<ClientQueue> turn_;  // the front is served next; client by client
};

}  // namespace slabstream
