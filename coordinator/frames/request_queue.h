// RequestQueue: requested frames that do not run yet, a queue for each client. Clients share the service's time equally (FairTurns): the
// next frame is of the client that has used least of it. So neither a turntable of a thousand frames nor one huge picture after another
// delays other clients for long.
//
// What a frame costs is known only when it ends (Settle). Until then it counts as much as the client's frame before it.
#pragma once

#include <algorithm>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <variant>
#include <vector>

#include "common/base/time.h"
#include "common/threads/fair_turns.h"
#include "common/wire/client_messages.h"
#include "coordinator/frames/deadline_forecast.h"
#include "coordinator/machines.h"
#include "coordinator/peer_token.h"
#include "coordinator/plan_request.h"

namespace slabstream {

// Plans for the workers of a LiveRoster::version().
struct PlanAsked {
  PlanId plan = 0;
  std::uint64_t version = 0;
};
struct PlanMade {
  std::shared_ptr<const PlannedFrame> frame;  // a plan that fits
  std::uint64_t version = 0;
};

struct OpenRequest {
  PeerToken client = 0;
  SubmitFrame submit;
  std::optional<PicturesAddress> pictures = {};  // where its client takes them
  Time arrived;
  UseId use = 0;             // the use of its dataset
  std::string lowered = {};  // FrameStatistics::lowered
  bool coarse = false;       // it makes a preview of the client's request of this number (frame_machine_previews.cpp)
  FrameKind kind = 0;        // for the forecast; not of coarse ones
  // Once it has its dataset.
  bool needs_occupancy = false;  // its policy does (NeedsOccupancy): its frame waits for the count

  struct Submitted {};  // it has sought its dataset
  struct AwaitsDataset {};
  struct HasDataset {
    std::shared_ptr<const ResolvedRequest> resolved;  // never null
    bool seen = false;                                // DatasetReady::seen: its frame may begin
    std::shared_ptr<const VolumeLevels> levels;       // DatasetReady::levels and drawn
    std::vector<int> drawn = {0};
    ViewParameters view = {};  // the picture's view, complete, in terms of the finest level (ChooseView)
    std::variant<std::monostate, PlanAsked, PlanMade> plan = {};
    const ClassifiedVolume& volume() const { return resolved->volume; }
    // The voxels that its frame is drawn from: the volume first.
    std::vector<DatasetId> datasets() const {
      std::vector<DatasetId> all = {volume().dataset()};
      for (const CoarserVolume& level : resolved->coarser) all.push_back(level.dataset);
      const std::vector<DatasetId> of_fields = FieldsOf(resolved->fields);
      all.insert(all.end(), of_fields.begin(), of_fields.end());
      if (resolved->light) all.push_back(resolved->light->dataset);
      return all;
    }
    static std::vector<DatasetId> FieldsOf(const ShownFields& fields) {
      std::vector<DatasetId> all;
      for (const FieldVolume& field : fields.others) {
        for (const CoarserVolume& level : field.levels) all.push_back(level.dataset);
        if (field.light) all.push_back(field.light->dataset);
      }
      for (const CoarserVolume& shape : fields.shapes) all.push_back(shape.dataset);
      for (const CoarserVolume& plane : fields.planes) all.push_back(plane.dataset);
      return all;
    }
    bool DrawsFrom(const DatasetReady& ready) const {
      return volume().dataset() == ready.dataset &&
             std::ranges::equal(resolved->coarser, ready.coarser, {}, &CoarserVolume::dataset, &CoarserVolume::dataset) &&
             std::ranges::equal(FieldsOf(resolved->fields), FieldsOf(ready.fields)) &&
             (resolved->light ? resolved->light->dataset : 0) == (ready.light ? ready.light->dataset : 0);
    }
  };
  std::variant<Submitted, AwaitsDataset, HasDataset> state = {};

  Duration used{};     // by its client before it; once taken
  Duration charged{};  // for it, until it is settled; once taken

  Time deadline() const { return arrived + std::chrono::milliseconds(submit.deadline_ms); }
  bool Is(PeerToken of_client, RequestId id) const { return client == of_client && submit.request == id && !coarse; }
  HasDataset* dataset() { return std::get_if<HasDataset>(&state); }  // null: not yet
  const HasDataset* dataset() const { return std::get_if<HasDataset>(&state); }
  template <class Plan>
  const Plan* plan() const {  // PlanAsked or PlanMade; null: not at this stage
    return dataset() == nullptr ? nullptr : std::get_if<Plan>(&dataset()->plan);
  }
};

class RequestQueue {
 public:
  using Predicate = std::function<bool(const OpenRequest&)>;

  void Push(OpenRequest request);
  // The first request that is `ready` of the first client in turn that has one; null: none is.
  const OpenRequest* FindNext(const Predicate& ready) const;
  OpenRequest Take(const OpenRequest& next);  // takes out what FindNext has found
  // The frame of a request that was taken has ended. `cost`: the time that workers spent on it.
  void Settle(const OpenRequest& taken, Duration cost);
  std::vector<OpenRequest> Extract(const Predicate& wanted);  // takes all of them out, wherever they stand
  std::deque<OpenRequest> Forget(PeerToken client);           // takes its requests out, and what it has used

  void ForEach(const std::function<void(OpenRequest&)>& visit);  // client by client, then in order of arrival
  // In the order in which they are served if all are ready and cost what is expected of them, until `visit` returns false.
  void VisitInTurn(const std::function<bool(OpenRequest&)>& visit);
  // The first request of each client, in turn, until `visit` returns false.
  void VisitFirsts(const std::function<bool(OpenRequest&)>& visit);
  // Null: it is not there.
  const OpenRequest* Find(PeerToken client, RequestId request) const;
  const OpenRequest* FindCoarse(PeerToken client, RequestId request) const;  // the request that makes a preview of it
  std::size_t size() const;
  Duration UsedBy(PeerToken client) const { return turns_.TurnOf(client).used; }
  std::size_t clients() const;                  // clients that have requests in it
  std::size_t CountOf(PeerToken client) const;  // requests of this client
  // Frames that VisitInTurn visits before this one. All of them, if it is not there.
  std::uint32_t PositionOf(PeerToken client, RequestId request);

 private:
  const OpenRequest* FindIf(PeerToken client, const Predicate& wanted) const;

  struct ClientQueue {
    std::deque<OpenRequest> requests;
    Duration expected{};  // cost of its next frame
  };

  std::map<PeerToken, ClientQueue> clients_;
  FairTurns<PeerToken> turns_;
};

}  // namespace slabstream
