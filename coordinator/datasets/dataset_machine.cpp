#include "coordinator/datasets/dataset_machine.h"

#include <algorithm>
#include <chrono>
#include <memory>
#include <utility>

#include "common/volume/memory_budget.h"
#include "coordinator/datasets/dataset_machine_state.h"

namespace slabstream {

// ---------------------------------------------------------------- requests

void DatasetMachine::State::On(const SeekDataset& event) {
  const std::string& name = event.request->dataset;
  if (IsLevelName(name) || (datasets.folders.empty() && datasets.Find(name) == nullptr)) {
    news.uses[event.use] = DatasetLost{datasets.NoSuchDataset(name), &RefusedRequests::unknown_dataset};
    return;
  }
  const auto use =
      uses.insert_or_assign(event.use,
                            Use{.request = event.request, .most_level_bytes = event.most_level_bytes, .entries = {{name, Seek(name)}}})
          .first;
  if (const Status found = DescendUse(use->second); !found.ok()) {
    news.uses[event.use] = DatasetLost{found, &RefusedRequests::bad_request};
    uses.erase(use);
    return;
  }
  TellUse(*use);
}

void DatasetMachine::State::On(const KeepDataset& event) {
  const auto use = uses.find(event.use);
  if (use != uses.end()) use->second.kept = event.datasets;
}

void DatasetMachine::State::On(const ForgetClient& event) {
  std::erase_if(orders, [&](const auto& order) { return order.second.client == event.client; });
  if (const Upload upload = UploadOf(event.client); upload != uploads.end()) {
    EndUpload(upload, Status::Unavailable("its client has gone"));
  }
  RemoveFilesOf(event.client);
  std::erase_if(questions, [&](const auto& open) { return open.second.client == event.client; });
}

void DatasetMachine::State::On(const FinishStatus& event) {
  StatusReply reply = event.reply;
  reply.datasets = datasets.Report(now);
  reply.refused += refused;
  Send(event.client, std::move(reply));
}

void DatasetMachine::State::On(const EndDatasets& event) {
  for (const auto& [id, open] : questions) RefuseQuestion(open, Status::Unavailable(event.reason));
  stopped = true;
}

// Sees to it that the dataset is loaded as its files are now. The check of them that must be over before; 0: none.
CheckId DatasetMachine::State::Seek(const std::string& name) {
  if (!datasets.IsListed(name)) {
    datasets.Await(name, folder_checks.Want());
    folders_asked_for = true;
    CheckFolders();
    return 0;
  }
  datasets.Use(name);
  DatasetTable::Entry* const entry = datasets.Find(name);
  switch (entry->state) {
    case DatasetState::kUnloaded:
    case DatasetState::kFailed:
      LoadData(name);
      if (!IsLevelName(name)) break;
      [[fallthrough]];  // its source was opened before
    case DatasetState::kLoading: return entry->checks.Want();
    case DatasetState::kReady: {
      if (entry->stamp == nullptr) break;
      const CheckId check = entry->checks.Want();
      CheckFilesOf(name);
      return check;
    }
  }
  return 0;
}

// If its dataset has several levels and is open, it seeks those that it draws. Errors of LevelsOf.
Status DatasetMachine::State::DescendUse(Use& use) {
  const std::shared_ptr<const VolumeLevels> levels = datasets.Find(use.entries.front().name)->levels;
  if (levels == nullptr) return Status::Ok();
  FrameRequest seen = *use.request;
  const Result<ChosenView> chosen = ChooseView(seen, levels->levels.front().geometry, levels->overview);
  if (!chosen.ok()) return chosen.status();
  use.view = seen.view = chosen->view;
  Result<LevelMap> map = LevelsOf(seen, *levels);
  if (!map.ok()) return map.status();
  if (use.most_level_bytes > 0) map = NoneLarger(*std::move(map), use.most_level_bytes, *levels);
  use.map = std::make_shared<const LevelMap>(*std::move(map));
  use.entries.clear();
  for (const int level : use.map->levels) {
    const std::string name = LevelName(use.request->dataset, level);
    const CheckId check = Seek(name);
    use.entries.push_back({name, check});
  }
  use.has_light = use.request->shading.needs_light_volume();
  if (use.has_light) {
    const std::string name = LevelName(use.request->dataset, LightLevelOf(*levels));
    const CheckId check = Seek(name);
    use.entries.push_back({name, check});
  }
  return Status::Ok();
}

// Until a check has shown that the files have not changed, requests are planned for the voxels that are there.
void DatasetMachine::State::TellUse(const std::pair<const UseId, Use>& each) {
  const auto& [id, use] = each;
  DatasetReady ready;
  for (const Use::Entry& awaited : use.entries) {
    const DatasetTable::Entry& entry = *datasets.Find(awaited.name);
    if (entry.state != DatasetState::kReady || entry.levels != nullptr) {
      news.uses[id] = DatasetAwaited{.loading = entry.state == DatasetState::kLoading, .read = entry.read};
      return;
    }
    ready.seen = ready.seen && entry.checks.IsOver(awaited.check);
    if (use.has_light && &awaited == &use.entries.back()) {
      ready.light = {entry.id, entry.summary};
    } else if (ready.dataset == 0) {
      ready.dataset = entry.id;
      ready.summary = entry.summary;
    } else {
      ready.coarser.push_back({entry.id, entry.summary});
    }
  }
  if (use.map != nullptr) {
    ready.levels = datasets.Find(use.request->dataset)->levels;
    ready.drawn = use.map->levels;
    ready.view = use.view;
  }
  if (use.map != nullptr && !use.map->one_level()) ready.map = use.map;
  news.uses[id] = std::move(ready);
}

void DatasetMachine::State::TellUses(const std::string& name) {
  for (const auto& use : uses) {
    if (use.second.WaitsFor(name) && !use.second.begun()) TellUse(use);
  }
}

// What waits for the dataset, or for a level of it, ends; or what waits for this level.
void DatasetMachine::State::Lose(const std::string& name, const Status& why, RefusedAs as) {
  std::erase_if(uses, [&](const auto& each) {
    const auto& [id, use] = each;
    if (use.begun() || !(use.WaitsFor(name) || use.request->dataset == name)) return false;
    news.uses[id] = DatasetLost{why, as};
    return true;
  });
  std::erase_if(questions, [&](const auto& each) {
    const OpenQuestion& open = each.second;
    if (open.asked || !(open.entry == name || DatasetOfLevel(open.entry) == name)) return false;
    if (as != nullptr) ++(refused.*as);
    RefuseQuestion(open, why);
    return true;
  });
}

bool DatasetMachine::State::IsWanted(const std::string& name) const {
  return std::ranges::any_of(uses, [&](const auto& use) { return use.second.WaitsFor(name) && !use.second.begun(); }) ||
         std::ranges::any_of(questions, [&](const auto& open) { return !open.second.asked && open.second.entry == name; });
}

bool DatasetMachine::State::InUse(DatasetId dataset) const {
  const auto is_of = [&](const std::string& name) {
    const DatasetTable::Entry* const entry = datasets.Find(name);
    return entry != nullptr && entry->id == dataset;
  };
  const auto uses_it = [&](const auto& each) {
    const Use& use = each.second;
    if (use.begun()) return std::ranges::find(use.kept, dataset) != use.kept.end();
    return std::ranges::any_of(use.entries, [&](const Use::Entry& entry) { return is_of(entry.name); });
  };
  return std::ranges::any_of(uses, uses_it) ||
         std::ranges::any_of(questions, [&](const auto& open) { return !open.second.asked && is_of(open.second.entry); });
}

// ---------------------------------------------------------------- voxels

void DatasetMachine::State::LoadData(const std::string& name) {
  const LoadId load = datasets.BeginLoad(name, now);
  actions.emplace_back(
      LoadDataset{.name = name, .load = load, .source = datasets.Find(name)->source, .most_bytes = DatasetShare(config.memory_bytes)});
  TellUses(name);
}

void DatasetMachine::State::On(const DatasetReading& event) {
  if (!datasets.IsLoading(event.name, event.load)) return;
  datasets.Find(event.name)->read = event.read;
  TellUses(event.name);
}

void DatasetMachine::State::On(const DatasetLoaded& event) {
  const DatasetTable::Entry* const loading = datasets.Find(event.name);
  const Time begun = loading == nullptr ? now : loading->since;
  if (!datasets.Loaded(event.name, event.load, event.dataset, event.summary, event.bytes, event.stamp, now)) {
    if (!datasets.Holds(event.dataset)) actions.emplace_back(UnloadDataset{event.dataset});  // the executor has its voxels
    return;
  }
  const Index3& size = event.summary->description.geometry.size;
  Tell(NoteAbout::kDatasets, LogLevel::kInfo, "{} is {}: {} x {} x {} voxels, {}, {:.1f} ms", Named(event.name),
       event.summary->stored && event.bytes == 0 ? "open, and its voxels stay where they are" : "loaded", size.x, size.y, size.z,
       MemoryText(event.bytes), std::chrono::duration<double, std::milli>(now - begun).count());
  if (event.stamp == nullptr) datasets.Find(event.name)->checks.AnswerAll();
  CheckFilesOf(event.name);
  TellUses(event.name);

  const std::uint64_t share = DatasetShare(config.memory_bytes);
  while (datasets.bytes() > share && UnloadOne()) {
  }
  if (datasets.bytes() <= share) return;
  // All that are loaded are in use. What came last goes, with its requests.
  const Status too_large = TooLarge(event.name, event.bytes, datasets.bytes() - event.bytes);
  const Status full(too_large.code(), too_large.message() + "; an .ome.zarr, as slabstream convert makes it, is read in parts");
  Lose(event.name, full, &RefusedRequests::too_large);
  UnloadOne();
}

void DatasetMachine::State::On(const DatasetOpened& event) {
  const int count = int(event.levels->levels.size());
  if (!datasets.Opened(event.name, event.load, event.levels, event.sources, event.stamp, now)) return;
  const Index3& size = event.levels->levels.front().geometry.size;
  Tell(NoteAbout::kDatasets, LogLevel::kInfo, "dataset {} is open: {} x {} x {} voxels at the finest of {} levels", InQuotes(event.name),
       size.x, size.y, size.z, count);
  datasets.Find(event.name)->checks.AnswerAll();  // levels are checked for themselves
  for (auto next = uses.begin(); next != uses.end();) {
    const auto each = next++;
    auto& [id, use] = *each;
    if (!use.WaitsFor(event.name) || use.begun()) continue;
    const Status found = DescendUse(use);
    if (found.ok()) continue;
    news.uses[id] = DatasetLost{found, &RefusedRequests::bad_request};
    uses.erase(each);
  }
  for (int level = 0; level < count; ++level) TellUses(LevelName(event.name, level));
}

Status DatasetMachine::State::TooLarge(const std::string& name, std::uint64_t bytes, std::uint64_t others) const {
  return Status::ResourceExhausted(
      fmt::format("{} needs {}, limit {} ({} are in use by other datasets); the coordinator's --memory sets the limit", Named(name),
                  MemoryText(bytes), MemoryText(DatasetShare(config.memory_bytes)), MemoryText(others)));
}

void DatasetMachine::State::On(const DatasetFailed& event) {
  if (datasets.IsLoading(event.name, event.load)) FailData(event.name, event.status);
}

// A dataset cannot be read, or not be looked at. It is tried again when it is asked for again.
void DatasetMachine::State::FailData(const std::string& name, const Status& status) {
  datasets.Fail(name, status, now);
  const bool full = status.code() == StatusCode::kResourceExhausted;
  if (full && UnloadOne()) return LoadData(name);  // there may be room now
  Tell(NoteAbout::kDatasets, LogLevel::kWarning, "{} cannot be read: {}", Named(name), status.message());
  Lose(name, status, full ? &RefusedRequests::too_large : nullptr);
}

// What the dataset is read from is not what it was. Frames that have begun go on with the voxels that they began with.
// All levels of a dataset change together.
void DatasetMachine::State::RenewData(const std::string& changed) {
  const std::string name = DatasetOfLevel(changed);
  // What waits for a level waits for the dataset, which is opened anew.
  for (auto& [id, use] : uses) {
    if (use.begun() || use.map == nullptr || use.request->dataset != name) continue;
    use.entries = {{name}};
    use.map = nullptr;
    use.has_light = false;
  }
  for (auto& [id, open] : questions) {
    if (open.asked || DatasetOfLevel(open.entry) != name || open.entry == name) continue;
    open.entry = name;
    open.check = 0;
  }
  datasets.Reset(name, now);
  if (IsWanted(name)) LoadData(name);
}

bool DatasetMachine::State::UnloadOne() {
  const std::optional<DatasetId> unloaded = datasets.UnloadOne([this](DatasetId dataset) { return InUse(dataset); }, now);
  if (!unloaded) return false;
  Tell(NoteAbout::kDatasets, LogLevel::kInfo, "the dataset that was used least recently is unloaded: others need its memory");
  Unload(*unloaded);
  return true;
}

void DatasetMachine::State::UnloadRetired() {
  if (datasets.retired() == 0) return;
  for (const DatasetId dataset : datasets.TakeRetired([this](DatasetId id) { return InUse(id); })) Unload(dataset);
}

void DatasetMachine::State::Unload(DatasetId dataset) {
  news.unloaded.push_back(dataset);
  actions.emplace_back(UnloadDataset{dataset});
}

// ---------------------------------------------------------------- checks

// If somebody wants it and none is under way.
void DatasetMachine::State::CheckFilesOf(const std::string& name) {
  DatasetTable::Entry& entry = *datasets.Find(name);
  if (entry.state != DatasetState::kReady || entry.stamp == nullptr || !entry.checks.MustBegin()) return;
  entry.checks.Begin();
  actions.emplace_back(CheckDatasetFiles{.name = name, .load = entry.load, .stamp = entry.stamp});
}

void DatasetMachine::State::On(const DatasetSeen& event) {
  DatasetTable::Entry* const entry = datasets.FindLoad(event.name, event.load);
  if (entry == nullptr) return;
  entry->checks.End();
  if (event.changed.status().code() == StatusCode::kResourceExhausted) {
    // Says nothing about the files: what is loaded stays, and whoever asks again may have more luck.
    Lose(event.name, event.changed.status(), nullptr);
    CheckFilesOf(event.name);
  } else if (!event.changed.ok()) {
    FailData(event.name, event.changed.status());
  } else if (*event.changed) {
    Tell(NoteAbout::kDatasets, LogLevel::kInfo, "the files of {} have changed: they are read anew", Named(event.name));
    RenewData(event.name);
  } else {
    CheckFilesOf(event.name);
    for (auto& each : uses) {
      Use& use = each.second;
      bool over = false;
      for (Use::Entry& awaited : use.entries) {
        if (awaited.check == 0 || awaited.name != event.name || !entry->checks.IsOver(awaited.check)) continue;
        awaited.check = 0;
        over = true;
      }
      if (over && !use.begun()) TellUse(each);
    }
  }
  AnswerLists();
}

// If somebody wants it and it is not under way.
void DatasetMachine::State::CheckFolders() {
  if (!folder_checks.MustBegin()) return;
  folder_checks.Begin();
  actions.emplace_back(CheckWatchedFolders{datasets.folders, std::exchange(folders_asked_for, false)});
}

// At the folders, if there are any, and the files of what is loaded.
void DatasetMachine::State::CheckEverything() {
  if (!datasets.folders.empty()) {
    folder_checks.Want();
    CheckFolders();
  }
  datasets.ForEach([this](const std::string& name, DatasetTable::Entry& entry) {
    if (entry.state != DatasetState::kReady || entry.stamp == nullptr) return;
    entry.checks.Want();
    CheckFilesOf(name);
  });
}

// ---------------------------------------------------------------- the machine

void DatasetMachine::State::On(const ClientAsked& event) {
  std::visit([&](const auto& message) { OnMessage(event.from, message, event.payload); }, event.message);
}

void DatasetMachine::State::On(const BadRequest& event) {
  ++refused.bad_request;
  Tell(NoteAbout::kFrames, LogLevel::kInfo, "a request of client {} is refused: {}", event.from, event.why.message());
  if (const auto* order = std::get_if<OrderRefused>(&event.answer)) {
    if (const Upload upload = UploadOf(event.from, order->nonce); upload != uploads.end()) return EndUpload(upload, event.why);
  }
  Send(event.from, event.answer);
}

Time DatasetMachine::State::NextWake() const {
  return stopped || datasets.folders.empty() || folder_checks.UnderWay() ? Time::max() : next_round;
}

DatasetMachine::DatasetMachine(DatasetConfig config) : state_(std::make_unique<State>(std::move(config))) {}
DatasetMachine::~DatasetMachine() = default;
DatasetMachine::DatasetMachine(DatasetMachine&&) noexcept = default;

std::vector<DatasetAction> DatasetMachine::Step(const DatasetEvent& event, Time now) {
  State& state = *state_;
  if (state.stopped) return {};
  state.now = now;
  if (!std::exchange(state.started, true)) {
    state.next_round = now + state.config.check_interval;
    state.datasets.ForEach([now](const std::string&, DatasetTable::Entry& entry) { entry.since = now; });
  }
  std::visit([&state](const auto& e) { state.On(e); }, event);
  if (!state.stopped) {
    if (now >= state.NextWake()) state.CheckEverything();
    state.AskExecutor();
    state.UnloadRetired();
    if (!state.news.uses.empty() || !state.news.unloaded.empty()) state.actions.emplace_back(std::exchange(state.news, {}));
  }
  return std::exchange(state.actions, {});
}

Time DatasetMachine::NextWake() const { return state_->NextWake(); }

DatasetSizes DatasetMachine::sizes() const {
  State& state = *state_;
  std::size_t awaited = 0;
  state.datasets.ForEach([&](const std::string&, const DatasetTable::Entry& entry) { awaited += entry.awaited != 0 ? 1 : 0; });
  return {.uses = state.uses.size(),
          .orders = state.orders.size(),
          .awaited = awaited,
          .retired = state.datasets.retired(),
          .questions = state.questions.size(),
          .uploads = state.uploads.size()};
}

DatasetCounts DatasetMachine::counts() const {
  State& state = *state_;
  DatasetCounts counts{.voxel_bytes = state.datasets.bytes(), .refused = state.refused};
  state.datasets.ForEach([&](const std::string& name, const DatasetTable::Entry& entry) {
    if (entry.awaited != 0 || IsLevelName(name)) return;
    switch (entry.state) {
      case DatasetState::kUnloaded: ++counts.unloaded; break;
      case DatasetState::kLoading: ++counts.loading; break;
      case DatasetState::kReady: ++counts.ready; break;
      case DatasetState::kFailed: ++counts.failed; break;
    }
  });
  return counts;
}

}  // namespace slabstream
