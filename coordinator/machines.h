// A coordinator decides by two pure state machines, (event, now) -> actions: FrameMachine about requests, plans, frames and workers;
// DatasetMachine about datasets, uploads and questions. This header has what they share and all that they tell each other.
//
//   FrameMachine             DatasetMachine
//   SeekDataset  ---------->          a request has come: loads its dataset, or looks at its files
//                <----------  DatasetNews    at once, and whenever something changes for a request, until its frame begins
//   KeepDataset  ---------->          its frame begins: the voxels that it was told of stay, whatever becomes of the dataset
//   LeaveDataset ---------->          the request has ended
//   ForgetClient ---------->          the client has gone: its questions, orders and uploads end
//   FinishStatus ---------->          a StatusReply to send, once datasets are in it
//   FinishPong   ---------->          a ClientPong to send, once it says which questions, orders and uploads are lost
//   EndDatasets  ---------->          the coordinator ends: so do questions
//
// The executor steps the other machine with a ToDatasets or a DatasetNews before it carries out the actions behind it.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "common/base/log.h"
#include "common/base/read_share.h"
#include "common/base/status.h"
#include "common/memory/bytes.h"
#include "common/planning/levels.h"
#include "common/planning/resolved_request.h"
#include "common/wire/client_messages.h"
#include "coordinator/peer_token.h"

namespace slabstream {

// ---- actions of both
struct ToClient {
  PeerToken to = 0;
  CoordinatorToClient message;
  Bytes payload = {};
};
// A line for the log.
enum class NoteAbout : std::uint8_t { kWorkers, kDatasets, kFrames };
struct Note {
  NoteAbout about = NoteAbout::kWorkers;
  LogLevel level = LogLevel::kInfo;
  std::string text;
};

// ---- from FrameMachine to DatasetMachine
using UseId = std::uint64_t;  // a request's dataset; from 1, never given twice
struct SeekDataset {
  UseId use = 0;
  std::shared_ptr<const FrameRequest> request;  // never null
  std::int64_t most_level_bytes = 0;            // 0: it draws the levels that it asks for; else no larger ones (NoneLarger)
};
struct KeepDataset {
  UseId use = 0;
  std::vector<DatasetId> datasets;  // not empty
};
struct LeaveDataset {
  UseId use = 0;
};
struct ForgetClient {
  PeerToken client = 0;
};
struct FinishStatus {
  PeerToken client = 0;
  StatusReply reply;
};
struct FinishPong {
  PeerToken client = 0;
  ClientPong pong;  // `lost` has all that were asked about
};
struct EndDatasets {
  std::string reason;
};
using ToDatasets = std::variant<SeekDataset, KeepDataset, LeaveDataset, ForgetClient, FinishStatus, FinishPong, EndDatasets>;

// ---- from DatasetMachine to FrameMachine
struct DatasetAwaited {
  bool loading = false;  // else it is not known yet whether there is such a dataset
  ReadShare read;        // how much of its samples has been read, as far as is known
};
struct DatasetReady {
  DatasetId dataset = 0;
  std::shared_ptr<const VolumeSummary> summary;
  // The levels of a dataset that has several; null: it has one. The voxels are those of the finest one that is drawn
  // (AtLevel).
  std::shared_ptr<const VolumeLevels> levels = nullptr;
  std::optional<ViewParameters> view = {};  // with several levels: the view that they were chosen for (ChooseView)
  std::vector<int> drawn = {0};             // numbers of levels, finest first
  // If there are several of these: which parts, and those beside the finest one (ResolvedRequest).
  std::shared_ptr<const LevelMap> map = {};
  std::vector<CoarserVolume> coarser = {};
  std::optional<CoarserVolume> light = {};  // with several levels: the light volume, if the request needs it (ResolvedRequest)
  ShownFields fields = {};
  bool seen = true;  // its files are as they were read, by a look that began after the request came; a frame may begin
};
using RefusedAs = std::uint64_t RefusedRequests::*;  // what a refusal counts as
struct DatasetLost {                                 // the use has ended
  Status why;
  RefusedAs refused = nullptr;  // null: it is a failure
};
struct DatasetNews {
  std::map<UseId, std::variant<DatasetAwaited, DatasetReady, DatasetLost>> uses;  // as they are now
  std::vector<DatasetId> unloaded;                                                // voxels that are not there any more
};

// Fits the wire's limit for texts, whatever a worker or a file name contributed.
inline Status Bounded(const Status& status) {
  return status.message().size() <= kMaxTextBytes ? status : Status(status.code(), status.message().substr(0, kMaxTextBytes));
}

}  // namespace slabstream
