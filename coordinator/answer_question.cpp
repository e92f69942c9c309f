#include "coordinator/answer_question.h"

#include <fmt/format.h>

#include <optional>
#include <utility>

#include "common/planning/frame_plan.h"
#include "common/volume/box_assembly.h"
#include "common/volume/memory_budget.h"
#include "coordinator/probe/box_statistics.h"
#include "coordinator/probe/percentiles.h"
#include "coordinator/probe/pick.h"

namespace slabstream {
namespace {

struct Dataset {
  const ProbeVolume& volume;
  std::shared_ptr<const VolumeSummary> summary;
  DatasetId id;
};

Result<QuestionReply> AnswerSummary(const SummaryQuery& query, const VolumeSummary& summary) {
  Result<TransferFunction> transfer = ResolveTransfer(query.transfer, summary);
  if (!transfer.ok()) return transfer.status();
  SummaryReply reply{.nonce = query.nonce,
                     .description = summary.description,
                     .range = summary.range,
                     .histogram = {summary.histogram.begin(), summary.histogram.end()},
                     .non_finite = std::uint64_t(summary.non_finite),
                     .percentiles = {},
                     .transfer = *std::move(transfer),
                     .labels = {}};
  if (summary.label_table != nullptr) reply.labels = summary.label_table->labels;
  for (const double percent : kPercents) reply.percentiles.push_back({percent, PercentileOf(summary, percent)});
  return QuestionReply(std::move(reply));
}

Result<QuestionReply> Answer(const SummaryQuery& query, const Dataset& dataset) { return AnswerSummary(query, *dataset.summary); }

Result<QuestionReply> Answer(const SampleQuery& query, const Dataset& dataset) {
  SampleReply reply{.nonce = query.nonce};
  for (const Vec3& point : query.points) reply.samples.push_back(SampleAt(dataset.volume, *dataset.summary, point));
  return QuestionReply(std::move(reply));
}

Result<QuestionReply> Answer(const StatisticsQuery& query, const Dataset& dataset) {
  Result<BoxStatistics> statistics = StatisticsIn(dataset.volume.voxels, dataset.summary->description, query.box);
  if (!statistics.ok()) return statistics.status();
  return QuestionReply(StatisticsReply{.nonce = query.nonce, .statistics = *statistics});
}

Result<QuestionReply> Answer(const PickQuery& query, const Dataset& dataset) {
  const Result<ResolvedRequest> resolved = ResolveRequest(query.frame, dataset.id, dataset.summary);
  if (!resolved.ok()) return resolved.status();
  const Result<FrameSetup> setup = MakeFrameSetup(*resolved);
  if (!setup.ok()) return setup.status();
  PickReply reply{.nonce = query.nonce};
  if (const std::optional<Picked> picked = Pick(*setup, dataset.volume, query.x, query.y)) {
    reply.sample =
        SampleAtVoxel(dataset.volume, *dataset.summary, dataset.summary->description.geometry.ToWorld(picked->at), picked->voxel);
    reply.depth = picked->depth;
  }
  return QuestionReply(std::move(reply));
}

// ---- voxels that nobody holds are read for the answer

Result<VoxelBlock> ReadBox(const VoxelServer::Samples::InParts& from, const Box& box) {
  const ScalarType type = from.description().type;
  const std::int64_t bytes = box.voxel_count() * std::int64_t(BytesPerSample(type));
  if (Status fits = CheckFitsMemory(bytes, "the box"); !fits.ok()) return fits;
  VoxelBlock block = MakeVoxelBlock(box, type);
  if (Status read = from.source->ReadNow(from.level, box, block.bytes); !read.ok()) return read;
  return block;
}

Result<QuestionReply> ReadAnswer(const SampleQuery& query, const AnswerQuestion& asked, const VoxelServer::Samples::InParts& from) {
  const VolumeGeometry& geometry = asked.summary->description.geometry;
  SampleReply reply{.nonce = query.nonce};
  for (const Vec3& point : query.points) {
    // The voxel, and those that are interpolated.
    const Index3 voxel = Max(Min(VoxelAt(DataPoint(geometry, point)), geometry.size - Uniform(1)), Index3{});
    const Result<VoxelBlock> block = ReadBox(from, Grown({voxel, voxel + Uniform(1)}, 1, geometry.bounds()));
    if (!block.ok()) return block.status();
    reply.samples.push_back(SampleAt(ProbeVolume{.voxels = *block}, *asked.summary, point));
  }
  return QuestionReply(std::move(reply));
}

Result<QuestionReply> ReadAnswer(const StatisticsQuery& query, const AnswerQuestion& asked, const VoxelServer::Samples::InParts& from) {
  const VolumeDescription& description = asked.summary->description;
  const Result<ClipRegion> region = MakeClipRegion({.box = query.box}, description.geometry);
  if (!region.ok()) return region.status();
  constexpr std::int32_t kPiece = 64;
  Box needed;
  for (const Box& piece : CutAtBlocks(description.geometry.bounds(), Uniform(kPiece))) {
    if (region->MayKeep(piece)) needed = Hull(needed, piece);
  }
  if (needed.empty()) return QuestionReply(StatisticsReply{.nonce = query.nonce});
  const Result<VoxelBlock> block = ReadBox(from, needed);
  if (!block.ok()) return block.status();
  const Dataset dataset{ProbeVolume{.voxels = *block}, asked.summary, asked.dataset};
  return Answer(query, dataset);
}

Result<QuestionReply> ReadAnswer(const PickQuery& query, const AnswerQuestion&, const VoxelServer::Samples::InParts& from) {
  return Status::InvalidArgument(
      fmt::format("what a pixel shows is not found in level {} of dataset \"{}\", which is larger than the coordinator's memory; a coarser "
                  "level may fit",
                  from.level, query.frame.dataset));
}

Result<QuestionReply> ReadAnswer(const SummaryQuery& query, const AnswerQuestion& asked, const VoxelServer::Samples::InParts&) {
  return AnswerSummary(query, *asked.summary);
}

}  // namespace

Result<QuestionReply> AnswerTo(const AnswerQuestion& asked, const VoxelServer::Samples& samples) {
  if (asked.dataset == 0) return AnswerSummary(std::get<SummaryQuery>(asked.question), *asked.summary);
  if (!samples.any()) return Status::Unavailable("dataset \"" + DatasetOf(asked.question) + "\" was unloaded meanwhile");
  if (samples.in_parts.source != nullptr) {
    return std::visit([&](const auto& query) { return ReadAnswer(query, asked, samples.in_parts); }, asked.question);
  }
  const ProbeVolume volume{.voxels = samples.view(), .labels = samples.labels.get(), .overlay = samples.overlay.get()};
  const Dataset dataset{volume, asked.summary, asked.dataset};
  return std::visit([&](const auto& query) { return Answer(query, dataset); }, asked.question);
}

}  // namespace slabstream
