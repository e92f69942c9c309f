#include <algorithm>
#include <utility>
#include <vector>

#include "coordinator/datasets/dataset_machine_state.h"

namespace slabstream {

// ---------------------------------------------------------------- watched folders

void DatasetMachine::State::On(const FoldersSeen& event) {
  folder_checks.End();
  for (const auto& [folder, found] : event.folders) {
    if (!datasets.folders.contains(folder)) continue;  // not any more
    std::set<std::string> heard;
    if (found.ok()) {
      heard.insert(found->complaints.begin(), found->complaints.end());
      const std::size_t left_out = MergeFolder(folder, found->datasets, "its file is not in " + folder + " any more");
      if (left_out > 0) {
        heard.insert(fmt::format("{}: {} volumes are left out: the catalogue has at most {}", folder, left_out, config.max_datasets));
      }
    } else {
      heard.insert(found.status().message());  // what was found before stays
    }
    for (const std::string& line : heard) {
      if (!complaints[folder].contains(line)) Tell(NoteAbout::kDatasets, LogLevel::kWarning, "{}", line);
    }
    complaints[folder] = std::move(heard);
  }

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

// `gone`: why what is not found is no dataset any more. How many found ones the catalogue has no room for.
std::size_t DatasetMachine::State::MergeFolder(const std::string& folder, const Catalogue& found, const std::string& gone) {
  std::vector<std::string> missing;
  datasets.ForEach([&](const std::string& name, const DatasetTable::Entry& entry) {
    if (entry.source.folder == folder && !found.contains(name)) missing.push_back(name);
  });
  for (const std::string& name : missing) RemoveData(name, gone);
  std::erase_if(hidden, [&](const auto& name) { return name.second == folder && !found.contains(name.first); });
  std::size_t left_out = 0, room = config.max_datasets - std::min(config.max_datasets, datasets.size());
  for (const auto& [name, source] : found) {
    if (hidden.contains(name)) continue;
    if (!datasets.IsListed(name)) {
      if (room == 0) {
        ++left_out;
        continue;
      }
      AddData(name, source);
      --room;
    } else if (DatasetTable::Entry* const entry = datasets.Find(name);
               entry->source.folder == folder && entry->source.path != source.path) {
      entry->source = source;
      RenewData(name);
    }
  }
  return left_out;
}

// ---------------------------------------------------------------- the catalogue

void DatasetMachine::State::AddData(const std::string& name, const DataSource& source) {
  datasets.Add(name, source, now);
  hidden.erase(name);
  Tell(NoteAbout::kDatasets, LogLevel::kInfo, "dataset {} is in the catalogue: {}", InQuotes(name),
       source.held_bytes > 0 || source.sent != nullptr ? "a client has sent it" : source.path);
  if (IsWanted(name)) LoadData(name);
}

void DatasetMachine::State::RemoveData(const std::string& name, const std::string& why) {
  const Status removed = Status::NotFound("dataset " + InQuotes(name) + " is not in the catalogue any more: " + why);
  Tell(NoteAbout::kDatasets, LogLevel::kInfo, "{}", removed.message());
  datasets.Remove(name);
  files.erase(name);
  Lose(name, removed);
}

void DatasetMachine::State::On(const OwnedData& event) {
  if (event.came) {
    if (!datasets.IsListed(event.name)) AddData(event.name, *event.came);
    return;
  }
  const DatasetTable::Entry* const entry = datasets.Find(event.name);
  if (entry == nullptr || !entry->source.open) return;  // an admin has removed it
  if (event.left) return RemoveData(event.name, "its owners have left");
  datasets.Release(
      event.name, [this](const std::string& wanted) { return IsWanted(wanted); }, now);
}

void DatasetMachine::State::StopWatching(const std::string& folder) {
  datasets.folders.erase(folder);
  complaints.erase(folder);
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
  folders_asked_for = true;
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
  folders_asked_for = true;  // there may be room now for what was left out, or a name that was taken
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
