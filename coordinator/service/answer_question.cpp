#include "coordinator/service/answer_question.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "common/planning/frame_plan.h"
#include "common/planning/levels.h"
#include "common/text/url.h"
#include "common/view/camera_path.h"
#include "common/view/default_view.h"
#include "common/volume/affine_map.h"
#include "common/volume/memory_budget.h"
#include "coordinator/probe/box_statistics.h"
#include "coordinator/probe/joint_histogram.h"
#include "coordinator/probe/percentiles.h"
#include "coordinator/probe/pick.h"
#include "data/survey/survey.h"

namespace slabstream {
namespace {

Status UnloadedMeanwhile(const std::string& dataset) { return Status::Unavailable("dataset \"" + dataset + "\" was unloaded meanwhile"); }

// What lies beside the voxels of the volume, as far as the question needs it.
struct Beside {
  ReadLabels labels = nullptr;                        // null: there are none
  std::span<const VoxelServer::Samples> shapes = {};  // of FrameSetup::shapes
};

struct Dataset {
  const ProbeVolume& volume;
  std::shared_ptr<const VolumeSummary> summary;
  DatasetId id;
  std::optional<WholeNumbers> exact = {};  // where stored samples round them
  const AnswerQuestion& asked;
  const Beside& beside;
};

WholeNumbers WholeNumbersOf(const ExactSamples& exact) {
  WholeNumbers found;
  found.mapping = exact.of.mapping;
  VisitSampleType(exact.of.type, [&]<class T>(const T*) {
    const std::span<const T> samples(reinterpret_cast<const T*>(exact.bytes.data()), exact.bytes.size() / sizeof(T));
    if constexpr (requires { found.samples = samples; }) found.samples = samples;
  });
  return found;
}

// What is known of the labels; null: nothing.
const LabelTable* TableOf(const AnswerQuestion& asked) {
  return asked.labels.summary == nullptr ? nullptr : asked.labels.summary->labels.get();
}

// What the picture is shown with.
Result<TransferFunction> TransferOf(const SummaryQuery& query, const VolumeSummary& summary, const ShownFields& fields) {
  FrameRequest picture = PictureOf(query);
  picture.transfer = query.transfer;
  picture.fields = query.looks;
  if (query.flat) picture.clipping.slab.emplace();
  const Result<bool> channel = ShowsAsChannel(picture, fields);
  if (!channel.ok()) return channel.status();
  if (!*channel) return ResolveTransfer(query.transfer, summary);
  Result<FieldLook> look = LookOf(picture, *fields.dataset, fields.volume, summary, query.flat);
  if (!look.ok()) return look.status();
  return std::move(look->transfer);
}

// `summary`: what is told. Pictures are shown by that of all times.
Result<QuestionReply> AnswerSummary(const SummaryQuery& query, const VolumeSummary& summary, const AnswerQuestion& asked) {
  Result<TransferFunction> transfer = TransferOf(query, *asked.summary, asked.fields);
  if (!transfer.ok()) return transfer.status();
  SummaryReply reply{.nonce = query.nonce,
                     .description = summary.description,
                     .range = summary.range,
                     .histogram = {summary.histogram.begin(), summary.histogram.end()},
                     .non_finite = std::uint64_t(summary.non_finite),
                     .percentiles = {},
                     .transfer = *std::move(transfer),
                     .labels = {}};
  if (const LabelTable* const table = TableOf(asked)) {
    reply.labels = table->labels;
    reply.all_labels = table->complete;
  }
  for (const double percent : kPercents) reply.percentiles.push_back({percent, PercentileOf(summary, percent)});
  return QuestionReply(std::move(reply));
}

// Of the time that the question names alone.
Result<QuestionReply> AnswerAtTime(const SummaryQuery& query, const AnswerQuestion& asked, const VoxelServer::Samples& samples) {
  VolumeSummary summary = *asked.summary;
  std::shared_ptr<const VolumeSummary> own = samples.own;
  if (const auto& source = samples.in_parts.source != nullptr ? samples.in_parts.source : samples.read_from; source != nullptr) {
    const bool far = summary.stored && !SchemeOf(summary.stored->source).empty();
    const Result<Survey> survey = SurveySource(*source, SurveyBytesOf(source->info(), far));
    if (!survey.ok()) return survey.status();
    own = survey->summary;
  }
  if (own != nullptr) {
    summary = WithStatistics(std::move(summary), *own);
    summary.non_finite = own->non_finite;
  }
  return AnswerSummary(query, summary, asked);
}

Result<QuestionReply> Answer(const SummaryQuery& query, const Dataset& dataset) {
  return AnswerSummary(query, *dataset.summary, dataset.asked);
}

Result<QuestionReply> Answer(const SampleQuery& query, const Dataset& dataset) {
  SampleReply reply{.nonce = query.nonce};
  for (const Vec3& point : query.points) reply.samples.push_back(SampleAt(dataset.volume, *dataset.summary, point));
  return QuestionReply(std::move(reply));
}

Status NoLabels(const StatisticsQuery& query) {
  return Status::InvalidArgument(fmt::format(
      "dataset \"{}\" has no labels to measure: --labels FILE gives a file some, and --data NAME=FILE,labels=FILE a dataset of a "
      "service",
      query.dataset));
}

Result<QuestionReply> Answer(const StatisticsQuery& query, const Dataset& dataset) {
  const MeasuredVolume measured{*dataset.volume.voxels.held(), dataset.summary->description, dataset.exact};
  const Result<BoxStatistics> statistics = StatisticsIn(measured, query.box);
  if (!statistics.ok()) return statistics.status();
  StatisticsReply reply{.nonce = query.nonce, .statistics = *statistics, .description = dataset.summary->description};
  if (!query.labels) return QuestionReply(std::move(reply));
  const LabelTable* const table = TableOf(dataset.asked);
  if (table == nullptr || dataset.beside.labels == nullptr) return NoLabels(query);
  Result<std::map<std::uint64_t, BoxStatistics>> of_labels = StatisticsByLabel(measured, query.box, dataset.beside.labels);
  if (!of_labels.ok()) return of_labels.status();
  if (table->complete) {
    for (const Label& label : table->labels) of_labels->try_emplace(label.value);
  }
  for (const auto& [value, of_label] : *of_labels) {
    const auto known = std::ranges::lower_bound(table->labels, value, {}, &Label::value);
    const bool is_known = known != table->labels.end() && known->value == value;
    reply.labels.push_back({is_known ? *known : Label{value, StandardColor(value)}, of_label});
  }
  return QuestionReply(std::move(reply));
}

Result<QuestionReply> AnswerJointHistogram(const JointHistogramQuery& query, const VolumeSummary& summary, const ReadJointBox& read) {
  Result<JointHistogram> histogram = CountJointly(summary.description, summary.range, read);
  if (!histogram.ok()) return histogram.status();
  return QuestionReply(JointHistogramReply{.nonce = query.nonce, .range = summary.range, .histogram = *std::move(histogram)});
}

Result<QuestionReply> Answer(const JointHistogramQuery& query, const Dataset& dataset) {
  const VoxelBricks& voxels = *dataset.volume.voxels.held();
  return AnswerJointHistogram(query, *dataset.summary, [&](const Box& box) {
    VoxelBlock block = MakeVoxelBlock(box, voxels.type());
    voxels.Read(box, 0, block.bytes);
    return Result<VoxelBlock>(std::move(block));
  });
}

// Shapes of a picture, then its planes.
Result<std::vector<ShapeView>> ViewShapes(std::span<const VoxelServer::Samples> shapes, const FrameRequest& frame) {
  std::vector<ShapeView> views;
  for (std::size_t i = 0; i < shapes.size(); ++i) {
    if (shapes[i].volume == nullptr) return UnloadedMeanwhile(i < frame.shapes.size() ? frame.shapes[i].shape : frame.dataset);
    const Result<ShapeView> view = ViewShape(shapes[i].volume->block.bytes);
    if (!view.ok()) return view.status();
    views.push_back(*view);
  }
  return views;
}

Result<QuestionReply> Answer(const PickQuery& query, const Dataset& dataset) {
  const Result<ResolvedRequest> resolved = ResolveRequest(query.frame, dataset.id, dataset.summary, dataset.asked.fields);
  if (!resolved.ok()) return resolved.status();
  const Result<FrameSetup> setup = MakeFrameSetup(*resolved);
  if (!setup.ok()) return setup.status();
  const Result<std::vector<ShapeView>> shapes = ViewShapes(dataset.beside.shapes, query.frame);
  if (!shapes.ok()) return shapes.status();
  PickReply reply{.nonce = query.nonce};
  if (const std::optional<Picked> picked = Pick(*setup, dataset.volume, query.x, query.y, *shapes)) {
    reply.sample =
        SampleAtVoxel(dataset.volume, *dataset.summary, dataset.summary->description.geometry.ToWorld(picked->at), picked->voxel);
    reply.depth = picked->depth * setup->unit;
    reply.shape = picked->shape;
    reply.value = picked->value;
  }
  return QuestionReply(std::move(reply));
}

Result<QuestionReply> AnswerView(const ViewQuery& query, const VolumeGeometry& finest, const std::shared_ptr<const VolumeSummary>& overview,
                                 const ShownFields& fields) {
  const Result<ChosenView> chosen = ChooseView(query.frame, finest, overview, query.framed, fields);
  if (!chosen.ok()) return chosen.status();
  if (Status status = CheckView(chosen->view, finest); !status.ok()) return status;
  ViewReply reply{.nonce = query.nonce, .view = chosen->view, .framed = chosen->framed};
  if (query.path.empty()) return QuestionReply(std::move(reply));
  std::vector<PathCamera> cameras = query.path;
  for (PathCamera& camera : cameras) camera.view = WithDefaults(camera.view, finest.orientation.world);
  const Result<CameraPath> path = CameraPath::Make(cameras);
  if (!path.ok()) return path.status();
  for (const double seconds : query.at) reply.path.push_back(path->At(seconds));
  return QuestionReply(std::move(reply));
}
Result<QuestionReply> Answer(const ViewQuery& query, const Dataset& dataset) {
  return AnswerView(query, dataset.summary->description.geometry, dataset.summary, dataset.asked.fields);
}

// ---- voxels that nobody holds are read for the answer

Result<VoxelBlock> ReadBox(const VoxelServer::Samples::InParts& from, const Box& box) {
  const ScalarType type = from.description().type;
  const std::int64_t bytes = box.voxel_count() * std::int64_t(BytesPerSample(type));
  if (Status fits = CheckFitsMemory(bytes, "the box"); !fits.ok()) return fits;
  VoxelBlock block = MakeVoxelBlock(box, type);
  if (Status read = from.source->ReadNow(from.level, box, block.bytes, from.stop); !read.ok()) return read;
  return block;
}

// Reads pieces of about a block of the source as they are asked for, and keeps the last few.
class ReadVoxels {
 public:
  explicit ReadVoxels(const VoxelServer::Samples::InParts& from)
      : from_(from), piece_(Max(Uniform(16), Min(Uniform(64), from.source->info().levels[std::size_t(from.level)].block))) {}

  const Status& status() const { return status_; }  // the first failure; from then on nothing is read
  ProbedVoxels voxels() {
    return {from_.description().geometry.size, [this](const Index3& voxel) { return At(voxel); }};
  }
  ExactValue ExactAt(const Index3& voxel) {
    const ExactType& of = from_.source->info().exact;
    std::array<std::byte, sizeof(std::uint64_t)> sample{};
    const Box box = {voxel, voxel + Uniform(1)};
    if (status_.ok()) status_ = from_.source->ReadNow(from_.level, box, BoxRoom::Dense(box, sample.data(), true), from_.stop);
    return ExactValueOf(of, sample.data());
  }

  // 0 once a read has failed.
  std::uint64_t LabelAt(const Index3& voxel) { return SampleAt<std::uint64_t>(voxel, 0); }

 private:
  double At(const Index3& voxel) { return SampleAt<double>(voxel, std::numeric_limits<double>::quiet_NaN()); }

  template <class Value>
  Value SampleAt(const Index3& voxel, Value if_failed) {
    constexpr std::size_t kMostKept = 16;
    if (!status_.ok()) return if_failed;
    const Index3 begin = voxel / piece_ * piece_;
    auto piece = pieces_.find(Tuple(begin));
    if (piece == pieces_.end()) {
      if (pieces_.size() == kMostKept) pieces_.clear();
      Result<VoxelBlock> read = ReadBox(from_, Intersection({begin, begin + piece_}, from_.description().geometry.bounds()));
      if (!read.ok()) {
        status_ = read.status();
        return if_failed;
      }
      piece = pieces_.emplace(Tuple(begin), *std::move(read)).first;
    }
    const VoxelBlock& block = piece->second;
    return VisitStoredType(block.type, [&]<class T>(const T*) { return Value(block.samples<T>()[block.Offset(voxel)]); });
  }
  static std::array<std::int32_t, 3> Tuple(const Index3& index) { return {index.x, index.y, index.z}; }

  const VoxelServer::Samples::InParts& from_;
  const Index3 piece_;
  std::map<std::array<std::int32_t, 3>, VoxelBlock> pieces_;  // by their begins
  Status status_;
};

// Of a volume without labels: none.
std::function<std::uint64_t(const Index3&)> OneLabel(const ReadLabels& labels) {
  if (!labels) return nullptr;
  return [&labels](const Index3& voxel) {
    std::uint64_t label = 0;
    labels(voxel, {&label, 1});
    return label;
  };
}

// A question about a few points.
template <class Query>
Result<QuestionReply> ReadAnswer(const Query& query, const AnswerQuestion& asked, const VoxelServer::Samples::InParts& from,
                                 const Beside& beside) {
  ReadVoxels read(from);
  ProbeVolume volume{.voxels = read.voxels(), .label = OneLabel(beside.labels)};
  if (MayBeRounded(from.source->info().exact.type)) volume.exact = [&](const Index3& voxel) { return read.ExactAt(voxel); };
  Result<QuestionReply> answer = Answer(query, Dataset{volume, asked.summary, asked.dataset, {}, asked, beside});
  return read.status().ok() ? std::move(answer) : Result<QuestionReply>(read.status());
}

// Adds the pieces of a box that the region may keep, halving it again and again: a volume may say that it has any number of voxels.
void AddKept(const ClipRegion& region, const Box& box, Box& kept) {
  constexpr std::int32_t kPiece = 64;
  if (kept.Contains(box) || !region.MayKeep(box)) return;
  const Index3 size = box.size();
  const Axis longest = *std::ranges::max_element(kAxes, {}, [&](Axis axis) { return size[axis]; });
  if (size[longest] <= kPiece) {
    kept = Hull(kept, box);
    return;
  }
  Box low = box, high = box;
  low.end[longest] = high.begin[longest] = (box.begin[longest] + size[longest] / 2 + kPiece - 1) / kPiece * kPiece;
  AddKept(region, low, kept);
  AddKept(region, high, kept);
}

Result<QuestionReply> ReadAnswer(const StatisticsQuery& query, const AnswerQuestion& asked, const VoxelServer::Samples::InParts& from,
                                 const Beside& beside) {
  const VolumeDescription& description = asked.summary->description;
  const Result<ClipRegion> region = MakeClipRegion({.box = query.box}, description.geometry);
  if (!region.ok()) return region.status();
  Box needed;
  AddKept(*region, description.geometry.bounds(), needed);
  if (needed.empty()) return QuestionReply(StatisticsReply{.nonce = query.nonce, .statistics = {}, .description = description});
  const Result<VoxelBlock> block = ReadBox(from, needed);
  if (!block.ok()) return block.status();
  const ProbeVolume volume{.voxels = VoxelBricks(*block)};
  return Answer(query, Dataset{volume, asked.summary, asked.dataset, {}, asked, beside});
}

Result<QuestionReply> ReadAnswer(const JointHistogramQuery& query, const AnswerQuestion& asked, const VoxelServer::Samples::InParts& from,
                                 const Beside& /*beside*/) {
  return AnswerJointHistogram(query, *asked.summary, [&](const Box& box) { return ReadBox(from, box); });
}

Result<QuestionReply> ReadAnswer(const SummaryQuery& query, const AnswerQuestion& asked, const VoxelServer::Samples::InParts& /*from*/,
                                 const Beside& /*beside*/) {
  return AnswerSummary(query, *asked.summary, asked);
}

Result<QuestionReply> ReadAnswer(const ViewQuery& query, const AnswerQuestion& asked, const VoxelServer::Samples::InParts& /*from*/,
                                 const Beside& /*beside*/) {
  return AnswerView(query, asked.summary->description.geometry, asked.summary, asked.fields);
}

// What the fields hold at the voxels that samples tell of.
Status AddFields(const AnswerQuestion& asked, const std::vector<VoxelServer::Samples>& others, std::span<VolumeSample> samples) {
  const ShownFields& fields = asked.fields;
  const VolumeDescription& volume = asked.summary->description;
  const bool volume_shows = fields.volume_shows && !IsOfLabels(volume.type);
  for (VolumeSample& sample : samples) {
    if (sample.inside && volume_shows) sample.fields.push_back({TitleOf(fields, fields.volume), sample.value});
  }
  for (std::size_t i = 0; i < fields.others.size(); ++i) {
    const FieldVolume& field = fields.others[i];
    if (field.labels || samples.empty()) continue;
    if (!others[i].any()) return UnloadedMeanwhile(DatasetOf(asked.question));
    const VolumeDescription& of = field.levels.front().summary->description;
    std::optional<ReadVoxels> read;
    if (others[i].in_parts.source != nullptr) read.emplace(others[i].in_parts);
    const ProbeVolume voxels{.voxels = read ? read->voxels() : ProbedVoxels(others[i].view())};
    for (VolumeSample& sample : samples) {
      if (!sample.inside) continue;
      FieldSample& found = sample.fields.emplace_back(FieldSample{TitleOf(fields, field.number)});
      const Vec3 voxel = ToVec3(sample.voxel);
      const Vec3 p =
          of.geometry == volume.geometry ? voxel : VoxelPoint(of.geometry, volume.geometry.ToWorld(volume.geometry.stretch.ToData(voxel)));
      if (!of.geometry.bounds().Contains(VoxelAt(p))) continue;
      const double value = of.mapping.FromStored(voxels.Interpolated(p));
      if (std::isfinite(value)) found.value = value;
    }
    if (read && !read->status().ok()) return read->status();
  }
  return Status::Ok();
}

// The labels of the volume's voxels. `status`: the first failure of a read. It must outlive this, and so must `of`.
ReadLabels LabelsBesideVolume(const AnswerQuestion& asked, const VoxelServer::Samples& of, Status& status) {
  const VolumeGeometry &grid = asked.summary->description.geometry, &labels = asked.labels.summary->description.geometry;
  const AffineMap map = AffineMapBetween(grid, labels);
  const auto read = of.in_parts.source != nullptr ? std::make_shared<ReadVoxels>(of.in_parts) : nullptr;
  const bool same_voxels = map.is_identity() && grid.size == labels.size && !grid.rectilinear();
  return [map, stretch = grid.stretch, read, same_voxels, &of, &status, bounds = labels.bounds()](const Index3& first,
                                                                                                  std::span<std::uint64_t> row) {
    if (read == nullptr && same_voxels) {
      const VoxelBricks held = of.view();
      return VisitLabelType(held.type(), [&]<class T>(const T*) {
        const BrickView<T> brick = held.View<T>(first / kBrick);
        std::ranges::copy_n(brick.Row(first.y, first.z) + (first.x - brick.begin.x), std::ptrdiff_t(row.size()), row.begin());
      });
    }
    for (std::size_t i = 0; i < row.size(); ++i) {
      const Index3 voxel = VoxelAt(map.To(stretch.ToData(ToVec3(first + Index3{std::int32_t(i), 0, 0}))));
      row[i] = !bounds.Contains(voxel) ? 0 : read != nullptr ? read->LabelAt(voxel) : SampleOf<std::uint64_t>(of.view(), voxel);
    }
    if (read != nullptr && status.ok()) status = read->status();
  };
}

Result<QuestionReply> AnswerOf(const AnswerQuestion& asked, const VoxelServer::Samples& samples, const Beside& beside) {
  if (asked.levels != nullptr) {
    return AnswerView(std::get<ViewQuery>(asked.question), asked.levels->levels.front().geometry, asked.summary, asked.fields);
  }
  if (asked.dataset == 0) return AnswerSummary(std::get<SummaryQuery>(asked.question), *asked.summary, asked);
  const bool of_values =
      std::holds_alternative<StatisticsQuery>(asked.question) || std::holds_alternative<JointHistogramQuery>(asked.question);
  if (of_values && IsOfLabels(asked.summary->description.type)) {
    return Status::InvalidArgument(
        fmt::format("dataset \"{}\" has labels and no values to measure: measure a volume with these labels, which may be the same file",
                    DatasetOf(asked.question)));
  }
  if (!samples.any()) return UnloadedMeanwhile(DatasetOf(asked.question));
  if (asked.at_time) return AnswerAtTime(std::get<SummaryQuery>(asked.question), asked, samples);
  if (samples.in_parts.source != nullptr) {
    return std::visit([&](const auto& query) { return ReadAnswer(query, asked, samples.in_parts, beside); }, asked.question);
  }
  ProbeVolume volume{.voxels = samples.view(), .label = OneLabel(beside.labels)};
  if (const ExactSamples* const exact = samples.exact.get()) {
    volume.exact = [exact, size = samples.box().size()](const Index3& voxel) {
      return ExactValueOf(exact->of, exact->bytes.data() + NumberIn(size, voxel) * BytesPerSample(exact->of.type));
    };
  }
  Dataset dataset{volume, asked.summary, asked.dataset, {}, asked, beside};
  if (samples.exact != nullptr) dataset.exact = WholeNumbersOf(*samples.exact);
  return std::visit([&](const auto& query) { return Answer(query, dataset); }, asked.question);
}

// The labels in a sample get their names.
void NameLabels(const AnswerQuestion& asked, std::span<VolumeSample> samples) {
  const std::vector<Label>& labels = TableOf(asked)->labels;
  for (VolumeSample& sample : samples) {
    if (!sample.label) continue;
    const auto known = std::ranges::lower_bound(labels, sample.label->value, {}, &Label::value);
    if (known != labels.end() && known->value == sample.label->value) sample.label->name = known->name;
  }
}

}  // namespace

Result<QuestionReply> AnswerTo(const AnswerQuestion& asked, const VoxelServer::Samples& samples,
                               const std::vector<VoxelServer::Samples>& others, const VoxelServer::Samples& labels,
                               const std::vector<VoxelServer::Samples>& shapes) {
  Status read_labels = Status::Ok();
  Beside beside{.shapes = shapes};
  if (labels.any()) beside.labels = LabelsBesideVolume(asked, labels, read_labels);
  Result<QuestionReply> reply = AnswerOf(asked, samples, beside);
  if (!read_labels.ok()) return read_labels;
  if (!reply.ok()) return reply;
  std::span<VolumeSample> points;
  if (auto* const samples_of = std::get_if<SampleReply>(&*reply)) points = samples_of->samples;
  if (auto* const pick = std::get_if<PickReply>(&*reply); pick != nullptr && pick->sample) points = {&*pick->sample, 1};
  if (labels.any()) NameLabels(asked, points);
  const Status added = AddFields(asked, others, points);
  return added.ok() ? std::move(reply) : added;
}

}  // namespace slabstream
