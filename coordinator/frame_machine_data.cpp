#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "common/renderers/registry.h"
#include "common/volume/memory_budget.h"
#include "coordinator/frame_machine_state.h"

namespace slabstream {
namespace {

std::string InQuotes(const std::string& name) { return '"' + name + '"'; }

}  // namespace

// ---------------------------------------------------------------- requests

// Sets request.volume; its dataset is loaded. NotFound: no such preset; InvalidArgument: clipping or layers do not suit the dataset.
Status FrameMachine::State::FindVolume(OpenRequest& request) const {
  const FrameRequest& frame = request.submit.frame;
  const DatasetTable::Entry& dataset = *datasets.Find(frame.dataset);
  Result<VolumeLook> look = ResolveLook(frame, *dataset.summary);
  if (!look.ok()) return look.status();
  request.volume.emplace(dataset.id, std::move(look->transfer), FindRenderer(frame.renderer), std::move(look->clip),
                         std::move(look->layers));
  return Status::Ok();
}

// Sees to it that the dataset is loaded as its files are now. The look at them that must be over before; 0: none.
LookId FrameMachine::State::SeekData(const std::string& name) {
  DatasetTable::Entry* const entry = datasets.Find(name);
  if (entry == nullptr || entry->awaited != 0) {
    datasets.Await(name, folder_looks.Want());
    LookThroughFolders();
    return 0;
  }
  datasets.Use(name);
  switch (entry->state) {
    case DatasetState::kUnloaded:
    case DatasetState::kFailed: LoadData(name); break;
    case DatasetState::kLoading: return entry->looks.Want();
    case DatasetState::kReady: {
      if (entry->stamp == nullptr) break;
      const LookId look = entry->looks.Want();
      LookAt(name);
      return look;
    }
  }
  return 0;
}

// Until a look has shown that the files have not changed, the request is planned for the voxels that are there.
Status FrameMachine::State::Seek(OpenRequest& request) {
  const std::string& name = request.submit.frame.dataset;
  request.look = SeekData(name);
  return datasets.Find(name)->state == DatasetState::kReady ? FindVolume(request) : Status::Ok();
}

// ---------------------------------------------------------------- voxels

void FrameMachine::State::LoadData(const std::string& name) {
  const LoadId load = datasets.BeginLoad(name, now);
  actions.emplace_back(LoadDataset{.name = name, .load = load, .source = datasets.Find(name)->source});
}

void FrameMachine::State::On(const DatasetLoaded& event) {
  const DatasetTable::Entry* const loading = datasets.Find(event.name);
  const Time begun = loading == nullptr ? now : loading->since;
  if (!datasets.Loaded(event.name, event.load, event.dataset, event.summary, event.bytes, event.stamp, now)) {
    if (!datasets.Holds(event.dataset)) actions.emplace_back(UnloadDataset{event.dataset});  // the executor has its voxels
    return;
  }
  const Index3& size = event.summary->description.geometry.size;
  Tell(NoteAbout::kDatasets, LogLevel::kInfo, "dataset {} is loaded: {} x {} x {} voxels, {}, {:.1f} ms", InQuotes(event.name), size.x,
       size.y, size.z, MemoryText(event.bytes), std::chrono::duration<double, std::milli>(now - begun).count());
  if (event.stamp == nullptr) datasets.Find(event.name)->looks.AnswerAll();
  LookAt(event.name);

  const auto waits = [&](const OpenRequest& request) { return request.submit.frame.dataset == event.name && !request.volume; };
  queue.ForEach([&](OpenRequest& request) {
    if (waits(request) && FindVolume(request).ok()) SendQueued(request);
  });
  for (OpenRequest& request : queue.Extract(waits)) RefuseRequest(request, FindVolume(request), &RefusedRequests::bad_request);

  const std::uint64_t share = DatasetShare(config.memory_bytes);
  while (datasets.bytes() > share && UnloadOne()) {
  }
  if (datasets.bytes() <= share) return;
  // All that are loaded are in use. What came last goes, with its requests.
  const Status full = Status::ResourceExhausted(
      fmt::format("dataset \"{}\" needs {}, limit {} ({} are in use by other datasets); the "
                  "coordinator's --memory sets the limit",
                  event.name, MemoryText(event.bytes), MemoryText(share), MemoryText(datasets.bytes() - event.bytes)));
  const auto needs = [&](const OpenRequest& request) { return request.submit.frame.dataset == event.name; };
  for (const OpenRequest& request : queue.Extract(needs)) RefuseRequest(request, full, &RefusedRequests::too_large);
  RefuseQuestions(event.name, full);
  UnloadOne();
}

void FrameMachine::State::On(const DatasetFailed& event) {
  if (!datasets.IsLoading(event.name, event.load)) return;
  FailData(event.name, event.status);
}

// A dataset cannot be read, or not be looked at. It is tried again when it is asked for again.
void FrameMachine::State::FailData(const std::string& name, const Status& status) {
  datasets.Fail(name, status, now);
  const bool full = status.code() == StatusCode::kResourceExhausted;
  if (full && UnloadOne()) return LoadData(name);  // there may be room now
  Tell(NoteAbout::kDatasets, LogLevel::kWarning, "dataset {} cannot be read: {}", InQuotes(name), status.message());
  const auto waiting = queue.Extract([&](const OpenRequest& request) { return request.submit.frame.dataset == name; });
  for (const OpenRequest& request : waiting)
    full ? RefuseRequest(request, status, &RefusedRequests::too_large) : FailRequest(request, status);
  RefuseQuestions(name, status);
}

// What the dataset is read from is not what it was. Frames that have begun go on with the voxels that they began with.
void FrameMachine::State::RenewData(const std::string& name) {
  datasets.Reset(name, now);
  bool wanted = false;
  queue.ForEach([&](OpenRequest& request) {
    if (request.submit.frame.dataset != name) return;
    wanted = true;
    request.volume.reset();
    request.plan = 0;  // DropPlans drops it
    request.planned = nullptr;
  });
  if (wanted || IsAskedAbout(name)) LoadData(name);
}

bool FrameMachine::State::InUse(DatasetId dataset) {
  bool used = std::ranges::any_of(frames, [&](const RunningFrame& frame) { return frame.plan().setup.dataset == dataset; });
  queue.ForEach([&](const OpenRequest& request) { used = used || (request.volume && request.volume->dataset() == dataset); });
  for (const auto& [id, open] : questions) {
    const DatasetTable::Entry* const entry = open.asked ? nullptr : datasets.Find(DatasetOf(open.question));
    used = used || (entry != nullptr && entry->id == dataset);
  }
  return used;
}

bool FrameMachine::State::UnloadOne() {
  const std::optional<DatasetId> unloaded = datasets.UnloadOne([this](DatasetId dataset) { return InUse(dataset); }, now);
  if (!unloaded) return false;
  Tell(NoteAbout::kDatasets, LogLevel::kInfo, "the dataset that was used least recently is unloaded: others need its memory");
  occupancy.Forget(*unloaded);
  actions.emplace_back(UnloadDataset{*unloaded});
  return true;
}

void FrameMachine::State::UnloadRetired() {
  if (datasets.retired() == 0) return;
  for (const DatasetId dataset : datasets.TakeRetired([this](DatasetId id) { return InUse(id); })) {
    occupancy.Forget(dataset);
    actions.emplace_back(UnloadDataset{dataset});
  }
}

// ---------------------------------------------------------------- looks

// If somebody wants it and none is under way.
void FrameMachine::State::LookAt(const std::string& name) {
  DatasetTable::Entry& entry = *datasets.Find(name);
  if (entry.state != DatasetState::kReady || entry.stamp == nullptr || !entry.looks.MustBegin()) return;
  entry.looks.Begin();
  actions.emplace_back(LookAtDataset{.name = name, .load = entry.load, .stamp = entry.stamp});
}

void FrameMachine::State::On(const DatasetSeen& event) {
  DatasetTable::Entry* const entry = datasets.FindLoad(event.name, event.load);
  if (entry == nullptr) return;
  entry->looks.End();
  if (!event.changed.ok()) {
    FailData(event.name, event.changed.status());
  } else if (*event.changed) {
    Tell(NoteAbout::kDatasets, LogLevel::kInfo, "the files of dataset {} have changed: they are read anew", InQuotes(event.name));
    RenewData(event.name);
  } else {
    LookAt(event.name);
  }
  AnswerLists();
}

// If somebody wants it and it is not under way.
void FrameMachine::State::LookThroughFolders() {
  if (!folder_looks.MustBegin()) return;
  folder_looks.Begin();
  actions.emplace_back(LookAtFolders{datasets.folders});
}

// At the folders, if there are any, and the files of what is loaded.
void FrameMachine::State::LookAtEverything() {
  if (!datasets.folders.empty()) {
    folder_looks.Want();
    LookThroughFolders();
  }
  datasets.ForEach([this](const std::string& name, DatasetTable::Entry& entry) {
    if (entry.state != DatasetState::kReady || entry.stamp == nullptr) return;
    entry.looks.Want();
    LookAt(name);
  });
}

void FrameMachine::State::On(const FoldersSeen& event) {
  folder_looks.End();
  std::set<std::string> heard;
  for (const auto& [folder, found] : event.folders) {
    if (!datasets.folders.contains(folder)) continue;  // not any more
    if (found.ok()) {
      heard.insert(found->complaints.begin(), found->complaints.end());
      MergeFolder(folder, found->datasets, "its file is not in " + folder + " any more");
    } else {
      heard.insert(found.status().message());  // what was found before stays
    }
  }
  for (const std::string& line : heard) {
    if (!complaints.contains(line)) Tell(NoteAbout::kDatasets, LogLevel::kWarning, "{}", line);
  }
  complaints = std::move(heard);

  std::vector<std::string> missing;
  datasets.ForEach([&](const std::string& name, const DatasetTable::Entry& entry) {
    if (entry.awaited != 0 && folder_looks.IsOver(entry.awaited)) missing.push_back(name);
  });
  for (const std::string& name : missing) {
    datasets.Remove(name);
    const auto waiting = queue.Extract([&](const OpenRequest& request) { return request.submit.frame.dataset == name; });
    for (const OpenRequest& request : waiting) RefuseRequest(request, datasets.NoSuchDataset(name), &RefusedRequests::unknown_dataset);
  }
  next_round = now + config.look_interval;
  LookThroughFolders();
  AnswerLists();
}

// `gone`: why what is not found is no dataset any more.
void FrameMachine::State::MergeFolder(const std::string& folder, const Catalogue& found, const std::string& gone) {
  std::vector<std::string> missing;
  datasets.ForEach([&](const std::string& name, const DatasetTable::Entry& entry) {
    if (entry.source.folder == folder && !found.contains(name)) missing.push_back(name);
  });
  for (const std::string& name : missing) RemoveData(name, gone);
  std::erase_if(hidden, [&](const auto& name) { return name.second == folder && !found.contains(name.first); });
  for (const auto& [name, source] : found) {
    DatasetTable::Entry* const entry = datasets.Find(name);
    if (hidden.contains(name)) continue;
    if (entry == nullptr || entry->awaited != 0) {
      if (datasets.size() < config.max_datasets) AddData(name, source);
    } else if (entry->source.folder == folder && entry->source.path != source.path) {
      entry->source = source;
      RenewData(name);
    }
  }
}

// ---------------------------------------------------------------- the catalogue

void FrameMachine::State::AddData(const std::string& name, const DataSource& source) {
  datasets.Add(name, source, now);
  hidden.erase(name);
  Tell(NoteAbout::kDatasets, LogLevel::kInfo, "dataset {} is in the catalogue: {}", InQuotes(name),
       source.held_bytes > 0 ? "a client has sent it" : source.path);
  bool wanted = false;
  queue.ForEach([&](const OpenRequest& request) { wanted = wanted || request.submit.frame.dataset == name; });
  if (wanted || IsAskedAbout(name)) LoadData(name);
}

void FrameMachine::State::RemoveData(const std::string& name, const std::string& why) {
  const Status removed = Status::NotFound("dataset " + InQuotes(name) + " is not in the catalogue any more: " + why);
  Tell(NoteAbout::kDatasets, LogLevel::kInfo, "{}", removed.message());
  datasets.Remove(name);
  const auto waiting = queue.Extract([&](const OpenRequest& request) { return request.submit.frame.dataset == name; });
  for (const OpenRequest& request : waiting) FailRequest(request, removed);
  RefuseQuestions(name, removed);
}

void FrameMachine::State::StopWatching(const std::string& folder) {
  datasets.folders.erase(folder);
  MergeFolder(folder, {}, "an admin has removed " + folder);
}

// ---------------------------------------------------------------- orders

void FrameMachine::State::OnClientMessage(PeerToken client, const DataOrder& message) {
  std::erase_if(orders, [&](const auto& order) { return order.second.client == client; });  // it does not wait for that any more
  OpenOrder order{.client = client, .order = message};
  switch (message.action) {
    case DataAction::kAdd:
      orders.emplace(++last_order, std::move(order));
      actions.emplace_back(FindDatasets{last_order, message.items});
      return;
    case DataAction::kRemove: return AnswerOrder(client, message, Remove(message.items));
    case DataAction::kReload: return AnswerOrder(client, message, Reload(message.items));
    case DataAction::kList: break;
  }
  LookAtEverything();
  if (!datasets.folders.empty()) order.folders = folder_looks.Last();
  datasets.ForEach([&](const std::string& name, const DatasetTable::Entry& entry) {
    if (entry.state == DatasetState::kReady && entry.stamp != nullptr) order.datasets[name] = entry.looks.Last();
  });
  orders.emplace(++last_order, std::move(order));
  AnswerLists();
}

void FrameMachine::State::AnswerLists() {
  std::erase_if(orders, [this](const auto& open) {
    const OpenOrder& order = open.second;
    if (order.order.action != DataAction::kList || !folder_looks.IsOver(order.folders)) return false;
    for (const auto& [name, look] : order.datasets) {
      const DatasetTable::Entry* const entry = datasets.Find(name);
      if (entry != nullptr && entry->state == DatasetState::kReady && !entry->looks.IsOver(look)) return false;
    }
    AnswerOrder(order.client, order.order, Status::Ok());
    return true;
  });
}

void FrameMachine::State::AnswerOrder(PeerToken client, const DataOrder& order, const Status& status) {
  if (status.ok()) {
    SendClient(client, DataReply{.nonce = order.nonce, .datasets = datasets.Report(now)});
  } else {
    SendClient(client, OrderRefused{.nonce = order.nonce, .status = Bounded(status)});
  }
}

void FrameMachine::State::On(const DatasetsFound& event) {
  const auto order = orders.extract(event.order);
  if (order.empty()) return;  // its client has given another order, or has gone
  AnswerOrder(order.mapped().client, order.mapped().order, event.found.ok() ? AddFound(*event.found) : event.found.status());
}

// All of it or nothing. What lies in folders gives way to what there is.
Status FrameMachine::State::AddFound(const FoundData& found) {
  const auto is_there = [&](const std::string& name) {
    const DatasetTable::Entry* const entry = datasets.Find(name);
    return entry != nullptr && entry->awaited == 0;
  };
  std::size_t more = 0;
  for (const auto& [name, source] : found.datasets) {
    if (!is_there(name)) {
      ++more;
    } else if (source.folder.empty()) {
      return Status::InvalidArgument("there is already a dataset named " + InQuotes(name) + "; remove it first");
    }
  }
  for (const std::string& folder : found.folders) {
    if (datasets.folders.contains(folder)) return Status::InvalidArgument(folder + " is watched already");
  }
  if (datasets.size() + uploads.size() + more > config.max_datasets) {
    return Status::ResourceExhausted(
        fmt::format("{} datasets and {} more, the catalogue has at most {}", datasets.size(), more, config.max_datasets));
  }
  if (!found.folders.empty() && datasets.folders.empty()) next_round = now + config.look_interval;
  datasets.folders.insert(found.folders.begin(), found.folders.end());
  for (const auto& [name, source] : found.datasets) {
    if (!is_there(name)) AddData(name, source);
  }
  return Status::Ok();
}

// All of them or none.
Status FrameMachine::State::Remove(const std::vector<std::string>& items) {
  std::set<std::string> removed;
  for (const std::string& item : items) {
    if (datasets.folders.contains(item)) continue;
    const std::vector<std::string> names = datasets.Named(item);
    if (names.empty()) return item.starts_with('/') ? Status::NotFound(item + " is no watched folder") : datasets.NoSuchDataset(item);
    removed.insert(names.begin(), names.end());
  }
  for (const std::string& item : items) {
    if (datasets.folders.contains(item)) StopWatching(item);
  }
  for (const std::string& name : removed) {
    const DatasetTable::Entry* const entry = datasets.Find(name);
    if (entry == nullptr) continue;  // it went with its folder
    if (!entry->source.folder.empty()) hidden[name] = entry->source.folder;
    RemoveData(name, "an admin has removed it");
  }
  return Status::Ok();
}

Status FrameMachine::State::Reload(const std::vector<std::string>& items) {
  std::set<std::string> renewed;
  for (const std::string& item : items) {
    const std::vector<std::string> names = datasets.Named(item);
    if (names.empty()) return datasets.NoSuchDataset(item);
    renewed.insert(names.begin(), names.end());
  }
  for (const std::string& name : renewed) {
    Tell(NoteAbout::kDatasets, LogLevel::kInfo, "dataset {} is read anew: an admin wants it", InQuotes(name));
    RenewData(name);
  }
  return Status::Ok();
}

}  // namespace slabstream
