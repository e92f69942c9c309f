#include <algorithm>
#include <utility>
#include <vector>

#include "coordinator/dataset_machine_state.h"

namespace slabstream {

// ---------------------------------------------------------------- watched folders

void DatasetMachine::State::On(const FoldersSeen& event) {
  folder_checks.End();
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
    if (entry.awaited != 0 && folder_checks.IsOver(entry.awaited)) missing.push_back(name);
  });
  for (const std::string& name : missing) {
    datasets.Remove(name);
    Lose(name, datasets.NoSuchDataset(name), &RefusedRequests::unknown_dataset);
  }
  next_round = now + config.check_interval;
  CheckFolders();
  AnswerLists();
}

// `gone`: why what is not found is no dataset any more.
void DatasetMachine::State::MergeFolder(const std::string& folder, const Catalogue& found, const std::string& gone) {
  std::vector<std::string> missing;
  datasets.ForEach([&](const std::string& name, const DatasetTable::Entry& entry) {
    if (entry.source.folder == folder && !found.contains(name)) missing.push_back(name);
  });
  for (const std::string& name : missing) RemoveData(name, gone);
  std::erase_if(hidden, [&](const auto& name) { return name.second == folder && !found.contains(name.first); });
  for (const auto& [name, source] : found) {
    if (hidden.contains(name)) continue;
    if (!datasets.IsListed(name)) {
      if (datasets.size() < config.max_datasets) AddData(name, source);
    } else if (DatasetTable::Entry* const entry = datasets.Find(name);
               entry->source.folder == folder && entry->source.path != source.path) {
      entry->source = source;
      RenewData(name);
    }
  }
}

// ---------------------------------------------------------------- the catalogue

void DatasetMachine::State::AddData(const std::string& name, const DataSource& source) {
  datasets.Add(name, source, now);
  hidden.erase(name);
  Tell(NoteAbout::kDatasets, LogLevel::kInfo, "dataset {} is in the catalogue: {}", InQuotes(name),
       source.held_bytes > 0 ? "a client has sent it" : source.path);
  if (IsWanted(name)) LoadData(name);
}

void DatasetMachine::State::RemoveData(const std::string& name, const std::string& why) {
  const Status removed = Status::NotFound("dataset " + InQuotes(name) + " is not in the catalogue any more: " + why);
  Tell(NoteAbout::kDatasets, LogLevel::kInfo, "{}", removed.message());
  datasets.Remove(name);
  Lose(name, removed);
}

void DatasetMachine::State::StopWatching(const std::string& folder) {
  datasets.folders.erase(folder);
  MergeFolder(folder, {}, "an admin has removed " + folder);
}

// ---------------------------------------------------------------- orders

void DatasetMachine::State::OnMessage(PeerToken client, const DataOrder& message, const Bytes&) {
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
  CheckEverything();
  if (!datasets.folders.empty()) order.folders = folder_checks.Last();
  datasets.ForEach([&](const std::string& name, const DatasetTable::Entry& entry) {
    if (entry.state == DatasetState::kReady && entry.stamp != nullptr) order.datasets[name] = entry.checks.Last();
  });
  orders.emplace(++last_order, std::move(order));
  AnswerLists();
}

void DatasetMachine::State::AnswerLists() {
  std::erase_if(orders, [this](const auto& open) {
    const OpenOrder& order = open.second;
    if (order.order.action != DataAction::kList || !folder_checks.IsOver(order.folders)) return false;
    for (const auto& [name, check] : order.datasets) {
      const DatasetTable::Entry* const entry = datasets.Find(name);
      if (entry != nullptr && entry->state == DatasetState::kReady && !entry->checks.IsOver(check)) return false;
    }
    AnswerOrder(order.client, order.order, Status::Ok());
    return true;
  });
}

void DatasetMachine::State::AnswerOrder(PeerToken client, const DataOrder& order, const Status& status) {
  if (status.ok()) {
    Send(client, DataReply{.nonce = order.nonce, .datasets = datasets.Report(now)});
  } else {
    Send(client, OrderRefused{.nonce = order.nonce, .status = Bounded(status)});
  }
}

void DatasetMachine::State::On(const DatasetsFound& event) {
  const auto order = orders.extract(event.order);
  if (order.empty()) return;  // its client has given another order, or has gone
  AnswerOrder(order.mapped().client, order.mapped().order, event.found.ok() ? AddFound(*event.found) : event.found.status());
}

// All of it or nothing. What lies in folders gives way to what there is.
Status DatasetMachine::State::AddFound(const FoundData& found) {
  std::size_t more = 0;
  for (const auto& [name, source] : found.datasets) {
    if (!datasets.IsListed(name)) {
      ++more;
    } else if (source.folder.empty()) {
      return NameIsFree(name);
    }
  }
  for (const std::string& folder : found.folders) {
    if (datasets.folders.contains(folder)) return Status::InvalidArgument(folder + " is watched already");
  }
  if (datasets.size() + uploads.size() + more > config.max_datasets) {
    return Status::ResourceExhausted(
        fmt::format("{} datasets and {} more, the catalogue has at most {}", datasets.size(), more, config.max_datasets));
  }
  if (!found.folders.empty() && datasets.folders.empty()) next_round = now + config.check_interval;
  datasets.folders.insert(found.folders.begin(), found.folders.end());
  for (const auto& [name, source] : found.datasets) {
    if (!datasets.IsListed(name)) AddData(name, source);
  }
  return Status::Ok();
}

// All of them or none.
Status DatasetMachine::State::Remove(const std::vector<std::string>& items) {
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

Status DatasetMachine::State::Reload(const std::vector<std::string>& items) {
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
