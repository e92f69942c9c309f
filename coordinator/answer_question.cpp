#include "coordinator/answer_question.h"

#include <optional>
#include <utility>

#include "common/planning/frame_plan.h"
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

Result<QuestionReply> Answer(const SummaryQuery& query, const Dataset& dataset) {
  const VolumeSummary& summary = *dataset.summary;
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

}  // namespace

Result<QuestionReply> AnswerTo(const AnswerQuestion& asked, const VoxelServer::Samples& samples) {
  if (!samples.any()) return Status::Unavailable("dataset \"" + DatasetOf(asked.question) + "\" was unloaded meanwhile");
  const ProbeVolume volume{.voxels = samples.view(), .labels = samples.labels.get(), .overlay = samples.overlay.get()};
  const Dataset dataset{volume, asked.summary, asked.dataset};
  return std::visit([&](const auto& query) { return Answer(query, dataset); }, asked.question);
}

}  // namespace slabstream
