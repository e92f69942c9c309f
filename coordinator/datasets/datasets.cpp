#include "coordinator/datasets/datasets.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <chrono>
#include <numeric>
#include <utility>

#include "common/base/did_you_mean.h"
#include "common/frame/dataset_name.h"
#include "common/text/natural_order.h"

namespace slabstream {

namespace {
constexpr std::size_t kNamesInMessage = 12;
}

DatasetTable::DatasetTable(Catalogue catalogue, std::set<std::string> watched) : folders(std::move(watched)) {
  for (auto& [name, source] : catalogue) entries_[name].source = std::move(source);
}

DatasetTable::Entry* DatasetTable::Find(const std::string& name) {
  auto& table = IsPart(name) ? parts_ : entries_;
  const auto entry = table.find(name);
  return entry == table.end() ? nullptr : &entry->second;
}

const DatasetTable::Entry* DatasetTable::Find(const std::string& name) const {
  const auto& table = IsPart(name) ? parts_ : entries_;
  const auto entry = table.find(name);
  return entry == table.end() ? nullptr : &entry->second;
}

bool DatasetTable::IsListed(const std::string& name) const {
  const Entry* const entry = Find(name);
  return entry != nullptr && entry->awaited == 0;
}

DatasetTable::Entry* DatasetTable::FindLoad(const std::string& name, LoadId load) {
  Entry* const entry = Find(name);
  return entry != nullptr && entry->state == DatasetState::kReady && entry->load == load ? entry : nullptr;
}

Status DatasetTable::NoSuchDataset(const std::string& name) const {
  std::vector<std::string> names;
  for (const auto& [known, entry] : entries_) {
    if (entry.awaited == 0) names.push_back(known);
  }
  std::ranges::sort(names, {}, InNaturalOrder);
  const std::string meant = DidYouMean(name, names);
  if (names.size() > kNamesInMessage) names.resize(kNamesInMessage);
  if (names.empty()) return Status::NotFound("no dataset \"" + name + "\": the catalogue is empty");
  const std::string more = size() > names.size() ? fmt::format(" and {} more", size() - names.size()) : "";
  return Status::NotFound(fmt::format("no dataset \"{}\": the catalogue has {}{}{}", name, fmt::join(names, ", "), more, meant));
}

std::size_t DatasetTable::size() const {
  return std::size_t(std::ranges::count_if(entries_, [](const auto& entry) { return entry.second.awaited == 0; }));
}

std::vector<std::string> DatasetTable::Named(const std::string& name) const {
  std::vector<std::string> names;
  for (const auto& [known, entry] : entries_) {
    if (entry.awaited == 0 && (known == name || NameWithoutTime(known) == name)) names.push_back(known);
  }
  return names;
}

void DatasetTable::ForEach(const std::function<void(const std::string&, Entry&)>& visit) { VisitAll(*this, visit); }

void DatasetTable::Add(const std::string& name, DataSource source, Time now) {
  Entry& entry = entries_[name];
  CHECK(entry.awaited != 0 || (entry.source.path.empty() && !entry.source.load)) << name;
  entry = {.source = std::move(source), .since = now};
}

void DatasetTable::Await(const std::string& name, CheckId check) { entries_[name].awaited = check; }

void DatasetTable::Remove(const std::string& name) {
  RemoveParts(name);
  const auto entry = entries_.find(name);
  Retire(entry->second);
  entries_.erase(entry);
}

void DatasetTable::RemoveParts(const std::string& name) {
  std::erase_if(parts_, [&](const auto& each) {
    if (!each.first.starts_with(name + '\n')) return false;
    Retire(each.second);
    return true;
  });
}

bool DatasetTable::AddPart(const std::string& name, DataSource source, Time now) {
  CHECK(IsPart(name)) << name;
  return parts_.try_emplace(name, Entry{.source = std::move(source), .since = now}).second;
}

bool DatasetTable::ClosePart(const std::function<bool(const std::string&)>& is_wanted) {
  if (parts_.size() <= kMostParts) return false;
  auto oldest = parts_.end();
  for (auto part = parts_.begin(); part != parts_.end(); ++part) {
    const auto& [name, entry] = *part;
    if (IsLevelName(name) || entry.state == DatasetState::kLoading) continue;
    if ((oldest == parts_.end() || entry.last_use < oldest->second.last_use) && !is_wanted(name)) oldest = part;
  }
  if (oldest == parts_.end()) return false;
  RemoveParts(oldest->first);
  Retire(oldest->second);
  parts_.erase(oldest);
  return true;
}

namespace {
// What is of one time: a dataset, or what is shown of it while owners are gone; with fields and levels.
std::string OfOneTime(const std::string& entry) {
  for (const Missing missing : {Missing::kSkip, Missing::kLast}) {
    const std::string part = PartWithout(DatasetOfPart(entry), missing);
    if (entry == part || entry.starts_with(part + '\n')) return part;
  }
  return DatasetOfPart(entry);
}
}  // namespace

void DatasetTable::Release(const std::string& name, const std::function<bool(const std::string&)>& is_wanted, Time now) {
  std::set<std::string> wanted;
  VisitAll(*this, [&](const std::string& of, const Entry& entry) {
    if (DatasetOfPart(of) == name && (entry.state == DatasetState::kLoading || is_wanted(of))) wanted.insert(OfOneTime(of));
  });
  std::erase_if(parts_, [&](const auto& part) {
    if (DatasetOfPart(part.first) != name || wanted.contains(OfOneTime(part.first))) return false;
    Retire(part.second);
    return true;
  });
  Entry& entry = *Find(name);
  if (entry.state != DatasetState::kReady || wanted.contains(name)) return;
  Retire(entry);
  entry = Forgotten(entry, now);
}

LoadId DatasetTable::BeginLoad(const std::string& name, Time now) {
  Entry& entry = *Find(name);
  CHECK(entry.state == DatasetState::kUnloaded || entry.state == DatasetState::kFailed) << name;
  entry.state = DatasetState::kLoading;
  entry.since = now;
  entry.error.clear();
  entry.read = {};
  entry.loading = std::make_shared<Wanted>();
  return entry.load = ++last_load_;
}

void DatasetTable::Use(const std::string& name) { Find(name)->last_use = ++uses_; }

bool DatasetTable::Loaded(const std::string& name, LoadId load, DatasetId id, std::shared_ptr<const VolumeSummary> summary,
                          std::uint64_t bytes, std::shared_ptr<const FileStamp> stamp, std::shared_ptr<const DatasetFields> fields,
                          Time now) {
  if (!IsLoading(name, load)) return false;
  Entry* const entry = Find(name);
  CHECK(summary != nullptr) << name;
  entry->loading->End();
  entry->state = DatasetState::kReady;
  entry->since = now;
  entry->id = id;
  entry->summary = std::move(summary);
  entry->stamp = std::move(stamp);
  entry->bytes = bytes;
  entry->fields = std::move(fields);
  entry->statistics.clear();
  retired_.erase(id);  // the same voxels again
  return true;
}

bool DatasetTable::Opened(const std::string& name, LoadId load, std::shared_ptr<const VolumeLevels> levels, std::vector<DataSource> sources,
                          std::shared_ptr<const FileStamp> stamp, std::shared_ptr<const DatasetFields> fields, Time now) {
  if (!IsLoading(name, load)) return false;
  Entry& entry = *Find(name);
  entry.loading->End();
  entry.state = DatasetState::kReady;
  entry.since = now;
  entry.levels = std::move(levels);
  entry.fields = std::move(fields);
  entry.stamp = std::move(stamp);
  for (std::size_t level = 0; level < sources.size(); ++level) {
    parts_[LevelName(name, int(level))] = {.source = std::move(sources[level]), .since = now};
  }
  return true;
}

bool DatasetTable::IsLoading(const std::string& name, LoadId load) const {
  const Entry* const entry = Find(name);
  return entry != nullptr && entry->state == DatasetState::kLoading && entry->load == load;
}

void DatasetTable::Fail(const std::string& name, const Status& status, Time now) {
  Entry& entry = *Find(name);
  if (!entry.source.open) RemoveParts(name);  // of an owned one they are for this case
  Retire(entry);
  entry = Forgotten(entry, now);
  entry.state = DatasetState::kFailed;
  entry.error = status.message();
}

// The entry as if it had never been loaded.
DatasetTable::Entry DatasetTable::Forgotten(Entry& entry, Time now) {
  Entry fresh{.source = std::move(entry.source), .since = now, .load = entry.load, .last_use = entry.last_use, .checks = entry.checks};
  fresh.checks.End();
  if (fresh.source.open) {
    fresh.before = std::move(entry.before);
    if (entry.state == DatasetState::kReady) {
      Entry before = entry;
      before.opened = nullptr;  // its owners may overwrite that time
      before.stamp = nullptr;
      before.bytes = 0;
      fresh.before = std::make_shared<const Entry>(std::move(before));
    }
  }
  return fresh;
}

void DatasetTable::Reset(const std::string& name, Time now) {
  RemoveParts(name);
  Entry& entry = *Find(name);
  Retire(entry);
  entry = Forgotten(entry, now);
}

void DatasetTable::Retire(const Entry& entry) {
  if (entry.state == DatasetState::kReady && entry.levels == nullptr) retired_[entry.id] = entry.source.held_bytes + entry.bytes;
}

std::uint64_t DatasetTable::bytes(const std::function<bool(DatasetId)>& which) const {
  std::uint64_t total = 0;
  VisitAll(*this, [&](const std::string&, const Entry& entry) { total += which(entry.id) ? entry.source.held_bytes + entry.bytes : 0; });
  for (const auto& [id, bytes] : retired_) total += which(id) ? bytes : 0;
  return total;
}

std::uint64_t DatasetTable::LoadingBytes() const {
  const auto kind = [](const std::string& name) {  // a field, a plane, or a level
    const std::size_t last = name.rfind('\n');
    return last == std::string::npos ? name + "\nfield" : DatasetOfPart(name) + name.substr(last, name.find(' ', last) - last);
  };
  std::map<std::string, std::uint64_t> largest;
  VisitAll(*this, [&](const std::string& name, const Entry& entry) { largest[kind(name)] = std::max(largest[kind(name)], entry.bytes); });
  std::uint64_t bytes = 0;
  VisitAll(*this, [&](const std::string& name, const Entry& entry) {
    if (entry.state == DatasetState::kLoading) bytes += largest[kind(name)];
  });
  return bytes;
}

bool DatasetTable::Holds(DatasetId dataset) const {
  bool held = retired_.contains(dataset);
  VisitAll(*this, [&](const std::string&, const Entry& entry) { held |= entry.state == DatasetState::kReady && entry.id == dataset; });
  return held;
}

std::optional<DatasetId> DatasetTable::UnloadOne(const std::function<bool(DatasetId)>& in_use, Time now) {
  const std::string* oldest = nullptr;
  std::uint64_t last_use = 0;
  VisitAll(*this, [&](const std::string& name, const Entry& entry) {
    const bool held = entry.state == DatasetState::kReady && entry.levels == nullptr && entry.source.held_bytes == 0;
    if (!held || in_use(entry.id) || (oldest != nullptr && entry.last_use >= last_use)) return;
    oldest = &name;
    last_use = entry.last_use;
  });
  return oldest == nullptr ? std::nullopt : std::optional(Unload(*oldest, now));
}

DatasetId DatasetTable::Unload(const std::string& name, Time now) {
  Entry& entry = *Find(name);
  const DatasetId id = entry.id;
  Entry unloaded = Forgotten(entry, now);
  unloaded.fields = entry.fields;  // parts may be asked for before it is loaded again
  unloaded.opened = std::move(entry.opened);
  unloaded.statistics = std::move(entry.statistics);
  entry = std::move(unloaded);
  retired_.erase(id);
  return id;
}

std::vector<DatasetId> DatasetTable::TakeRetired(const std::function<bool(DatasetId)>& in_use) {
  std::vector<DatasetId> unused;
  std::erase_if(retired_, [&](const auto& retired) {
    if (in_use(retired.first)) return false;
    unused.push_back(retired.first);
    return true;
  });
  return unused;
}

std::vector<DatasetStatus> DatasetTable::Report(Time now) const {
  std::vector<DatasetStatus> report;
  for (const auto& [name, present] : entries_) {
    if (present.awaited != 0) continue;
    const bool waits = present.state == DatasetState::kUnloaded || present.state == DatasetState::kLoading;
    const Entry& entry = waits && present.before != nullptr ? *present.before : present;
    DatasetStatus status{.name = name, .state = entry.state, .error = entry.error};
    const auto since = std::chrono::duration_cast<std::chrono::milliseconds>(now - entry.since);
    status.since_ms = std::uint64_t(std::max(since, std::chrono::milliseconds(0)).count());
    if (entry.levels != nullptr) {
      status.description = entry.levels->levels.front();
      status.range = entry.levels->overview->range;
      status.levels = entry.levels->levels;

    } else if (entry.summary) {
      status.description = entry.summary->description;
      status.range = entry.summary->range;
      status.memory_bytes = entry.source.held_bytes + entry.bytes;
      status.cells = std::accumulate(entry.summary->cells.begin(), entry.summary->cells.end(), std::uint64_t{0});
    }
    if (entry.state == DatasetState::kReady) {
      for (const auto& [part, of_part] : parts_) status.memory_bytes += DatasetOfPart(part) == name ? of_part.bytes : 0;
    }
    if (entry.state == DatasetState::kReady && entry.fields != nullptr) status.fields = *entry.fields;
    status.is_shape = entry.source.is_shape;
    if (entry.state == DatasetState::kReady && entry.summary != nullptr && entry.summary->shape != nullptr) {
      status.shape = *entry.summary->shape;
    }
    report.push_back(std::move(status));
  }
  std::ranges::sort(report, {}, [](const DatasetStatus& status) { return InNaturalOrder(status.name); });
  return report;
}

}  // namespace slabstream
