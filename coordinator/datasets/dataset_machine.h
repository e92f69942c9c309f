// DatasetMachine: everything that the coordinator decides about datasets, as a pure state machine (machines.h). Loading, looking and
// answering are actions that the executor answers with events.
//
//   datasets   A dataset is loaded when it is first used. Requests wait for it; a failed load fails them. Datasets that no request needs
//              are unloaded, the least recently used one first, if they take more than their share of memory_bytes, or if another one
//              cannot be loaded for want of memory. What a server sends is given up kUnwanted after the last one who waited for it left:
//              another request may come at once, and servers may never answer.
//   levels     A dataset with several levels is only opened. A request seeks the levels that it draws (LevelsOf), and these are loaded.
//   files      A frame of a dataset begins only after a check of its files that began after the request came. If they have changed, they
//              are read anew, and what has not begun waits. Frames that have begun end with the voxels that they began with, which stay
//              until then. Watched folders are looked through every check_interval, and when somebody asks for a name that is not known;
//              files that come and go there are datasets that come and go. DataOrders add and remove datasets, too. A check never holds
//              the machine up: the executor answers it with an event, as it does for loads.
//   questions  What a dataset holds is asked of the executor once the dataset is loaded and its files were looked at, as for frames. A
//              question ends with its answer, with OrderRefused, or with its client.
//   uploads    A client may send a dataset (AddVolume): it is admitted if its name is free and the memory suffices, its bytes come in order
//              within a credit, and the executor stores them. It is a dataset once they are all there. If the client falls silent, gives
//              it up or sends anything else than the next bytes, nothing stays.
//   owned      Other processes hold the voxels of a dataset, one time after the other (OwnedData). A new time is like a change of the
//              dataset's files. Once nobody waits for an older time, it is unloaded, so that its owners may overwrite it.
//
// What the executor must do: call Step(DatasetTick) no later than NextWake(); carry out the actions in order; answer LoadDataset,
// CheckDatasetFiles, CheckWatchedFolders, FindDatasets, AnswerQuestion, BeginUpload and FinishUpload with one event each, in any order.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <stop_token>
#include <string>
#include <variant>
#include <vector>

#include "common/base/read_share.h"
#include "common/base/time.h"
#include "common/memory/bytes.h"
#include "common/wire/limits.h"
#include "coordinator/datasets/datasets.h"
#include "coordinator/machines.h"
#include "data/catalogue/data_source.h"

namespace slabstream {

using OrderId = std::uint64_t;     // an order about datasets that waits; a number is never given twice
using QuestionId = std::uint64_t;  // a question that waits; a number is never given twice
using UploadId = std::uint64_t;    // a dataset that a client sends; a number is never given twice

inline constexpr Duration kUnwanted = std::chrono::seconds(5);

struct DatasetConfig {
  Catalogue datasets;
  std::set<std::string> folders;                      // folders that are watched, as WatchedFolder says them
  std::uint64_t memory_bytes = 0;                     // limit of the coordinator's memory; 0: none
  std::size_t max_questions = 1024;                   // questions of all clients together
  Duration check_interval = std::chrono::seconds(5);  // between checks of the watched folders
  std::size_t max_datasets = kMaxListed;              // in the catalogue
  LogLevel log_level = LogLevel::kOff;                // Notes of lower levels are not made
};

// ---- events, beside ToDatasets
// Of a client that the FrameMachine has heard of (ClientHeard).
struct ClientAsked {
  PeerToken from = 0;
  ClientToDatasets message;
  Bytes payload = {};
};
// A request, question, order or part of an upload that could not be decoded, with the answer for its client (RefusalOf).
struct BadRequest {
  PeerToken from = 0;
  CoordinatorToClient answer;
  Status why;
};
struct DatasetLoaded {
  std::string name;
  LoadId load = 0;
  DatasetId dataset = 0;  // not 0
  std::shared_ptr<const VolumeSummary> summary;
  std::uint64_t bytes = 0;                           // memory of its voxels beside what the source holds
  std::shared_ptr<const FileStamp> stamp = nullptr;  // the state of its files when they were read; null: they never change
  std::shared_ptr<const DatasetFields> fields = {};  // null: of a part, or there is one, of which nothing is known
  std::shared_ptr<VolumeSource> opened = {};         // LoadedSource::source; null: of a level
};
// The dataset has several levels. None of them was loaded yet.
struct DatasetOpened {
  std::string name;
  LoadId load = 0;
  std::shared_ptr<const VolumeLevels> levels;  // never null
  std::vector<DataSource> sources;             // the source of each level
  std::shared_ptr<const FileStamp> stamp;      // as DatasetLoaded::stamp
  std::shared_ptr<const DatasetFields> fields = {};
  std::shared_ptr<VolumeSource> opened = {};
};
struct DatasetReading {  // not the end yet
  std::string name;
  LoadId load = 0;
  ReadShare read;
};
struct DatasetFailed {
  std::string name;
  LoadId load = 0;
  Status status;
};
// The end of a CheckDatasetFiles.
struct DatasetSeen {
  std::string name;
  LoadId load = 0;
  Result<bool> changed;
};
// The end of a CheckWatchedFolders.
struct FoldersSeen {
  std::map<std::string, Result<FoundData>> folders;
  std::set<std::string> unchanged = {};  // since the last one
};
// The end of a FindDatasets.
struct DatasetsFound {
  OrderId order = 0;
  Result<FoundData> found;
};
// The end of an AnswerQuestion.
struct QuestionAnswered {
  QuestionId question = 0;
  Result<QuestionReply> answer;
};
// The end of a BeginUpload: whether there is room.
struct UploadBegun {
  UploadId upload = 0;
  Status status;
};
// The end of a FinishUpload.
struct UploadFinished {
  UploadId upload = 0;
  Result<DataSource> source;
};
// Processes hold the voxels of a dataset, and something has changed: it has come, they have all left, or (neither) it has another time, or
// an owner was lost or is there again.
struct OwnedData {
  std::string name;
  std::optional<DataSource> came = {};
  bool left = false;
};
struct DatasetTick {};
using DatasetEvent =
    std::variant<ToDatasets, ClientAsked, BadRequest, DatasetLoaded, DatasetOpened, DatasetReading, DatasetFailed, DatasetSeen, FoldersSeen,
                 DatasetsFound, QuestionAnswered, UploadBegun, UploadFinished, OwnedData, DatasetTick>;

// ---- actions
// -> DatasetLoaded, DatasetOpened or DatasetFailed
struct LoadDataset {
  std::string name;
  LoadId load = 0;
  DataSource source;
  std::uint64_t most_bytes = 0;  // the most voxels that may be held; more stay where they are, if the source can be read in parts
  std::stop_token stop = {};     // told to stop once nobody waits for the end any more
};
// Its voxels are not needed any more.
struct UnloadDataset {
  DatasetId dataset = 0;
};
// -> DatasetSeen: whether the files of a loaded dataset have changed.
struct CheckDatasetFiles {
  std::string name;
  LoadId load = 0;
  std::shared_ptr<const FileStamp> stamp;
};
// -> FoldersSeen: what is in each of these folders. If nobody has asked for the check (it is only time for another one), folders that have
// not changed are not searched (FolderMemory). One at a time.
struct CheckWatchedFolders {
  std::set<std::string> folders;
  bool asked_for = false;
};
// -> DatasetsFound: what these arguments of an order mean, and whether it can be read.
struct FindDatasets {
  OrderId order = 0;
  std::vector<std::string> arguments;
};
// -> QuestionAnswered. The voxels may be unloaded as soon as the action is performed: the executor holds them until it has answered.
struct AnswerQuestion {
  QuestionId id = 0;
  Question question;
  // 0: a SummaryQuery or ViewQuery about a dataset with several levels, which needs no voxels
  DatasetId dataset = 0;
  std::shared_ptr<const VolumeSummary> summary;
  // the levels, for a ViewQuery about such a dataset; its summary is the overview's
  std::shared_ptr<const VolumeLevels> levels = nullptr;
  ShownFields fields = {};  // the fields that it is about; `others` with one level each
  // A SummaryQuery about the time that it names, and not about all: range and histogram are those of the voxels, which `summary` is not of.
  bool at_time = false;
  CoarserVolume labels = {};  // `summary` is null: there are none, or it does not need them; `dataset` is 0 of a SummaryQuery
  std::stop_token stop = {};  // told to stop once nobody waits for the answer any more
};
// -> UploadBegun: room for the bytes of `order`.
struct BeginUpload {
  UploadId upload = 0;
  AddVolume order;
};
// The next bytes, of an upload that was begun.
struct StoreUpload {
  UploadId upload = 0;
  std::uint64_t begin = 0;
  Bytes bytes;
};
// -> UploadFinished: all bytes are there.
struct FinishUpload {
  UploadId upload = 0;
};
struct DropUpload {
  UploadId upload = 0;
};
using DatasetAction = std::variant<DatasetNews, ToClient, LoadDataset, UnloadDataset, CheckDatasetFiles, CheckWatchedFolders, FindDatasets,
                                   AnswerQuestion, BeginUpload, StoreUpload, FinishUpload, DropUpload, Note>;

// Entries in the machine's tables. At rest, with nothing asked for and every client gone, they are 0.
struct DatasetSizes {
  std::size_t uses = 0;
  std::size_t orders = 0, awaited = 0;  // orders that wait for a file check; names that do
  std::size_t retired = 0;              // voxels that only frames under way use
  std::size_t questions = 0, uploads = 0;
};

// What there is, and what has been counted since the start.
struct DatasetCounts {
  std::size_t unloaded = 0, loading = 0, ready = 0, failed = 0;  // in the catalogue
  std::uint64_t voxel_bytes = 0;                                 // in the coordinator's memory
  RefusedRequests refused;                                       // questions and uploads, and what could not be decoded
};

class DatasetMachine {
 public:
  explicit DatasetMachine(DatasetConfig config);
  ~DatasetMachine();
  DatasetMachine(DatasetMachine&&) noexcept;

  std::vector<DatasetAction> Step(const DatasetEvent& event, Time now);
  Time NextWake() const;  // Time::max(): nothing happens by itself
  DatasetSizes sizes() const;
  DatasetCounts counts() const;
  Status NameIsFree(const std::string& name) const;  // InvalidArgument: a dataset of the catalogue has it

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace slabstream
