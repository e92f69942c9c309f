// The client plane: coordinator (ROUTER) and clients (DEALER).
//
//   client                                  coordinator
//   SubmitFrame -------------------------->            a request id that the client chose; sent again it changes nothing
//               <--------------------------  FrameProgress          whenever something happens
//               <--------------------------  FrameReply + payload   per group if previews were asked for; the last one ends the request
//               <--------------------------  FrameFailed            ends the request
//   CancelFrame -------------------------->            ends the request; answered by FrameFailed (cancelled)
//   ClientPing  -------------------------->            every second while requests are open; silence of client_timeout frees them
//               <--------------------------  ClientPong             which of them are still known
//   StatusQuery -------------------------->  StatusReply
//   ShutDown    -------------------------->  ShutDownReply          the service and its workers end
//   KeysOrder   -------------------------->  KeysReply
//   DataOrder   -------------------------->  DataReply
//   Any of the last three may be answered by OrderRefused: over encrypted connections they need an admin's key, but for lists of datasets.
//   SummaryQuery ------------------------>  SummaryReply
//   SampleQuery ------------------------->  SampleReply
//   StatisticsQuery --------------------->  StatisticsReply
//   JointHistogramQuery ----------------->  JointHistogramReply
//   PickQuery --------------------------->  PickReply
//   ViewQuery --------------------------->  ViewReply
//   These questions wait until their dataset is loaded and its files were looked at, as frames do. Any of them may be answered by
//   OrderRefused.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "common/base/merged.h"
#include "common/base/web_traffic.h"
#include "common/frame/frame_request.h"
#include "common/keys/admitted_key.h"
#include "common/stats/probe_results.h"
#include "common/stats/report.h"
#include "common/view/ball.h"
#include "common/view/picture_geometry.h"
#include "common/volume/layers.h"
#include "common/volume/summary.h"
#include "common/wire/encoded_runs.h"
#include "common/wire/ids.h"
#include "common/wire/picture_messages.h"
#include "common/wire/volume_messages.h"

namespace slabstream {

inline constexpr std::size_t kMaxOpenRequests = 256;       // open requests of one client
inline constexpr std::int64_t kMaxRequestBytes = 1 << 20;  // limit of the coordinator's client socket; any header that a client sends fits

struct SubmitFrame {
  RequestId request = 0;
  std::uint32_t deadline_ms = 600000;  // [1, 86400000], from arrival at the coordinator
  FrameRequest frame;
  std::optional<PicturesDoor> pictures = {};  // where the pictures may come straight from workers; none: through the coordinator
  friend bool operator==(const SubmitFrame&, const SubmitFrame&) = default;
};

enum class FramePhase : std::uint8_t { kQueued = 1, kLoading = 2, kRunning = 3 };

struct FrameProgress {
  RequestId request = 0;
  FramePhase phase = FramePhase::kQueued;
  std::uint32_t queue_position = 0;  // frames before this one, while queued
  std::uint32_t groups_done = 0, group_count = 0;
  std::uint32_t attempt = 0;  // above 1: workers were lost
  std::uint32_t workers = 0;
  std::uint32_t read_percent = 0;  // kLoading: of the dataset's samples, as far as is known; [0, 100]
  std::uint64_t read_rate = 0;     // kLoading: bytes of samples a second; 0: not known
  friend bool operator==(const FrameProgress&, const FrameProgress&) = default;
};

// A level that a picture was drawn from.
struct LevelUse {
  std::uint32_t level = 0;   // [0, kMaxLevels); 0 is the finest
  std::uint32_t boxes = 0;   // boxes of the plan; those that turn out to be hidden or outside the picture are not read
  std::uint64_t voxels = 0;  // in these boxes
  friend bool operator==(const LevelUse&, const LevelUse&) = default;
};

// What the frame's plan was and what it cost; reports of all groups.
struct FrameStatistics {
  std::uint32_t workers = 0, groups = 0, attempts = 0;
  std::string renderer;                                                       // its name, never kAutomatic
  std::string decomposition, balance_by, axis, assignment, balance, combine;  // axis: "x", "y" or "z"
  std::int64_t queued_ns = 0;                                                 // arrival to plan
  std::int64_t begin_ns = 0, end_ns = 0;                                      // plan to last byte at the coordinator, MonotonicNow() clock
  std::vector<RankReport> reports;                                            // at most kMaxReports
  std::uint32_t display = 0;                                                  // worker
  PixelBounds grid;                    // pixels of the frame that was rendered and combined (FrameBounds)
  std::vector<LevelUse> levels;        // finest first; at most kMaxLevels
  std::string lowered;                 // one line: a coarser level was drawn (FrameRequest::detail 0), which one and why; else empty
  std::optional<ViewParameters> view;  // the view that the picture was made by, complete (ChooseView); final pictures have it
  friend bool operator==(const FrameStatistics&, const FrameStatistics&) = default;
};

struct FrameReply {  // payload: the runs of the shares that are not direct, one after the other
  RequestId request = 0;
  ImageSize size;                                  // the size of the whole picture
  std::uint32_t groups_done = 0, group_count = 1;  // equal: final; 0 done: a preview from a coarser level
  std::vector<PictureShare> shares;                // from 1 to kMaxShares; those that are direct may have come before this
  FrameStatistics statistics;                      // final only
  PictureGeometry geometry;
  friend bool operator==(const FrameReply&, const FrameReply&) = default;
};

struct FrameFailed {
  RequestId request = 0;
  Status status;  // not ok
  friend bool operator==(const FrameFailed&, const FrameFailed&) = default;
};

struct CancelFrame {
  RequestId request = 0;
  friend bool operator==(const CancelFrame&, const CancelFrame&) = default;
};

struct ClientPing {
  std::uint64_t nonce = 0;
  std::vector<RequestId> open;       // at most kMaxOpenRequests
  std::uint64_t received_bytes = 0;  // payloads of all replies that the client has read
  std::optional<std::uint64_t> senders =
      {};  // PictureSenders::version that its pictures plane admits, 0: nobody; none: it has no such plane
  friend bool operator==(const ClientPing&, const ClientPing&) = default;
};

struct ClientPong {
  Epoch epoch = 0;
  std::uint64_t nonce = 0;                     // echoed
  std::vector<RequestId> known;                // requests among those asked about that are queued, running, or have a reply kept
  std::optional<PictureSenders> senders = {};  // if they are others than the ping says
  friend bool operator==(const ClientPong&, const ClientPong&) = default;
};

struct StatusQuery {
  std::uint64_t nonce = 0;
  friend bool operator==(const StatusQuery&, const StatusQuery&) = default;
};

struct WorkerStatus {
  WorkerId worker = 0;
  std::uint32_t pid = 0;
  std::string host;
  std::uint32_t threads = 1;
  std::uint32_t slot = 0;  // 0 if it is leaving
  std::uint64_t cached_bytes = 0, fetched_bytes = 0;
  std::uint32_t rendered_ranks = 0;
  std::uint32_t silent_ms = 0;     // since it was last heard
  bool leaving = false;            // it gets no new work
  std::uint64_t memory_bytes = 0;  // limit of its memory; 0: none stated
  friend bool operator==(const WorkerStatus&, const WorkerStatus&) = default;
};

enum class DatasetState : std::uint8_t { kUnloaded = 1, kLoading = 2, kReady = 3, kFailed = 4 };

struct DatasetStatus {
  std::string name;
  DatasetState state = DatasetState::kUnloaded;
  VolumeDescription description;               // kReady only
  ValueRange range;                            // kReady only
  std::string error;                           // kFailed only
  std::uint64_t memory_bytes = 0;              // kReady only: what its voxels take of the coordinator's memory
  std::uint64_t since_ms = 0;                  // how long it has been in this state
  std::uint32_t labels = 0;                    // kReady only: different ones of its label volume; 0 if there is none
  bool overlay = false;                        // kReady only: there is one
  std::uint64_t cells = 0;                     // kReady only: tetrahedra of an unstructured grid; 0: it is a volume
  std::vector<VolumeDescription> levels = {};  // kReady only: of each level, finest first; at most kMaxLevels; empty: there is one
  friend bool operator==(const DatasetStatus&, const DatasetStatus&) = default;
};

// Requests that were refused before any worker had a part in them. They do not count as failed frames.
struct RefusedRequests {
  std::uint64_t bad_request = 0;      // a field, a name or a combination that is not allowed
  std::uint64_t unknown_dataset = 0;  // the catalogue has no such dataset
  std::uint64_t too_large = 0;        // more than the memory of a worker or of the coordinator
  std::uint64_t over_quota = 0;       // too many open requests of the client, or of all clients
  friend bool operator==(const RefusedRequests&, const RefusedRequests&) = default;
  RefusedRequests& operator+=(const RefusedRequests& more) {
    return *this = {bad_request + more.bad_request, unknown_dataset + more.unknown_dataset, too_large + more.too_large,
                    over_quota + more.over_quota};
  }
};

// A renderer of the service: what requests may ask of it.
struct RendererStatus {
  std::string name, title;
  std::vector<std::string> abilities, parameters;  // names
  friend bool operator==(const RendererStatus&, const RendererStatus&) = default;
};

struct StatusReply {
  Epoch epoch = 0;
  std::uint64_t nonce = 0;
  std::uint32_t pid = 0;
  std::uint64_t uptime_ms = 0;
  std::uint32_t clients = 0, queued = 0, running = 0;
  std::uint64_t frames_done = 0, frames_failed = 0, workers_lost = 0;
  std::vector<WorkerStatus> workers;
  std::vector<DatasetStatus> datasets;
  std::uint64_t memory_bytes = 0;  // limit of the coordinator's memory; 0: none stated
  RefusedRequests refused;
  std::vector<RendererStatus> renderers = {};
  std::vector<WebTraffic> web = {};  // what the coordinator and the present workers read; at most kMaxWebServers
  friend bool operator==(const StatusReply&, const StatusReply&) = default;
};

struct ShutDown {
  std::uint64_t nonce = 0;
  friend bool operator==(const ShutDown&, const ShutDown&) = default;
};

struct ShutDownReply {
  std::uint64_t nonce = 0;
  friend bool operator==(const ShutDownReply&, const ShutDownReply&) = default;
};

enum class KeysAction : std::uint8_t { kList = 1, kRotate = 2, kRevoke = 3, kIssue = 4 };

struct KeysOrder {
  std::uint64_t nonce = 0;
  KeysAction action = KeysAction::kList;
  Role role = Role::kClient;  // kRotate: whose file gets a new key; kIssue: what its holder may do; does not travel with other actions
  std::string key = {};       // kRevoke: a public one, its id or its name; kIssue: a public one
  std::string name = {};      // kIssue: of the holder; as KeyFolder::Issue takes it
  friend bool operator==(const KeysOrder&, const KeysOrder&) = default;
};

struct KeysReply {
  std::uint64_t nonce = 0;
  std::vector<AdmittedKey> keys;  // after the order
  friend bool operator==(const KeysReply&, const KeysReply&) = default;
};

struct OrderRefused {
  std::uint64_t nonce = 0;
  Status status = Status::Internal("");  // never ok
  friend bool operator==(const OrderRefused&, const OrderRefused&) = default;
};

enum class DataAction : std::uint8_t { kList = 1, kAdd = 2, kRemove = 3, kReload = 4 };

inline constexpr std::size_t kMaxDataItems = 128;       // items of one order
inline constexpr std::size_t kMaxDataItemBytes = 5120;  // a name, a path and what may stand between and behind them

struct DataOrder {
  std::uint64_t nonce = 0;
  DataAction action = DataAction::kList;
  // kAdd: as --data takes them, with absolute paths of the coordinator's host. kRemove: names of datasets, or watched folders. kReload:
  // names of datasets. kList: none.
  std::vector<std::string> items;  // at most kMaxDataItems, each of 1 ... kMaxDataItemBytes
  friend bool operator==(const DataOrder&, const DataOrder&) = default;
};

struct DataReply {
  std::uint64_t nonce = 0;
  std::vector<DatasetStatus> datasets;  // after the order
  friend bool operator==(const DataReply&, const DataReply&) = default;
};

// ---- questions about what a dataset holds

inline constexpr std::size_t kMaxOpenQuestions = 64;  // open questions of one client
inline constexpr std::size_t kMaxSamplePoints = 4096;
inline constexpr std::size_t kMaxPercentiles = 64;

struct SummaryQuery {
  std::uint64_t nonce = 0;
  std::string dataset;      // 1 ... kMaxNameBytes
  TransferChoice transfer;  // the function that is resolved for the dataset
  friend bool operator==(const SummaryQuery&, const SummaryQuery&) = default;
};

struct Percentile {
  double percent = 0;  // [0, 100]
  double value = 0;    // the value that so many of the finite voxels do not exceed
  friend bool operator==(const Percentile&, const Percentile&) = default;
};

struct SummaryReply {
  std::uint64_t nonce = 0;
  VolumeDescription description;
  ValueRange range;                                                                   // VolumeSummary::range
  std::vector<std::uint64_t> histogram = std::vector<std::uint64_t>(kHistogramBins);  // VolumeSummary::histogram
  std::uint64_t non_finite = 0;                                                       // voxels
  std::vector<Percentile> percentiles;                                                // at most kMaxPercentiles
  TransferFunction transfer;                                                          // the query's function, for this dataset
  std::vector<Label> labels;                                                          // LabelTable's labels; at most kMaxLabels
  friend bool operator==(const SummaryReply&, const SummaryReply&) = default;
};

struct SampleQuery {
  std::uint64_t nonce = 0;
  std::string dataset;       // 1 ... kMaxNameBytes
  std::vector<Vec3> points;  // points of the world; 1 ... kMaxSamplePoints
  friend bool operator==(const SampleQuery&, const SampleQuery&) = default;
};

struct SampleReply {
  std::uint64_t nonce = 0;
  std::vector<VolumeSample> samples;  // a sample for each point
  friend bool operator==(const SampleReply&, const SampleReply&) = default;
};

// The values in a box, and those of each label there (coordinator/probe/box_statistics.h).
struct StatisticsQuery {
  std::uint64_t nonce = 0;
  std::string dataset;  // 1 ... kMaxNameBytes
  ClipBox box;
  bool labels = false;  // those of each label, too
  friend bool operator==(const StatisticsQuery&, const StatisticsQuery&) = default;
};

struct StatisticsReply {
  std::uint64_t nonce = 0;
  BoxStatistics statistics;
  VolumeDescription description = {};  // describes the voxels that were counted
  // One for each label of the dataset, if the query says so; values rise; at most kMaxLabels.
  std::vector<LabelStatistics> labels = {};
  friend bool operator==(const StatisticsReply&, const StatisticsReply&) = default;
};

// Values and slopes together (coordinator/probe/joint_histogram.h).
struct JointHistogramQuery {
  std::uint64_t nonce = 0;
  std::string dataset;  // 1 ... kMaxNameBytes
  friend bool operator==(const JointHistogramQuery&, const JointHistogramQuery&) = default;
};

struct JointHistogramReply {
  std::uint64_t nonce = 0;
  ValueRange range;  // VolumeSummary::range
  JointHistogram histogram;
  friend bool operator==(const JointHistogramReply&, const JointHistogramReply&) = default;
};

// The point that a pixel shows (coordinator/probe/pick.h).
struct PickQuery {
  std::uint64_t nonce = 0;
  FrameRequest frame;   // its policy and previews do not matter
  double x = 0, y = 0;  // pixels from the picture's upper left corner: [0, width], [0, height]; the first pixel's centre is at 0.5
  friend bool operator==(const PickQuery&, const PickQuery&) = default;
};

struct PickReply {
  std::uint64_t nonce = 0;
  std::optional<VolumeSample> sample;  // none: the pixel shows no point
  double depth = 0;                    // its depth, counted as the depths of the picture's pixels
  friend bool operator==(const PickReply&, const PickReply&) = default;
};

// The view by which a picture would be made (common/planning/framing.h).
struct ViewQuery {
  std::uint64_t nonce = 0;
  FrameRequest frame;               // its policy and previews do not matter
  std::optional<Ball> framed = {};  // if its view fits: this is framed instead of what shows
  friend bool operator==(const ViewQuery&, const ViewQuery&) = default;
};

struct ViewReply {
  std::uint64_t nonce = 0;
  ViewParameters view;              // complete, without `fit`
  std::optional<Ball> framed = {};  // what the picture frames, if its view fits and anything shows
  friend bool operator==(const ViewReply&, const ViewReply&) = default;
};

using ClientToFrames = std::variant<SubmitFrame, CancelFrame, ClientPing, StatusQuery, ShutDown>;  // and about the service
using ClientToDatasets = std::variant<DataOrder, SummaryQuery, SampleQuery, StatisticsQuery, JointHistogramQuery, PickQuery, ViewQuery,
                                      AddVolume, VolumePart, DropVolume>;
using ClientToCoordinator = Merged<ClientToFrames, ClientToDatasets, std::variant<KeysOrder>>;
using CoordinatorToClient =
    std::variant<FrameProgress, FrameReply, FrameFailed, ClientPong, StatusReply, ShutDownReply, KeysReply, DataReply, OrderRefused,
                 SummaryReply, SampleReply, StatisticsReply, JointHistogramReply, PickReply, ViewReply, VolumeCredit>;

using Question = std::variant<SummaryQuery, SampleQuery, StatisticsQuery, JointHistogramQuery, PickQuery, ViewQuery>;
using QuestionReply = std::variant<SummaryReply, SampleReply, StatisticsReply, JointHistogramReply, PickReply, ViewReply>;
template <class Query>
const std::string& DatasetOf(const Query& query) {
  if constexpr (requires { query.dataset; }) {
    return query.dataset;
  } else {
    return query.frame.dataset;
  }
}
inline const std::string& DatasetOf(const Question& question) {
  return std::visit([](const auto& query) -> const std::string& { return DatasetOf(query); }, question);
}
inline std::uint64_t NonceOf(const Question& question) {
  return std::visit([](const auto& query) { return query.nonce; }, question);
}

}  // namespace slabstream
