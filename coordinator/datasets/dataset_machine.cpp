#include "coordinator/datasets/dataset_machine.h"

#include <algorithm>
#include <chrono>
#include <utility>

#include "common/volume/memory_budget.h"
#include "coordinator/datasets/dataset_machine_state.h"
#include "data/sources/read_context.h"

namespace slabstream {

// ---------------------------------------------------------------- requests

void DatasetMachine::State::On(const SeekDataset& event) {
  const std::string& name = event.request->dataset;
  if (const Status known = CheckKnown(name, event.request.get()); !known.ok()) {
    news.uses[event.use] = DatasetLost{known, &RefusedRequests::unknown_dataset};
    return;
  }
  Use sought{.request = event.request,
             .most_level_bytes = event.most_level_bytes,
             .entries = {{name, Seek(name)}},
             .shapes = SeekShapes(*event.request)};
  const auto use = uses.insert_or_assign(event.use, std::move(sought)).first;
  if (const Status found = Advance(use->second); !found.ok()) {
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

void DatasetMachine::State::On(const LeaveDataset& event) {
  if (uses.erase(event.use) == 0) return;
  for (const std::string& name : std::exchange(wait_for_room, {})) {
    const DatasetTable::Entry* const entry = datasets.Find(name);
    if (entry != nullptr && entry->state == DatasetState::kUnloaded && IsWanted(name)) LoadData(name);
  }
}

void DatasetMachine::State::On(const ForgetClient& event) {
  std::erase_if(orders, [&](const auto& order) { return order.second.client == event.client; });
  if (const Upload upload = UploadOf(event.client); upload != uploads.end()) {
    EndUpload(upload, Status::Unavailable("its client has gone"));
  }
  RemoveFilesOf(event.client);
  std::erase_if(questions, [&](const auto& open) { return open.second.client == event.client; });
}

// What servers send, and nobody has waited for a while.
void DatasetMachine::State::GiveUpLoads() {
  next_give_up = Time::max();
  datasets.ForEach([this](const std::string& name, DatasetTable::Entry& entry) {
    if (entry.state != DatasetState::kLoading) return;
    const SourceAtLevel* const level = entry.source.at_level.get();
    if (ServerOf(level != nullptr ? level->stored.source : entry.source.path).empty()) return;
    if (entry.goes_on || IsWanted(name)) return entry.left.reset();
    const Time until = entry.left.value_or(now) + kUnwanted;
    if (now >= until) return void(datasets.Unload(name, now));
    entry.left = until - kUnwanted;
    next_give_up = std::min(next_give_up, until);
  });
}

void DatasetMachine::State::On(const FinishStatus& event) {
  if (now >= times_seen + config.check_interval) {
    times_seen = now;
    datasets.ForEach([this](const std::string& name, DatasetTable::Entry& entry) {
      if (entry.state != DatasetState::kReady || entry.stamp == nullptr || !entry.MayGrow()) return;
      entry.checks.Want();
      CheckFilesOf(name);
    });
  }
  StatusReply reply = event.reply;
  reply.datasets = datasets.Report(now);
  reply.refused += refused;
  Send(event.client, std::move(reply));
}

// What is not open here was answered before, on another connection if the client still waits, or was asked of an earlier coordinator.
void DatasetMachine::State::On(const FinishPong& event) {
  ClientPong pong = event.pong;
  std::erase_if(pong.lost, [&](std::uint64_t nonce) {
    const auto is_order = [&](const auto& each) { return each.second.client == event.client && each.second.order.nonce == nonce; };
    const auto asks = [&](const auto& each) { return each.second.client == event.client && NonceOf(each.second.question) == nonce; };
    return std::ranges::any_of(orders, is_order) || std::ranges::any_of(questions, asks) || std::ranges::any_of(uploads, is_order) ||
           std::ranges::any_of(files, is_order);
  });
  Send(event.client, std::move(pong));
}

void DatasetMachine::State::On(const EndDatasets& event) {
  for (const auto& [id, open] : questions) RefuseQuestion(open, Status::Unavailable(event.reason));
  stopped = true;
}

Status DatasetMachine::State::CheckKnown(const std::string& name, const FrameRequest* frame) const {
  const auto unknown = [&](const std::string& each) {
    return IsPart(each) || (datasets.folders.empty() && datasets.Find(each) == nullptr);
  };
  if (unknown(name)) return datasets.NoSuchDataset(name);
  if (frame == nullptr) return Status::Ok();
  const auto shape = std::ranges::find_if(frame->shapes, unknown, &ShapeChoice::shape);
  return shape == frame->shapes.end() ? Status::Ok() : datasets.NoSuchDataset(shape->shape);
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

// The entry of a field of a dataset that is open, at the dataset's own time.
std::string DatasetMachine::State::OwnSourceOf(const std::string& dataset, int field) {
  const DatasetTable::Entry& entry = *datasets.Find(dataset);
  if (entry.fields == nullptr || field == entry.fields->field) return dataset;
  std::string name = PartName(dataset, field, entry.fields->time);
  DataSource at = AtFieldAndTime(entry.source, *entry.fields, field, entry.fields->time, nullptr);
  if (entry.fields->fields[std::size_t(field)].channel) at.beside = entry.opened;
  datasets.AddPart(name, std::move(at), now);
  return name;
}

// The same at a time. At another time than the dataset's own the field is drawn by the statistics of that one, and a field with a source of
// its own tells there how many times it has: until that is known, `ready` is false, and the entry is the one that must be ready first.
// InvalidArgument: the field has several times, but not as many as the dataset.
Result<DatasetMachine::State::FieldSource> DatasetMachine::State::SourceOf(const std::string& dataset, int field, int time) {
  DatasetTable::Entry& entry = *datasets.Find(dataset);
  const std::string own = OwnSourceOf(dataset, field);
  if (entry.fields == nullptr || time == entry.fields->time) return FieldSource{own};
  if (!entry.statistics.contains(field)) {
    const DatasetTable::Entry& found = *datasets.Find(own);
    if (found.state != DatasetState::kReady) return FieldSource{own, false};
    const FieldInfo& info = entry.fields->fields[std::size_t(field)];
    const int times = info.channel || found.fields == nullptr ? 1 : found.fields->times.count;
    if (times > 1 && times != entry.fields->times.count) {
      return Status::InvalidArgument(fmt::format("field '{}' of dataset \"{}\" has {} times, must have one or {}, as the dataset",
                                                 info.name, dataset, times, entry.fields->times.count));
    }
    if (!info.channel && times == 1) return FieldSource{own};  // at all times
    entry.statistics[field] = found.overview();
  }
  std::string name = PartName(dataset, field, time);
  DataSource at = AtFieldAndTime(entry.source, *entry.fields, field, time, entry.statistics.at(field));
  at.beside = datasets.Find(own)->opened;
  parts_came |= datasets.AddPart(name, std::move(at), now);
  return FieldSource{name};
}

// Seeks what it needs next, as far as that is known. Errors of FieldsToShow, TimeToShow and LevelsOf.
Status DatasetMachine::State::Advance(Use& use) {
  const auto ready = [&] {
    return std::ranges::all_of(use.entries,
                               [&](const Use::Entry& entry) { return datasets.Find(entry.name)->state == DatasetState::kReady; });
  };
  if (use.stage == Use::Stage::kDataset && ready()) {
    if (Status sought = SeekSources(use); !sought.ok()) return sought;
  }
  // What shapes are there decides what the picture frames, and so the levels that it draws.
  if (use.stage == Use::Stage::kSources && ready()) {
    const Result<bool> has_shapes = SeekAtTime(*use.request, use.time, use.shapes);
    if (!has_shapes.ok()) return has_shapes.status();
    const Status sought = *has_shapes ? SeekVoxels(use) : Status::Ok();
    if (!sought.ok()) return sought;
  }
  const bool has_voxels = use.stage == Use::Stage::kVoxels && datasets.Find(use.entries.front().name)->state == DatasetState::kReady;
  if (has_voxels && use.planes.empty()) {
    const DatasetTable::Entry& volume = *datasets.Find(use.volume);
    const VolumeDescription& finest = volume.levels != nullptr ? volume.levels->levels.front() : volume.summary->description;
    use.planes = SeekPlanes(*use.request, finest.geometry, use.entries.front().name);
  }
  return Status::Ok();
}

Status DatasetMachine::State::SeekSources(Use& use) {
  const std::string name = use.entries.front().name;
  Result<ShownAtTime> shown = WhatShows(*use.request, datasets.Find(name)->fields);
  if (!shown.ok()) return shown.status();
  use.entries.resize(1);  // the dataset
  // More times may have come.
  if (use.request->time == kLastTime && !datasets.Find(name)->checks.IsOver(use.entries.front().check)) return Status::Ok();
  std::vector<std::string> sources;
  for (const int number : shown->numbers) {
    const Result<FieldSource> source = SourceOf(name, number, shown->time);
    if (!source.ok()) return source.status();
    if (source->ready) {
      sources.push_back(source->entry);
    } else {
      use.entries.push_back({source->entry, Seek(source->entry)});
    }
  }
  if (use.entries.size() > 1) return Status::Ok();
  const Use::Entry dataset = use.entries.front();
  use.entries.clear();
  for (const std::string& source : sources) use.entries.push_back(source == name ? dataset : Use::Entry{source, Seek(source)});
  use.fields = std::move(shown->fields);
  use.time = shown->time;
  use.stage = Use::Stage::kSources;
  return Status::Ok();
}

Status DatasetMachine::State::SeekVoxels(Use& use) {
  use.stage = Use::Stage::kVoxels;
  use.volume = use.entries.front().name;
  use.fields.shapes.clear();
  // All that is known of a source before its levels are chosen.
  const auto overview = [&](const std::string& name) -> CoarserVolume { return {1, datasets.Find(name)->overview()}; };
  for (const Use::Entry& shape : use.shapes) use.fields.shapes.push_back(overview(shape.name));
  std::vector<Use::Entry> sources = std::exchange(use.entries, {});
  ShownFields fields = use.fields;
  for (std::size_t i = 0; i < fields.others.size(); ++i) {
    fields.others[i].levels = {overview(sources[i + 1].name)};
    fields.others[i].of_volume = {0};
  }
  const std::shared_ptr<const VolumeLevels> levels = datasets.Find(use.volume)->levels;
  const CoarserVolume volume = overview(use.volume);
  const VolumeGeometry finest = levels != nullptr ? levels->levels.front().geometry : volume.summary->description.geometry;
  FrameRequest seen = *use.request;
  std::vector<VolumeGeometry> drawn = {finest};
  const auto seek_levels = [&](const std::string& source, const std::vector<int>& numbers) {
    for (const int level : numbers) {
      const std::string name = LevelName(source, level);
      const CheckId check = Seek(name);
      use.entries.push_back({name, check});
    }
  };
  if (levels != nullptr) {
    const Result<ChosenView> chosen = ChooseView(seen, finest, levels->overview, {}, fields);
    if (!chosen.ok()) return chosen.status();
    use.view = seen.view = chosen->view;
    Result<LevelMap> map = LevelsOf(seen, *levels, fields);
    if (!map.ok()) return map.status();
    if (use.most_level_bytes > 0) map = NoneLarger(*std::move(map), use.most_level_bytes, *levels);
    use.map = std::make_shared<const LevelMap>(*std::move(map));
    drawn.clear();
    for (const int level : use.map->levels) drawn.push_back(levels->levels[std::size_t(level)].geometry);
    seek_levels(use.volume, use.map->levels);
  } else {
    use.entries.push_back(sources.front());
  }
  use.volume_entries = use.entries.size();
  std::optional<double> pixel;
  for (std::size_t i = 1; i < sources.size(); ++i) {
    FieldVolume& field = use.fields.others[i - 1];
    const std::shared_ptr<const VolumeLevels> of_field = datasets.Find(sources[i].name)->levels;
    if (of_field == nullptr) {
      use.entries.push_back(sources[i]);
      field.of_volume.assign(drawn.size(), 0);
      continue;
    }
    if (!pixel) {
      const Result<double> found = DetailOf(seen, finest, volume.summary, fields);
      if (!found.ok()) return found.status();
      pixel = *found;
    }
    FieldLevels of = LevelsOfField(*of_field, finest, drawn, *pixel);
    field.of_volume = std::move(of.of_volume);
    seek_levels(sources[i].name, of.levels);
  }
  if (!use.request->shading.needs_light_volume()) return Status::Ok();
  sources.resize(use.fields.values());  // labels take no light
  for (const Use::Entry& source : sources) {
    const std::shared_ptr<const VolumeLevels> of_field = datasets.Find(source.name)->levels;
    if (of_field == nullptr) {
      use.entries.push_back(source);
    } else {
      seek_levels(source.name, {LightLevelOf(*of_field)});
    }
  }
  return Status::Ok();
}

// Of requests that wait for it. It has been opened or loaded.
void DatasetMachine::State::AdvanceUses(const std::string& name) {
  for (auto next = uses.begin(); next != uses.end();) {
    const auto each = next++;
    auto& [id, use] = *each;
    if (!use.WaitsFor(name) || use.begun()) continue;
    const Status advanced = Advance(use);
    if (!advanced.ok()) {
      news.uses[id] = DatasetLost{advanced, &RefusedRequests::bad_request};
      uses.erase(each);
    } else {
      TellUse(*each);
    }
  }
}

// Until a check has shown that the files have not changed, requests are planned for the voxels that are there.
void DatasetMachine::State::TellUse(const std::pair<const UseId, Use>& each) {
  const auto& [id, use] = each;
  DatasetReady ready;
  std::vector<CoarserVolume> voxels, shapes, planes;
  // False: it waits for one.
  const auto add_ready = [&](const std::vector<Use::Entry>& entries, bool may_be, std::vector<CoarserVolume>& added) {
    for (const Use::Entry& awaited : entries) {
      const DatasetTable::Entry& entry = *datasets.Find(awaited.name);
      if (entry.state != DatasetState::kReady || !may_be) {
        news.uses[id] = DatasetAwaited{.loading = entry.state == DatasetState::kLoading, .read = entry.read};
        return false;
      }
      ready.seen = ready.seen && entry.checks.IsOver(awaited.check);
      added.push_back({entry.id, entry.levels != nullptr ? entry.levels->overview : entry.summary});
    }
    return true;
  };
  if (!add_ready(use.entries, use.stage == Use::Stage::kVoxels, voxels) || !add_ready(use.shapes, true, shapes) ||
      !add_ready(use.planes, true, planes)) {
    return;
  }
  ready.dataset = voxels.front().dataset;
  ready.summary = voxels.front().summary;
  auto next = voxels.begin() + std::ptrdiff_t(use.volume_entries);
  ready.coarser.assign(voxels.begin() + 1, next);
  ready.fields = use.fields;
  ready.fields.shapes = std::move(shapes);
  ready.fields.planes = std::move(planes);
  for (FieldVolume& field : ready.fields.others) {
    const std::ptrdiff_t count = std::ptrdiff_t(std::ranges::max(field.of_volume)) + 1;
    field.levels.assign(next, next + count);
    next += count;
  }
  if (next != voxels.end()) {
    ready.light = *next;
    for (std::size_t i = 0; i + 1 < ready.fields.values(); ++i) ready.fields.others[i].light = *++next;
  }
  if (use.map != nullptr) {
    ready.levels = datasets.Find(use.volume)->levels;
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
    if (use.begun() || !(use.WaitsFor(name) || use.request->dataset == name || ShowsShape(*use.request, name))) return false;
    news.uses[id] = DatasetLost{why, as};
    return true;
  });
  std::erase_if(questions, [&](const auto& each) {
    const OpenQuestion& open = each.second;
    const FrameRequest* const frame = FrameOf(open.question);
    const bool shows = frame != nullptr && ShowsShape(*frame, name);
    if (open.asked || !(open.WaitsFor(name) || DatasetOfPart(open.entry) == name || shows)) return false;
    if (as != nullptr) ++(refused.*as);
    RefuseQuestion(open, why);
    return true;
  });
}

bool DatasetMachine::State::IsWanted(const std::string& name) const {
  return IsAwaited([&](const std::string& entry) { return entry == name; });
}

bool DatasetMachine::State::IsKept(DatasetId dataset) const {
  return std::ranges::any_of(uses,
                             [&](const auto& each) { return std::ranges::find(each.second.kept, dataset) != each.second.kept.end(); });
}

bool DatasetMachine::State::IsAwaited(DatasetId dataset) const {
  return IsAwaited([&](const std::string& name) {
    const DatasetTable::Entry* const entry = datasets.Find(name);
    return entry != nullptr && entry->id == dataset;
  });
}

// ---------------------------------------------------------------- voxels

void DatasetMachine::State::LoadData(const std::string& name) {
  const LoadId load = datasets.BeginLoad(name, now);
  // Room first: while it is loaded, both would be there.
  while (datasets.bytes() + datasets.LoadingBytes() > DatasetShare(config.memory_bytes) && UnloadOne()) {
  }
  actions.emplace_back(LoadDataset{.name = name,
                                   .load = load,
                                   .source = datasets.Find(name)->source,
                                   .most_bytes = DatasetShare(config.memory_bytes),
                                   .stop = datasets.Find(name)->loading->stop.get_token()});
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
  if (!datasets.Loaded(event.name, event.load, event.dataset, event.summary, event.bytes, event.stamp, event.fields, now)) {
    if (!datasets.Holds(event.dataset)) actions.emplace_back(UnloadDataset{event.dataset});  // the executor has its voxels
    return;
  }
  datasets.Find(event.name)->opened = event.opened;
  const Index3& size = event.summary->description.geometry.size;
  Tell(NoteAbout::kDatasets, LogLevel::kInfo, "{} is {}: {} x {} x {} voxels, {}, {:.1f} ms", Named(event.name),
       event.summary->stored && event.bytes == 0 ? "open, and its voxels stay where they are" : "loaded", size.x, size.y, size.z,
       MemoryText(event.bytes), std::chrono::duration<double, std::milli>(now - begun).count());
  if (event.stamp == nullptr) datasets.Find(event.name)->checks.AnswerAll();
  CheckFilesOf(event.name);
  AdvanceUses(event.name);

  const std::uint64_t share = DatasetShare(config.memory_bytes);
  while (datasets.bytes() > share && UnloadOne()) {
  }
  if (datasets.bytes() <= share) return;
  // All that are loaded are in use. What came last goes.
  if (datasets.bytes() - BytesThatFramesGiveBack() <= share) return WaitForRoom(event.name);
  const Status too_large = TooLarge(event.name, event.bytes, datasets.bytes() - event.bytes);
  const Status full(too_large.code(), too_large.message() + "; an .ome.zarr, as slabstream convert makes it, is read in parts");
  Lose(event.name, full, &RefusedRequests::too_large);
  UnloadOne();
}

void DatasetMachine::State::On(const DatasetOpened& event) {
  const int count = int(event.levels->levels.size());
  if (!datasets.Opened(event.name, event.load, event.levels, event.sources, event.stamp, event.fields, now)) return;
  datasets.Find(event.name)->opened = event.opened;
  const Index3& size = event.levels->levels.front().geometry.size;
  Tell(NoteAbout::kDatasets, LogLevel::kInfo, "{} is open: {} x {} x {} voxels at the finest of {} levels", Named(event.name), size.x,
       size.y, size.z, count);
  datasets.Find(event.name)->checks.AnswerAll();  // levels are checked for themselves
  AdvanceUses(event.name);
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
  const bool full = status.code() == StatusCode::kResourceExhausted;
  if (full && UnloadOne()) {  // there may be room now
    datasets.Unload(name, now);
    return LoadData(name);
  }
  if (full && BytesThatFramesGiveBack() > 0) return WaitForRoom(name);
  datasets.Fail(name, status, now);
  Tell(NoteAbout::kDatasets, LogLevel::kWarning, "{} cannot be read: {}", Named(name), status.message());
  std::map<UseId, Use> without;
  if (datasets.Find(name)->source.open && !IsPart(name)) {
    for (auto next = uses.begin(); next != uses.end();) {
      const auto use = next++;
      const FrameRequest& request = *use->second.request;
      if (request.dataset == name && request.missing != Missing::kFail && !use->second.begun()) without.insert(uses.extract(use));
    }
  }
  Lose(name, status, full ? &RefusedRequests::too_large : nullptr);
  SeekWithout(name, std::move(without));
}

// The same request, which waits for `entry` first.
DatasetMachine::State::Use DatasetMachine::State::Anew(const Use& use, const Use::Entry& entry) {
  return {.request = use.request, .most_level_bytes = use.most_level_bytes, .entries = {entry}, .shapes = NamedShapes(*use.request)};
}

// What is there of a dataset of which owners are gone, for those who want that rather than nothing.
void DatasetMachine::State::SeekWithout(const std::string& name, std::map<UseId, Use> without) {
  uses.merge(without);
  for (auto& each : uses) {
    Use& use = each.second;
    const bool wants = use.request->dataset == name && use.request->missing != Missing::kFail && !use.begun();
    if (!wants || use.entries.front().name != name) continue;
    const DatasetTable::Entry& entry = *datasets.Find(name);
    DataSource source = entry.source;
    source.missing = use.request->missing;
    if (entry.before != nullptr) source.statistics = entry.before->overview();
    const std::string part = PartWithout(name, source.missing);
    datasets.AddPart(part, std::move(source), now);
    use = Anew(use, {part, Seek(part)});
    TellUse(each);
  }
}

// What the dataset is read from is not what it was. Frames that have begun go on with the voxels that they began with.
// All levels of a dataset change together.
void DatasetMachine::State::RenewData(const std::string& changed) {
  const std::string name = DatasetOfPart(changed);
  // What waits for a part waits for the dataset, which is opened anew.
  for (auto& [id, use] : uses) {
    const std::string& dataset = use.request->dataset;
    const bool waits = use.stage == Use::Stage::kDataset && use.entries.front().name == dataset;
    if (use.begun() || waits || !(dataset == name || ShowsShape(*use.request, name))) continue;
    use = Anew(use, {dataset});
  }
  for (auto& [id, open] : questions) {
    const bool is_of_part = DatasetOfPart(open.entry) == name && open.entry != name;
    const FrameRequest* const frame = FrameOf(open.question);
    if (open.asked || !(is_of_part || (frame != nullptr && ShowsShape(*frame, name)))) continue;
    open.entry = DatasetOf(open.question);
    open.check = 0;
    open.fields = {};
    open.labels = {};
    open.others = {};
    open.planes = {};
    if (frame != nullptr) open.shapes = NamedShapes(*frame);
    open.summary = nullptr;
  }
  const bool may_grow = datasets.Find(name)->MayGrow();
  datasets.Reset(name, now);
  if (IsWanted(name) || may_grow) LoadData(name);
  datasets.Find(name)->goes_on = may_grow;
}

// Once those that render now have ended.
std::uint64_t DatasetMachine::State::BytesThatFramesGiveBack() const {
  return datasets.bytes([this](DatasetId dataset) { return dataset != 0 && IsKept(dataset) && !IsAwaited(dataset); });
}

// The requests of the entry wait on, without its voxels.
void DatasetMachine::State::WaitForRoom(const std::string& name) {
  if (const DatasetId unloaded = datasets.Unload(name, now); unloaded != 0) Unload(unloaded);
  wait_for_room.insert(name);
  TellUses(name);
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

// Frames that have begun keep the voxels that they began with.
void DatasetMachine::State::ClosePartsThatNobodyWants() {
  const auto is_wanted = [this](const std::string& part) {
    return IsAwaited([&](const std::string& entry) { return entry == part || entry.starts_with(part + '\n'); });
  };
  while (datasets.ClosePart(is_wanted)) {
  }
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
    bool tell = false;
    for (auto& [id, use] : uses) {
      bool over = false;
      for (std::vector<Use::Entry>* const entries : {&use.entries, &use.shapes, &use.planes}) {
        for (Use::Entry& awaited : *entries) {
          if (awaited.check == 0 || awaited.name != event.name || !entry->checks.IsOver(awaited.check)) continue;
          awaited.check = 0;
          over = true;
        }
      }
      tell |= over && !use.begun();
    }
    if (tell) AdvanceUses(event.name);
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
  if (stopped) return Time::max();
  return datasets.folders.empty() || folder_checks.UnderWay() ? next_give_up : std::min(next_round, next_give_up);
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
    state.GiveUpLoads();
    state.AskExecutor();
    if (std::exchange(state.parts_came, false)) state.ClosePartsThatNobodyWants();
    state.UnloadRetired();
    if (!state.news.uses.empty() || !state.news.unloaded.empty()) state.actions.emplace_back(std::exchange(state.news, {}));
  }
  return std::exchange(state.actions, {});
}

Time DatasetMachine::NextWake() const { return state_->NextWake(); }

Status DatasetMachine::NameIsFree(const std::string& name) const { return state_->NameIsFree(name); }

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
    if (entry.awaited != 0 || IsPart(name)) return;
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
