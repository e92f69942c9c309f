#include "coordinator/service/background_actions.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <variant>

#include "common/base/log.h"
#include "common/base/printable.h"
#include "common/mesh/summarize_cells.h"
#include "common/planning/other_bricks.h"
#include "common/renderers/renderer_kind.h"
#include "common/text/url.h"
#include "common/threads/guarded.h"
#include "common/volume/memory_budget.h"
#include "coordinator/probe/plane_shape.h"
#include "coordinator/service/answer_question.h"
#include "coordinator/service/dataset_id.h"
#include "data/catalogue/client_file.h"
#include "data/catalogue/dataset_fields.h"
#include "data/catalogue/shape_data.h"
#include "data/owned/owned_source.h"
#include "data/sources/read_context.h"
#include "data/stores/store.h"
#include "data/survey/brick_index.h"
#include "data/survey/survey.h"

namespace slabstream {
namespace {

// The tasks of a server may hold up each other. 0: of files.
FairTasks::Owner OwnerOf(std::string_view server) { return server.empty() ? 0 : std::hash<std::string_view>()(server); }

// Those that are read are read until `stop` is told to stop.
VoxelServer::Samples Stoppable(VoxelServer::Samples samples, const std::stop_token& stop) {
  samples.in_parts.stop = stop;
  return samples;
}

// Whether at least half of the volume's bricks hold one value each.
bool MostBricksAreEqual(const VolumeSummary& summary) {
  const auto equal = std::ranges::count_if(summary.bricks, [](const ValueRange& range) { return range.min == range.max; });
  return 2 * std::size_t(equal) >= summary.bricks.size();
}

FoldersSeen Check(const CheckWatchedFolders& action, FolderMemory& memory) {
  FoldersSeen seen;
  for (const std::string& folder : action.folders) {
    if (!action.asked_for && memory.IsUnchanged(folder)) {
      seen.unchanged.insert(folder);
    } else {
      seen.folders.emplace(folder, Guarded(folder.c_str(), [&] { return memory.Remember(folder, [&] { return ListFolder(folder); }); }));
    }
  }
  return seen;
}

// What an order wants to add. Its paths are those of this host, whatever the current folder of this process is.
Result<FoundData> Find(const std::vector<std::string>& arguments) {
  std::array<char, 256> host{};
  if (::gethostname(host.data(), host.size() - 1) != 0) host = {"this host"};
  const auto here = [&](const Status& status) {
    return Status(status.code(),
                  Printable(fmt::format("{} (paths are those of the coordinator's host, {})", status.message(), host.data())));
  };
  for (const std::string& argument : arguments) {
    const Result<DataArgument> parsed = ParseDataArgument(argument);
    if (!parsed.ok()) return parsed.status();
    if (parsed->RelativePath() != nullptr) return here(Status::InvalidArgument(argument + ": the path must be absolute"));
  }
  FoundData found = FindData(arguments, "");
  CheckFiles(found);
  for (const std::string& line : found.complaints) LogWarning(line);
  if (!found.errors.empty()) return here(found.errors.front());
  return found;
}

Result<std::shared_ptr<const OccupancyGrid>> Count(const CountFunction& count, const VoxelServer::Samples& samples,
                                                   const CountDataset& action) {
  if (samples.in_parts.source != nullptr) return Status::Unavailable("the voxels of a dataset that is read in parts are not counted");
  const RendererKind& renderer = *action.volume.renderer();
  const ClassificationTable drawn = renderer.DrawnTable(action.volume.transfer(), *action.summary);
  Result<OccupancyGrid> grid = renderer.Can(Ability::kCells) ? CountOccupiedByCells(*samples.cells, action.summary->description, drawn)
                                                             : count(samples.view(), drawn, action.summary.get());
  if (!grid.ok()) return grid.status();
  AddBricks(OtherBricks(*action.summary, action.volume), *action.summary, *grid);
  return std::make_shared<const OccupancyGrid>(*std::move(grid));
}

// Makes the event that ends an action: what names the action, then the result or the error.
template <class Event, class... Names>
auto EndOf(Names... names) {
  return [names...](auto result) { return Event{names..., std::move(result)}; };
}

}  // namespace

BackgroundActions::BackgroundActions(PlanFunction make_plan, CountFunction count_occupied, VoxelServer& voxels)
    : make_plan_(std::move(make_plan)),
      count_occupied_(std::move(count_occupied)),
      planner_(std::make_shared<Planner>()),
      voxels_(voxels) {}

void BackgroundActions::HandleEvents(const std::function<void(CoordinatorEvent)>& handle) {
  for (News& news : inbox_->TakeAll()) {
    if (news.samples.any()) voxels_.Publish(news.dataset, std::move(news.samples));
    if (news.upload != nullptr) {
      const auto open = uploads_.find(std::get<UploadBegun>(news.event).upload);
      if (open != uploads_.end()) open->second = std::move(news.upload);
    }
    if (const auto* planned = std::get_if<Planned>(&news.event)) plans_.erase(planned->plan);
    handle(std::move(news.event));
  }
}

BackgroundActions::AtOnce BackgroundActions::Post(auto&& tasks, const char* what, auto make, auto failed) {
  const Status begun = Guarded(what, [&] {
    tasks.Post([inbox = inbox_, barrier = std::string(what), make = std::move(make), failed] {
      Result<News> news = Guarded(barrier.c_str(), [&]() -> Result<News> { return make(); });
      inbox->Post(news.ok() ? *std::move(news) : News{failed(news.status())});
    });
  });
  if (begun.ok()) return std::nullopt;
  return failed(begun);
}

BackgroundActions::AtOnce BackgroundActions::PostResult(auto&& tasks, const char* what, auto find, auto end) {
  return Post(
      tasks, what, [find = std::move(find), end] { return News{end(find())}; }, end);
}

Result<BackgroundActions::News> BackgroundActions::Load(const LoadDataset& action, const TellRead& tell) {
  if (action.source.at_level != nullptr) return LoadLevel(action, *action.source.at_level, tell);
  Result<ReadableSource> read = ReadSource(action.source, action.most_bytes, tell);
  if (!read.ok()) return read.status();
  if (auto* const opened = std::get_if<OpenedSource>(&*read)) return Open(action, std::move(*opened), tell);
  return Hold(action, std::get<LoadedSource>(*read));
}

// A volume that was read as a whole.
Result<BackgroundActions::News> BackgroundActions::Hold(const LoadDataset& action, const LoadedSource& loaded) {
  const std::shared_ptr<const Volume>& volume = loaded.volume;
  VoxelServer::Samples samples;
  samples.cells = loaded.cells;
  if (volume->cells != nullptr) samples.cells = std::make_shared<const MeshCutter>(volume->cells);
  VolumeSummary found = loaded.Summary();
  if (samples.cells != nullptr) SummarizeCells(samples.cells->Ranges(found.description.geometry.size), *volume, found);
  if (action.source.statistics != nullptr || !loaded.other_times.empty()) samples.own = std::make_shared<const VolumeSummary>(found);
  found = OverTimes(std::move(found), loaded.other_times);
  if (action.source.statistics != nullptr) found = WithStatistics(std::move(found), *action.source.statistics);
  found.labels = loaded.labels;
  found.shape = loaded.shape;
  if (loaded.shape != nullptr && action.source.statistics != nullptr && action.source.statistics->shape != nullptr) {
    ShapeInfo info = *loaded.shape;
    info.least = action.source.statistics->shape->least;
    info.largest = action.source.statistics->shape->largest;
    found.shape = std::make_shared<const ShapeInfo>(info);
  }
  auto summary = std::make_shared<const VolumeSummary>(std::move(found));
  const bool held = action.source.held_bytes > 0;  // as a whole, in any case
  // The bytes of a shape are read where they are.
  if (!held && loaded.shape == nullptr && MostBricksAreEqual(*summary)) {
    samples.bricks = std::make_shared<const BrickedVoxels>(volume->block);
  } else {
    samples.volume = volume;
  }
  samples.exact = loaded.exact;
  samples.description = volume->description;
  const DatasetId id = IdOf(action.name, *volume, loaded.labels.get(), loaded.exact.get(), samples.cells.get());
  const std::uint64_t bytes = samples.bytes() - (held ? volume->block.bytes.size() : 0);
  return News{DatasetLoaded{action.name, action.load, id, std::move(summary), bytes, loaded.stamp, FieldsOf(action.source, loaded.file),
                            loaded.source},
              id, std::move(samples)};
}

// A plane through voxels that are loaded.
Result<BackgroundActions::News> BackgroundActions::LoadPlane(const LoadDataset& action, const VoxelServer::Samples& samples) {
  if (!samples.any()) return Status::Unavailable(Named(action.name) + ": its voxels were unloaded meanwhile");
  const VolumeDescription& description = action.source.plane->summary->description;
  const auto read = [&](const Box& box) -> Result<VoxelBlock> {
    VoxelBlock block = MakeVoxelBlock(box, description.type);
    if (const auto& from = samples.in_parts; from.source != nullptr) {
      if (Status status = from.source->ReadNow(from.level, box, block.bytes, from.stop); !status.ok()) return status;
    } else {
      samples.view().Read(box, 0, block.bytes);
    }
    return block;
  };
  const Result<Shape> shape = PlaneShape(action.source.plane->slab, description, read);
  if (!shape.ok()) return shape.status();
  Result<LoadedData> data = DataOfShape(*shape);
  if (!data.ok()) return data.status();
  return Hold(action, LoadedSource{.file = {}, .volume = std::move(data->volume), .stamp = nullptr, .shape = std::move(data->shape)});
}

// The levels of a source, or its only one.
Result<BackgroundActions::News> BackgroundActions::Open(const LoadDataset& action, OpenedSource opened, const TellRead& tell) {
  const SourceInfo& info = opened.source->info();
  const std::vector<SourceLevel>& levels = info.levels;
  (void)opened.source->TakeStoredBytes();  // the survey's, which belong to no frame
  const std::shared_ptr<const DatasetFields> fields = FieldsOf(action.source, info);
  const bool one_of_several = action.source.statistics != nullptr || (fields != nullptr && fields->times.count > 1);
  std::vector<DataSource> sources;
  auto described = std::make_shared<VolumeLevels>(VolumeLevels{.owned = !info.owned.empty(), .overview = opened.survey.summary});
  for (std::size_t level = 0; level < levels.size(); ++level) {
    described->levels.push_back(levels[level].description);
    if (levels.front().refined != nullptr) described->refined.push_back(levels[level].refined);
    SourceAtLevel at{.source = opened.source,
                     .surveyed = opened.survey.summary,
                     .stored = {opened.text, int(level), info.version, {{0, 0, 0}, levels[level].block}},
                     .stamp = opened.stamp,
                     .index = opened.index,
                     .times = one_of_several ? info.times.count : 1};
    if (int(level) == opened.survey.level && !opened.survey.sample) at.surveyed_level = int(level);
    sources.emplace_back().at_level = std::make_shared<const SourceAtLevel>(std::move(at));
  }
  if (sources.size() == 1) {
    Result<News> loaded = LoadLevel(action, *sources.front().at_level, tell);
    if (loaded.ok()) {
      auto& event = std::get<DatasetLoaded>(loaded->event);
      event.fields = fields;
      event.opened = opened.source;
    }
    return loaded;
  }
  return News{DatasetOpened{action.name, action.load, std::move(described), std::move(sources), opened.stamp, fields, opened.source}};
}

// Holds the voxels of the level if there is room for them. Those of an adaptive mesh stay where they are: most of a fine level would be
// interpolated. So do those that other processes hold.
Result<BackgroundActions::News> BackgroundActions::LoadLevel(const LoadDataset& action, const SourceAtLevel& at, const TellRead& tell) {
  const VolumeDescription& description = at.source->info().levels[std::size_t(at.stored.level)].description;
  const auto bytes = std::uint64_t(description.voxel_bytes());
  // A picture may be drawn from several levels, which must be held together, and a movie shows all times.
  std::uint64_t with_coarser = 0;
  for (const SourceLevel& level : std::span(at.source->info().levels).subspan(std::size_t(at.stored.level))) {
    with_coarser += std::uint64_t(level.description.voxel_bytes());
  }
  // Of a larger one behind an address each process reads what it needs, which may be little.
  const std::uint64_t most =
      !SchemeOf(at.stored.source).empty() ? std::min(action.most_bytes, std::uint64_t(kFarSurvey.exact)) : action.most_bytes;
  VoxelServer::Samples samples;
  VolumeSummary summary;
  const bool stays = at.source->info().levels.front().refined != nullptr || !at.source->info().owned.empty();
  if (!stays && with_coarser <= most / std::uint64_t(at.times) && CheckFitsMemory(std::int64_t(bytes), action.name).ok()) {
    ReadProgress progress(tell);
    const Result<LevelInMemory> level = at.source->ReadLevel(at.stored.level, &progress);
    // If its files have changed, the look that requests wait for sees that, and everything is opened anew.
    const Result<bool> changed = level.ok() || at.stamp == nullptr ? Result<bool>(false) : HaveChanged(*at.stamp);
    if (!level.ok() && (!changed.ok() || !*changed)) return level.status();
    if (level.ok()) {
      samples.volume = level->volume;
      samples.exact = level->exact;
      samples.read_from = at.source;
      samples.description = description;
    }
  }
  if (samples.volume != nullptr) {
    summary = at.surveyed_level ? *at.surveyed : SummaryOfBricks(*samples.volume, *at.surveyed);
  } else {
    samples.in_parts = {at.source, at.stored.level};
    summary = at.surveyed_level ? *at.surveyed : UnreadSummary(description, *at.surveyed);
    summary.stored = at.stored;
    if (at.index != nullptr) {
      const BrickRangeList& bricks = at.index->levels[std::size_t(at.stored.level)];
      summary.indexed = std::make_shared<const BrickRangeList>(DataRanges(bricks, description));
    }
  }
  // Of voxels that others hold, the text says which they are.
  const DatasetId id = IdOf(at.source->info().owned.empty() ? action.name : DatasetOfPart(action.name), description, at.stored);
  summary.owned = at.source->info().levels[std::size_t(at.stored.level)].owned;
  summary.on_demand = at.source->info().on_demand;
  if (const auto owners = OwnedField::Parse(at.source->info().owned); owners.ok()) {
    for (const OwnerPlace& owner : owners->owners) summary.owner_hosts.push_back(owner.scope);
    for (const std::string& note : at.source->info().notes) summary.missing = note;
  }
  const std::uint64_t held = samples.bytes();
  return News{DatasetLoaded{action.name, action.load, id, std::make_shared<const VolumeSummary>(std::move(summary)), held, at.stamp}, id,
              std::move(samples)};
}

BackgroundActions::AtOnce BackgroundActions::Perform(LoadDataset& action) {
  const std::string barrier = Named(action.name) + " could not be loaded";
  if (const PlaneOfVoxels* const plane = action.source.plane.get()) {
    const std::optional<StoredAt>& stored = plane->summary->stored;
    return Post(
        answers_.Of(OwnerOf(stored ? ServerOf(stored->source) : "")), barrier.c_str(),
        [action, samples = Stoppable(voxels_.Find(plane->voxels), action.stop)] { return LoadPlane(action, samples); },
        EndOf<DatasetFailed>(action.name, action.load));
  }
  const auto load = [action, inbox = inbox_] {
    const auto tell = [&](const ReadShare& read) { inbox->Post(News{DatasetReading{action.name, action.load, read}}); };
    const StoresStop stop(action.stop);
    Result<News> news = Load(action, tell);
    if (news.ok() || action.source.sent == nullptr) return news;
    return Result<News>(action.source.sent->ForClient(news.status()));
  };
  const auto failed = EndOf<DatasetFailed>(action.name, action.load);
  const DataSource& source = action.source;
  // It may wait for owners of voxels.
  return Post(
      loads_.Of(OwnerOf(source.open ? action.name : ServerOf(source.at_level != nullptr ? source.at_level->stored.source : source.path))),
      barrier.c_str(), load, failed);
}

BackgroundActions::AtOnce BackgroundActions::Perform(UnloadDataset& action) {
  voxels_.Withdraw(action.dataset);
  return std::nullopt;
}

BackgroundActions::AtOnce BackgroundActions::Perform(CheckDatasetFiles& action) {
  return PostResult(
      checks_.Of(OwnerOf(action.stamp->ask ? action.name : "")), "checking the files of a dataset",
      [stamp = action.stamp] { return HaveChanged(*stamp); }, EndOf<DatasetSeen>(action.name, action.load));
}

BackgroundActions::AtOnce BackgroundActions::Perform(CheckWatchedFolders& action) {
  return Post(
      checks_.Of(0), "searching the watched folders", [action, memory = folders_] { return News{Check(action, *memory)}; },
      [](const Status& why) {
        LogWarning(why.message());
        return FoldersSeen{};
      });
}

BackgroundActions::AtOnce BackgroundActions::Perform(FindDatasets& action) {
  const auto far = std::ranges::find_if(action.arguments, [](const std::string& each) { return each.find("://") != std::string::npos; });
  return PostResult(
      checks_.Of(OwnerOf(far == action.arguments.end() ? "" : *far)), "a file check", [action] { return Find(action.arguments); },
      EndOf<DatasetsFound>(action.order));
}

BackgroundActions::AtOnce BackgroundActions::Perform(AnswerQuestion& action) {
  std::string server;  // any that it may wait for
  const auto find = [&](DatasetId dataset, const VolumeSummary* summary) {
    if (server.empty() && summary != nullptr && summary->stored) server = ServerOf(summary->stored->source);
    return Stoppable(voxels_.Find(dataset), action.stop);
  };
  const VoxelServer::Samples samples = find(action.dataset, action.summary.get());
  const VoxelServer::Samples labels = find(action.labels.dataset, action.labels.summary.get());
  std::vector<VoxelServer::Samples> others, shapes;
  for (const FieldVolume& field : action.fields.others) {
    others.push_back(find(field.levels.front().dataset, field.levels.front().summary.get()));
  }
  for (const auto* const of : {&action.fields.shapes, &action.fields.planes}) {
    for (const CoarserVolume& shape : *of) shapes.push_back(find(shape.dataset, shape.summary.get()));
  }
  return PostResult(
      answers_.Of(OwnerOf(server)), "an answer to a question",
      [action, samples, others = std::move(others), labels, shapes = std::move(shapes)] {
        return AnswerTo(action, samples, others, labels, shapes);
      },
      EndOf<QuestionAnswered>(action.id));
}

BackgroundActions::AtOnce BackgroundActions::Perform(BeginUpload& action) {
  const UploadId upload = action.upload;
  uploads_[upload] = nullptr;
  return Post(
      loads_.Of(0), "taking memory for a volume",
      [upload, order = std::move(action.order)] {
        const Result<std::shared_ptr<UploadBuffer>> made = UploadBuffer::Make(order);
        return News{.event = UploadBegun{upload, made.status()}, .upload = made.ok() ? *made : nullptr};
      },
      EndOf<UploadBegun>(upload));
}

BackgroundActions::AtOnce BackgroundActions::Perform(StoreUpload& action) {
  uploads_.at(action.upload)->Store(action.begin, action.bytes.span());
  return std::nullopt;
}

BackgroundActions::AtOnce BackgroundActions::Perform(FinishUpload& action) {
  const auto whole = uploads_.extract(action.upload);
  return PostResult(
      loads_.Of(0), "finishing a volume", [buffer = whole.mapped()] { return buffer->Finish(); }, EndOf<UploadFinished>(action.upload));
}

BackgroundActions::AtOnce BackgroundActions::Perform(DropUpload& action) {
  uploads_.erase(action.upload);
  return std::nullopt;
}

BackgroundActions::AtOnce BackgroundActions::Perform(CountDataset& action) {
  const auto find = [count = count_occupied_, samples = voxels_.Find(action.volume.dataset()), action] {
    return Count(count, samples, action);
  };
  return PostResult(counts_.Of(action.volume.dataset()), "counting of occupied voxels", find, EndOf<OccupiedCounted>(action.count));
}

BackgroundActions::AtOnce BackgroundActions::Perform(PlanRequest& action) {
  const PlanId plan = action.plan;
  if (auto planned = planner_->PlanAtHand(action)) return Planned{plan, *std::move(planned)};
  const Status begun = Guarded("planning", [&] {
    action.stop = plans_[plan].get_token();
    planning_.Post(action.client, [inbox = inbox_, planner = planner_, make = make_plan_, request = std::move(action)] {
      if (request.stop.stop_requested()) return;
      auto made = Guarded("planning", [&] { return make(*planner, request); });
      if (!request.stop.stop_requested()) inbox->Post({Planned{request.plan, std::move(made)}});
    });
  });
  if (begun.ok()) return std::nullopt;
  plans_.erase(plan);
  return Planned{plan, begun};
}

BackgroundActions::AtOnce BackgroundActions::Perform(DropPlan& action) {
  if (auto plan = plans_.extract(action.plan)) plan.mapped().request_stop();
  return std::nullopt;
}

BackgroundActions::AtOnce BackgroundActions::Perform(FrameMeasured& action) {
  const PeerToken client = action.frame->asked.client;
  const auto learn = [planner = planner_, measured = std::move(action)] {
    const Status learnt = Guarded("learning from a frame", [&] { planner->Learn(measured); });
    if (!learnt.ok()) LogWarning(learnt.message());
  };
  const Status begun = Guarded("learning from a frame", [&] { planning_.Post(client, learn); });
  if (!begun.ok()) LogWarning(begun.message());
  return std::nullopt;
}

}  // namespace slabstream
