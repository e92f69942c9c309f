// DatasetMachine::State: what the machine knows, and its handlers. Not for executors: only the sources dataset_machine*.cpp include it.
// Handlers append to `actions` and `news`.
//   dataset_machine.cpp            requests, voxels, checks of their files, and the Step itself
//   dataset_machine_catalogue.cpp  the catalogue: watched folders and orders
//   dataset_machine_questions.cpp  questions about what datasets hold
//   dataset_machine_shapes.cpp     shapes and planes of pictures
//   dataset_machine_uploads.cpp    datasets that clients send
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <concepts>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "coordinator/datasets/dataset_machine.h"
#include "data/catalogue/dataset_fields.h"

namespace slabstream {

struct DatasetMachine::State {
  explicit State(DatasetConfig c) : config(std::move(c)), datasets(config.datasets, config.folders) {}

  // A dataset that a request needs.
  struct Use {
    std::shared_ptr<const FrameRequest> request;
    std::int64_t most_level_bytes = 0;  // SeekDataset::most_level_bytes
    // The entries of the table that it waits for: the dataset, and its fields at its own time if another one shows; then the sources of
    // the fields that it shows, the volume's first; then the levels that it draws of each, finest first, or the source if it has one level;
    // and at last, if the picture has shadows or ambient occlusion, what the light volume of each is made from.
    struct Entry {
      std::string name;
      CheckId check = 0;  // at its files, which must be over before a frame begins; 0: none
    };
    enum class Stage { kDataset, kSources, kVoxels };
    Stage stage = Stage::kDataset;
    std::vector<Entry> entries;
    std::vector<Entry> shapes = {};            // of the request's shapes, which it waits for, too
    std::vector<Entry> planes = {};            // of the request's planes, once the voxels are there that they go through
    ShownFields fields = {};                   // from kSources on; `others` without levels
    int time = 0;                              // from kSources on
    std::size_t volume_entries = 1;            // kVoxels: how many of the entries are the volume's
    std::shared_ptr<const LevelMap> map = {};  // kVoxels: of a volume with levels
    std::string volume = {};                   // kVoxels: the source of the volume
    std::optional<ViewParameters> view = {};   // kVoxels: of a volume with levels (DatasetReady::view)
    std::vector<DatasetId> kept = {};          // its frame has begun with these voxels; empty: it has not begun

    bool begun() const { return !kept.empty(); }
    bool WaitsForAny(auto&& is) const {
      const auto any = [&](const std::vector<Entry>& of) { return std::ranges::any_of(of, is, &Entry::name); };
      return any(entries) || any(shapes) || any(planes);
    }
    bool WaitsFor(const std::string& name) const {
      return WaitsForAny([&](const std::string& each) { return each == name; });
    }
  };
  // An order that waits for a file check. kList: for the one of the folders and those of the datasets.
  struct OpenOrder {
    PeerToken client = 0;
    DataOrder order;
    CheckId folders = 0;
    std::map<std::string, CheckId> datasets = {};
  };
  // A question that has no answer yet.
  struct OpenQuestion {
    PeerToken client = 0;
    Question question;
    std::string entry;                                       // the entry of the table that it waits for
    CheckId check = 0;                                       // the check of its files, which must be over first; 0: none
    bool asked = false;                                      // whether the executor was asked
    ShownFields fields = {};                                 // once it waits for the fields that it is about: these alone
    int time = 0;                                            // of these
    std::shared_ptr<const VolumeSummary> summary = nullptr;  // once it waits for voxels of a level, but is about all of them
    Use::Entry labels = {};                                  // without a name: it needs none
    std::vector<Use::Entry> others = {};                     // of fields.others
    std::vector<Use::Entry> shapes = {};                     // of the shapes in the picture that it is about
    std::vector<Use::Entry> planes = {};                     // of its planes, once the voxels are there
    std::shared_ptr<Wanted> answer = std::make_shared<Wanted>();

    // All of them.
    std::vector<Use::Entry> entries() const {
      std::vector<Use::Entry> all = {{entry, check}};
      if (!labels.name.empty()) all.push_back(labels);
      all.insert(all.end(), others.begin(), others.end());
      all.insert(all.end(), shapes.begin(), shapes.end());
      all.insert(all.end(), planes.begin(), planes.end());
      return all;
    }
    bool WaitsFor(const std::string& name) const { return std::ranges::count(entries(), name, &Use::Entry::name) > 0; }
  };
  // The picture that a question is about; null: it is about the dataset.
  template <class Asked>
  static auto FrameOf(Asked& question) -> decltype(&std::get<PickQuery>(question).frame) {
    if (auto* pick = std::get_if<PickQuery>(&question)) return &pick->frame;
    if (auto* view = std::get_if<ViewQuery>(&question)) return &view->frame;
    return nullptr;
  }
  // A dataset on its way from a client.
  struct OpenUpload {
    PeerToken client = 0;
    AddVolume order;
    std::uint64_t received = 0, allowed = 0;  // bytes
  };

  const DatasetConfig config;
  DatasetTable datasets;
  std::map<UseId, Use> uses;
  std::set<std::string> wait_for_room;  // entries that are loaded once a frame has ended
  bool parts_came = false;              // fields at other times, in this Step
  std::map<OrderId, OpenOrder> orders;  // at most one of each client
  OrderId last_order = 0;
  std::map<QuestionId, OpenQuestion> questions;  // in order of arrival
  QuestionId last_question = 0;
  std::map<UploadId, OpenUpload> uploads;   // at most one of each client
  std::map<std::string, OpenUpload> files;  // by dataset: those that have come and last as long as their clients
  UploadId last_upload = 0;
  CheckCounter folder_checks;
  Time next_round;                                          // when the folders are looked through, if there are any
  Time next_give_up = Time::max();                          // when a load may be given up
  Time times_seen;                                          // when somebody was last told how many times datasets have
  std::map<std::string, std::set<std::string>> complaints;  // about what lies in each folder
  bool folders_asked_for = false;                           // by a client, since the last check began
  std::map<std::string, std::string> hidden;  // names that were removed though their files are still there, and the folder of each
  RefusedRequests refused;                    // questions and uploads, and what could not be decoded

  Time now;  // the time of this Step
  bool started = false, stopped = false;
  std::vector<DatasetAction> actions;  // the actions of this Step
  DatasetNews news;                    // the news of this Step

  // ---- events
  void On(const ToDatasets& event) {
    std::visit([this](const auto& e) { On(e); }, event);
  }
  void On(const SeekDataset& event);
  void On(const KeepDataset& event);
  void On(const LeaveDataset& event);
  void On(const ForgetClient& event);
  void On(const FinishStatus& event);
  void On(const FinishPong& event);
  void On(const EndDatasets& event);
  void On(const ClientAsked& event);
  void On(const BadRequest& event);
  void On(const DatasetLoaded& event);
  void On(const DatasetOpened& event);
  void On(const DatasetReading& event);
  void On(const DatasetFailed& event);
  void On(const DatasetSeen& event);
  void On(const FoldersSeen& event);
  void On(const DatasetsFound& event);
  void On(const QuestionAnswered& event);
  void On(const UploadBegun& event);
  void On(const UploadFinished& event);
  void On(const OwnedData& event);
  void On(const DatasetTick&) {}

  // ---- messages of clients
  void OnMessage(PeerToken client, const DataOrder& message, const Bytes&);
  template <std::convertible_to<Question> Query>
  void OnMessage(PeerToken client, const Query& message, const Bytes&) {
    Ask(client, message);
  }
  void OnMessage(PeerToken client, const AddVolume& message, const Bytes&);
  void OnMessage(PeerToken client, const VolumePart& message, const Bytes& payload);
  void OnMessage(PeerToken client, const DropVolume& message, const Bytes&);

  // ---- requests
  // NotFound: this dataset is neither known nor may be found in a folder, or a shape of the picture is not. `frame`: null: it shows none.
  Status CheckKnown(const std::string& name, const FrameRequest* frame) const;
  CheckId Seek(const std::string& name);
  static std::vector<Use::Entry> NamedShapes(const FrameRequest& request);  // as they are before their times are sought
  std::vector<Use::Entry> SeekShapes(const FrameRequest& request);
  Result<bool> SeekAtTime(const FrameRequest& request, int time, std::vector<Use::Entry>& shapes);
  std::vector<Use::Entry> SeekPlanes(const FrameRequest& request, const VolumeGeometry& finest, const std::string& through);
  static Use Anew(const Use& use, const Use::Entry& entry);
  Status Advance(Use& use);
  Status SeekSources(Use& use);
  Status SeekVoxels(Use& use);
  void AdvanceUses(const std::string& name);
  struct FieldSource {
    std::string entry;
    bool ready = true;
  };
  std::string OwnSourceOf(const std::string& dataset, int field);
  Result<FieldSource> SourceOf(const std::string& dataset, int field, int time);
  void TellUse(const std::pair<const UseId, Use>& use);
  void TellUses(const std::string& name);
  void Lose(const std::string& name, const Status& why, RefusedAs as = nullptr);
  bool IsWanted(const std::string& name) const;  // by a request whose frame has not begun, or a question that was not asked
  bool IsKept(DatasetId dataset) const;          // by a frame that has begun
  bool IsAwaited(DatasetId dataset) const;       // as the next one
  // Whether a request whose frame has not begun, or a question that was not asked, waits for an entry that `is` so.
  template <std::predicate<const std::string&> Is>
  bool IsAwaited(Is&& is) const {
    const auto any = [&](const std::vector<Use::Entry>& entries) {
      return std::ranges::any_of(entries, [&](const Use::Entry& entry) { return is(entry.name); });
    };
    return std::ranges::any_of(uses, [&](const auto& use) { return !use.second.begun() && use.second.WaitsForAny(is); }) ||
           std::ranges::any_of(questions, [&](const auto& open) { return !open.second.asked && any(open.second.entries()); });
  }
  bool InUse(DatasetId dataset) const { return IsKept(dataset) || IsAwaited(dataset); }
  void ClosePartsThatNobodyWants();
  void GiveUpLoads();

  // ---- voxels
  void LoadData(const std::string& name);
  void FailData(const std::string& name, const Status& status);
  void SeekWithout(const std::string& name, std::map<UseId, Use> without);
  void RenewData(const std::string& name);
  bool UnloadOne();  // false: all are in use
  std::uint64_t BytesThatFramesGiveBack() const;
  void WaitForRoom(const std::string& name);
  void UnloadRetired();
  void Unload(DatasetId dataset);
  Status TooLarge(const std::string& name, std::uint64_t bytes, std::uint64_t others) const;

  // ---- checks
  void CheckFilesOf(const std::string& name);
  void CheckFolders();
  void CheckEverything();

  // ---- the catalogue
  Status NameIsFree(const std::string& name) const;
  void AddData(const std::string& name, const DataSource& source);
  void RemoveData(const std::string& name, const std::string& why);
  void StopWatching(const std::string& folder);
  std::size_t MergeFolder(const std::string& folder, const Catalogue& found, const std::string& gone);
  Status Remove(const std::vector<std::string>& items);
  Status Reload(const std::vector<std::string>& items);
  Status AddFound(const FoundData& found);
  void AnswerOrder(PeerToken client, const DataOrder& order, const Status& status);
  void AnswerLists();

  // ---- questions
  void Ask(PeerToken client, Question question);
  Status FindField(OpenQuestion& open);
  Status DescendQuestion(OpenQuestion& open, const VolumeLevels& levels);
  void AskExecutor();
  void RefuseQuestion(const OpenQuestion& open, const Status& status);

  // ---- uploads
  Status AdmitUpload(const AddVolume& order);
  std::uint64_t UploadBytes() const;  // bytes of the uploads under way, and of the files that clients have sent
  void GrantCredit(OpenUpload& upload);
  using Upload = std::map<UploadId, OpenUpload>::iterator;
  Upload UploadOf(PeerToken client, std::optional<std::uint64_t> nonce = {});  // end: it has none, or another one
  void EndUpload(Upload upload, const Status& why);                            // without a dataset
  void RemoveFilesOf(PeerToken client);

  Time NextWake() const;

  // ---- actions
  template <class... Values>
  void Tell(NoteAbout about, LogLevel level, fmt::format_string<Values...> format, Values&&... values) {
    if (level < config.log_level) return;
    actions.emplace_back(Note{about, level, fmt::format(format, std::forward<Values>(values)...)});
  }
  void Send(PeerToken client, CoordinatorToClient message) { actions.emplace_back(ToClient{client, std::move(message)}); }
};

}  // namespace slabstream
