#include "coordinator/datasets.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <string>
#include <utility>

namespace slabstream {

namespace {
constexpr std::size_t kNamesInMessage = 12;
}

DatasetTable::DatasetTable(const std::vector<std::string>& names) {
  for (const std::string& name : names) entries_.try_emplace(name);
}

const DatasetTable::Entry* DatasetTable::Find(const std::string& name) const {
  const auto entry = entries_.find(name);
  return entry == entries_.end() ? nullptr : &entry->second;
}

Status DatasetTable::NoSuchDataset(const std::string& name) const {
  if (entries_.empty()) return Status::NotFound("no dataset \"" + name + "\": the catalogue is empty");
  std::vector<std::string> names;
  for (const auto& [known, entry] : entries_) {
    if (names.size() < kNamesInMessage) names.push_back(known);
  }
  const std::string more = entries_.size() > kNamesInMessage ? fmt::format(" and {} more", entries_.size() - kNamesInMessage) : "";
  return Status::NotFound(fmt::format("no dataset \"{}\": the catalogue has {}{}", name, fmt::join(names, ", "), more));
}

LoadId DatasetTable::BeginLoad(const std::string& name) {
  Entry& entry = entries_.at(name);
  CHECK(entry.state == DatasetState::kUnloaded || entry.state == DatasetState::kFailed) << name;
  entry = {.state = DatasetState::kLoading, .load = ++last_load_, .last_use = entry.last_use};
  return entry.load;
}

void DatasetTable::Use(const std::string& name) { entries_.at(name).last_use = ++uses_; }

bool DatasetTable::Loaded(const std::string& name, LoadId load, DatasetId id, std::shared_ptr<const VolumeSummary> summary,
                          std::uint64_t bytes) {
  const auto found = entries_.find(name);
  if (found == entries_.end() || found->second.state != DatasetState::kLoading || found->second.load != load) return false;
  CHECK(summary != nullptr) << name;
  found->second = {.state = DatasetState::kReady,
                   .load = load,
                   .id = id,
                   .summary = std::move(summary),
                   .bytes = bytes,
                   .last_use = found->second.last_use};
  return true;
}

bool DatasetTable::Failed(const std::string& name, const Status& status) {
  const auto found = entries_.find(name);
  if (found == entries_.end() || found->second.state != DatasetState::kLoading) return false;
  found->second = {.state = DatasetState::kFailed, .load = found->second.load, .error = status.message()};
  return true;
}

std::uint64_t DatasetTable::bytes() const {
  std::uint64_t total = 0;
  for (const auto& [name, entry] : entries_) total += entry.bytes;
  return total;
}

std::optional<DatasetId> DatasetTable::UnloadOne(const std::function<bool(DatasetId)>& in_use) {
  Entry* oldest = nullptr;
  for (auto& [name, entry] : entries_) {
    const bool may_go = entry.state == DatasetState::kReady && !in_use(entry.id);
    if (may_go && (oldest == nullptr || entry.last_use < oldest->last_use)) oldest = &entry;
  }
  if (oldest == nullptr) return std::nullopt;
  const DatasetId id = oldest->id;
  *oldest = {.last_use = oldest->last_use};
  return id;
}

std::vector<DatasetStatus> DatasetTable::Report() const {
  std::vector<DatasetStatus> report;
  for (const auto& [name, entry] : entries_) {
    DatasetStatus status{.name = name, .state = entry.state, .error = entry.error};
    if (entry.summary) {
      status.description = entry.summary->description;
      status.range = entry.summary->range;
      status.memory_bytes = entry.bytes;
    }
    report.push_back(std::move(status));
  }
  return report;
}

}  // namespace slabstream
