// Messages of the client plane.
#pragma once

#include "common/renderers/registry.h"
#include "common/wire/request_fields.h"
#include "slabstream/v1/client.pb.h"

namespace slabstream {

static_assert(v1::FramePhase_MAX == static_cast<int>(FramePhase::kRunning));
static_assert(v1::DatasetState_MAX == static_cast<int>(DatasetState::kFailed));
static_assert(v1::LengthUnit_MAX == static_cast<int>(LengthUnit::kMetre));
static_assert(v1::DataAction_MAX == static_cast<int>(DataAction::kReload));

void Fields(auto& io, Is<PicturesDoor> auto& m) {
  using P = v1::PicturesDoor;
  io.Range("port", m.port, &P::port, &P::set_port, 1, 65535);
  io.Bytes("key", m.key, &P::key, &P::mutable_key, kKeyTextBytes, kKeyTextBytes);
}

v1::SubmitFrame ProtoOf(const SubmitFrame&);
void Fields(auto& io, Is<SubmitFrame> auto& m) {
  using P = v1::SubmitFrame;
  io.Any(m.request, &P::request, &P::set_request);
  io.Range("deadline_ms", m.deadline_ms, &P::deadline_ms, &P::set_deadline_ms, 1, 86400000);
  io.Message("frame", m.frame, &P::frame, &P::mutable_frame);
  io.Optional("pictures", m.pictures, &P::has_pictures, &P::pictures, &P::mutable_pictures);
}

v1::FrameProgress ProtoOf(const FrameProgress&);
void Fields(auto& io, Is<FrameProgress> auto& m) {
  using P = v1::FrameProgress;
  io.Any(m.request, &P::request, &P::set_request);
  io.OneOf("phase", m.phase, &P::phase, &P::set_phase, FramePhase::kQueued, FramePhase::kRunning);
  io.Any(m.queue_position, &P::queue_position, &P::set_queue_position);
  io.Range("group_count", m.group_count, &P::group_count, &P::set_group_count, 0, kMaxGroups);
  io.Range("groups_done", m.groups_done, &P::groups_done, &P::set_groups_done, 0, m.group_count);
  io.Any(m.attempt, &P::attempt, &P::set_attempt);
  io.Any(m.workers, &P::workers, &P::set_workers);
  io.Range("read_percent", m.read_percent, &P::read_percent, &P::set_read_percent, 0, 100);
  io.Any(m.read_rate, &P::read_rate, &P::set_read_rate);
}

void Fields(auto& io, Is<LevelUse> auto& m) {
  using P = v1::LevelUse;
  io.Range("level", m.level, &P::level, &P::set_level, 0, kMaxLevels - 1);
  io.Any(m.boxes, &P::boxes, &P::set_boxes);
  io.Any(m.voxels, &P::voxels, &P::set_voxels);
}

void Fields(auto& io, Is<FrameStatistics> auto& m) {
  using P = v1::FrameStatistics;
  io.Any(m.workers, &P::workers, &P::set_workers);
  io.Any(m.groups, &P::groups, &P::set_groups);
  io.Any(m.attempts, &P::attempts, &P::set_attempts);
  io.Text("renderer", m.renderer, &P::renderer, &P::mutable_renderer, 0, kMaxNameBytes);
  io.Text("decomposition", m.decomposition, &P::decomposition, &P::mutable_decomposition, 0, kMaxNameBytes);
  io.Text("axis", m.axis, &P::axis, &P::mutable_axis, 0, kMaxNameBytes);
  io.Text("combine", m.combine, &P::combine, &P::mutable_combine, 0, kMaxNameBytes);
  io.Text("balance_by", m.balance_by, &P::balance_by, &P::mutable_balance_by, 0, kMaxNameBytes);
  io.Text("assignment", m.assignment, &P::assignment, &P::mutable_assignment, 0, kMaxNameBytes);
  io.Text("balance", m.balance, &P::balance, &P::mutable_balance, 0, kMaxNameBytes);
  io.Any(m.queued_ns, &P::queued_ns, &P::set_queued_ns);
  io.Any(m.begin_ns, &P::begin_ns, &P::set_begin_ns);
  io.Any(m.end_ns, &P::end_ns, &P::set_end_ns);
  io.Messages("reports", m.reports, &P::reports, &P::mutable_reports, kMaxReports);
  io.Any(m.display, &P::display, &P::set_display);
  io.Message("grid", m.grid, &P::grid, &P::mutable_grid);
  io.Messages("levels", m.levels, &P::levels, &P::mutable_levels, kMaxLevels);
  io.Text("lowered", m.lowered, &P::lowered, &P::mutable_lowered, 0, kMaxTextBytes);
  io.Optional("view", m.view, &P::has_view, &P::view, &P::mutable_view);
}

void Fields(auto& io, Is<PictureGeometry> auto& m) {
  using P = v1::PictureGeometry;
  io.OneOf("world", m.world, &P::world, &P::set_world, World::kVoxels, World::kPatient);
  io.OneOf("unit", m.unit, &P::unit, &P::set_unit, LengthUnit::kVoxel, LengthUnit::kMetre);
  io.OneOf("projection", m.projection, &P::projection, &P::set_projection, Projection::kOrthographic, Projection::kPerspective);
  io.Message("right", m.right, &P::right, &P::mutable_right);
  io.Message("up", m.up, &P::up, &P::mutable_up);
  io.Message("forward", m.forward, &P::forward, &P::mutable_forward);
  io.Message("target", m.target, &P::target, &P::mutable_target);
  io.Finite("target_depth", m.target_depth, &P::target_depth, &P::set_target_depth);
  io.Finite("pixel_size", m.pixel_size, &P::pixel_size, &P::set_pixel_size);
  io.Check([&](Checker& check) {
    check.That(AreRightHanded(m.right, m.up, -m.forward), "right", "not of three right-handed unit vectors at right angles");
    if (m.projection == Projection::kPerspective) check.Positive("target_depth", m.target_depth);
    check.Positive("pixel_size", m.pixel_size);
  });
}

v1::FrameReply ProtoOf(const FrameReply&);
void Fields(auto& io, Is<FrameReply> auto& m) {
  using P = v1::FrameReply;
  io.Any(m.request, &P::request, &P::set_request);
  io.Message("size", m.size, &P::size, &P::mutable_size);
  io.Range("group_count", m.group_count, &P::group_count, &P::set_group_count, 1, kMaxGroups);
  io.Range("groups_done", m.groups_done, &P::groups_done, &P::set_groups_done, 0, m.group_count);
  io.Messages("shares", m.shares, &P::shares, &P::mutable_shares, kMaxShares);
  io.Message("statistics", m.statistics, &P::statistics, &P::mutable_statistics);
  io.Message("geometry", m.geometry, &P::geometry, &P::mutable_geometry);
  io.Check([&](Checker& check) {
    const PixelBounds picture = {0, 0, m.size.width, m.size.height};
    check.That(!m.shares.empty(), "shares", "none");
    for (std::size_t i = 0; i < m.shares.size(); ++i) {
      const auto share = check.In("shares", i);
      const RunImageHeader& image = m.shares[i].runs.image;
      check.That(picture.Contains(image.bounds), "runs.image.bounds", "not inside the picture");
      check.That(image.format == m.shares.front().runs.image.format, "runs.image.format", "not that of the first share");
    }
    if (m.groups_done == m.group_count) check.Adopt(RequireRenderer(m.statistics.renderer).status());
  });
}

v1::FrameFailed ProtoOf(const FrameFailed&);
void Fields(auto& io, Is<FrameFailed> auto& m) {
  using P = v1::FrameFailed;
  io.Any(m.request, &P::request, &P::set_request);
  io.Message("status", m.status, &P::status, &P::mutable_status);
}

v1::CancelFrame ProtoOf(const CancelFrame&);
void Fields(auto& io, Is<CancelFrame> auto& m) { io.Any(m.request, &v1::CancelFrame::request, &v1::CancelFrame::set_request); }

void Fields(auto& io, Is<PictureSenders> auto& m) {
  using P = v1::PictureSenders;
  io.Range("version", m.version, &P::version, &P::set_version, 1, std::numeric_limits<std::uint64_t>::max());
  io.ByteStrings("keys", m.keys, &P::keys, &P::mutable_keys, kMaxListed, kKeyTextBytes);
}

v1::ClientPing ProtoOf(const ClientPing&);
void Fields(auto& io, Is<ClientPing> auto& m) {
  using P = v1::ClientPing;
  io.Any(m.nonce, &P::nonce, &P::set_nonce);
  io.Numbers("open", m.open, &P::open, &P::mutable_open, kMaxOpenRequests);
  io.Any(m.received_bytes, &P::received_bytes, &P::set_received_bytes);
  io.Optional("senders", m.senders, &P::has_senders, &P::senders, &P::set_senders);
}

v1::ClientPong ProtoOf(const ClientPong&);
void Fields(auto& io, Is<ClientPong> auto& m) {
  using P = v1::ClientPong;
  io.Any(m.epoch, &P::epoch, &P::set_epoch);
  io.Any(m.nonce, &P::nonce, &P::set_nonce);
  io.Numbers("known", m.known, &P::known, &P::mutable_known, kMaxOpenRequests);
  io.Optional("senders", m.senders, &P::has_senders, &P::senders, &P::mutable_senders);
}

v1::SentPicture ProtoOf(const SentPicture&);
void Fields(auto& io, Is<SentPicture> auto& m) {
  using P = v1::SentPicture;
  io.Any(m.digest, &P::digest, &P::set_digest);
  io.Range("bytes", m.bytes, &P::bytes, &P::set_bytes, 0, kMaxRunsBytes);
}

v1::StatusQuery ProtoOf(const StatusQuery&);
void Fields(auto& io, Is<StatusQuery> auto& m) { io.Any(m.nonce, &v1::StatusQuery::nonce, &v1::StatusQuery::set_nonce); }

void Fields(auto& io, Is<WorkerStatus> auto& m) {
  using P = v1::WorkerStatus;
  io.Any(m.worker, &P::worker, &P::set_worker);
  io.Any(m.pid, &P::pid, &P::set_pid);
  io.Text("host", m.host, &P::host, &P::mutable_host, 0, kMaxNameBytes);
  io.Range("threads", m.threads, &P::threads, &P::set_threads, 1, kMaxThreads);
  io.Any(m.slot, &P::slot, &P::set_slot);
  io.Any(m.cached_bytes, &P::cached_bytes, &P::set_cached_bytes);
  io.Any(m.fetched_bytes, &P::fetched_bytes, &P::set_fetched_bytes);
  io.Any(m.rendered_ranks, &P::rendered_ranks, &P::set_rendered_ranks);
  io.Any(m.silent_ms, &P::silent_ms, &P::set_silent_ms);
  io.Any(m.leaving, &P::leaving, &P::set_leaving);
  io.Any(m.memory_bytes, &P::memory_bytes, &P::set_memory_bytes);
}

void Fields(auto& io, Is<DatasetStatus> auto& m) {
  using P = v1::DatasetStatus;
  io.Text("name", m.name, &P::name, &P::mutable_name, 1, kMaxNameBytes);
  io.OneOf("state", m.state, &P::state, &P::set_state, DatasetState::kUnloaded, DatasetState::kFailed);
  if (m.state == DatasetState::kReady) {
    io.Message("description", m.description, &P::description, &P::mutable_description);
    io.Message("range", m.range, &P::range, &P::mutable_range);
    io.Any(m.memory_bytes, &P::memory_bytes, &P::set_memory_bytes);
    io.Range("labels", m.labels, &P::labels, &P::set_labels, 0, kMaxLabels);
    io.Any(m.overlay, &P::overlay, &P::set_overlay);
    io.Any(m.cells, &P::cells, &P::set_cells);
    io.Messages("levels", m.levels, &P::levels, &P::mutable_levels, kMaxLevels);
  }
  if (m.state == DatasetState::kFailed) io.Text("error", m.error, &P::error, &P::mutable_error, 0, kMaxTextBytes);
  io.Any(m.since_ms, &P::since_ms, &P::set_since_ms);
}

void Fields(auto& io, Is<RefusedRequests> auto& m) {
  using P = v1::RefusedRequests;
  io.Any(m.bad_request, &P::bad_request, &P::set_bad_request);
  io.Any(m.unknown_dataset, &P::unknown_dataset, &P::set_unknown_dataset);
  io.Any(m.too_large, &P::too_large, &P::set_too_large);
  io.Any(m.over_quota, &P::over_quota, &P::set_over_quota);
}

v1::StatusReply ProtoOf(const StatusReply&);
void Fields(auto& io, Is<RendererStatus> auto& m) {
  using P = v1::RendererStatus;
  constexpr std::size_t kMostAbilities = 64;
  io.Text("name", m.name, &P::name, &P::mutable_name, 1, kMaxNameBytes);
  io.Text("title", m.title, &P::title, &P::mutable_title, 0, kMaxNameBytes);
  io.ByteStrings("abilities", m.abilities, &P::abilities, &P::mutable_abilities, kMostAbilities, kMaxNameBytes);
  io.ByteStrings("parameters", m.parameters, &P::parameters, &P::mutable_parameters, kMaxParameters, kMaxNameBytes);
}

void Fields(auto& io, Is<StatusReply> auto& m) {
  using P = v1::StatusReply;
  io.Any(m.epoch, &P::epoch, &P::set_epoch);
  io.Any(m.nonce, &P::nonce, &P::set_nonce);
  io.Any(m.pid, &P::pid, &P::set_pid);
  io.Any(m.uptime_ms, &P::uptime_ms, &P::set_uptime_ms);
  io.Any(m.clients, &P::clients, &P::set_clients);
  io.Any(m.queued, &P::queued, &P::set_queued);
  io.Any(m.running, &P::running, &P::set_running);
  io.Any(m.frames_done, &P::frames_done, &P::set_frames_done);
  io.Any(m.frames_failed, &P::frames_failed, &P::set_frames_failed);
  io.Any(m.workers_lost, &P::workers_lost, &P::set_workers_lost);
  io.Messages("workers", m.workers, &P::workers, &P::mutable_workers, kMaxListed);
  io.Messages("datasets", m.datasets, &P::datasets, &P::mutable_datasets, kMaxListed);
  io.Any(m.memory_bytes, &P::memory_bytes, &P::set_memory_bytes);
  io.Message("refused", m.refused, &P::refused, &P::mutable_refused);
  io.Messages("renderers", m.renderers, &P::renderers, &P::mutable_renderers, 256);
  io.Messages("web", m.web, &P::web, &P::mutable_web, kMaxWebServers);
}

v1::ShutDown ProtoOf(const ShutDown&);
void Fields(auto& io, Is<ShutDown> auto& m) { io.Any(m.nonce, &v1::ShutDown::nonce, &v1::ShutDown::set_nonce); }

v1::ShutDownReply ProtoOf(const ShutDownReply&);
void Fields(auto& io, Is<ShutDownReply> auto& m) { io.Any(m.nonce, &v1::ShutDownReply::nonce, &v1::ShutDownReply::set_nonce); }

v1::KeysOrder ProtoOf(const KeysOrder&);
void Fields(auto& io, Is<KeysOrder> auto& m) {
  using P = v1::KeysOrder;
  io.Any(m.nonce, &P::nonce, &P::set_nonce);
  io.OneOf("action", m.action, &P::action, &P::set_action, KeysAction::kList, KeysAction::kIssue);
  const bool of_role = m.action == KeysAction::kRotate || m.action == KeysAction::kIssue;
  if (of_role) io.OneOf("role", m.role, &P::role, &P::set_role, Role::kClient, Role::kAdmin);
  io.Bytes("key", m.key, &P::key, &P::mutable_key, 0, kMaxKeyBytes);
  io.Text("name", m.name, &P::name, &P::mutable_name, 0, kMaxKeyBytes);
}

void Fields(auto& io, Is<AdmittedKey> auto& m) {
  using P = v1::AdmittedKey;
  io.Bytes("key", m.public_key, &P::key, &P::mutable_key, kKeyTextBytes, kKeyTextBytes);
  io.OneOf("role", m.role, &P::role, &P::set_role, Role::kClient, Role::kAdmin);
  io.Text("made", m.made, &P::made, &P::mutable_made, 0, kMaxKeyBytes);
  io.Text("name", m.name, &P::name, &P::mutable_name, 0, kMaxKeyBytes);
  io.Optional("silent_ms", m.silent_ms, &P::has_silent_ms, &P::silent_ms, &P::set_silent_ms);
}

v1::KeysReply ProtoOf(const KeysReply&);
void Fields(auto& io, Is<KeysReply> auto& m) {
  using P = v1::KeysReply;
  io.Any(m.nonce, &P::nonce, &P::set_nonce);
  io.Messages("keys", m.keys, &P::keys, &P::mutable_keys, kMaxListed);
}

v1::OrderRefused ProtoOf(const OrderRefused&);
void Fields(auto& io, Is<OrderRefused> auto& m) {
  using P = v1::OrderRefused;
  io.Any(m.nonce, &P::nonce, &P::set_nonce);
  io.Message("status", m.status, &P::status, &P::mutable_status);
}

v1::DataOrder ProtoOf(const DataOrder&);
void Fields(auto& io, Is<DataOrder> auto& m) {
  using P = v1::DataOrder;
  io.Any(m.nonce, &P::nonce, &P::set_nonce);
  io.OneOf("action", m.action, &P::action, &P::set_action, DataAction::kList, DataAction::kReload);
  io.ByteStrings("items", m.items, &P::items, &P::mutable_items, kMaxDataItems, kMaxDataItemBytes);
}

v1::DataReply ProtoOf(const DataReply&);
void Fields(auto& io, Is<DataReply> auto& m) {
  using P = v1::DataReply;
  io.Any(m.nonce, &P::nonce, &P::set_nonce);
  io.Messages("datasets", m.datasets, &P::datasets, &P::mutable_datasets, kMaxListed);
}

v1::SummaryQuery ProtoOf(const SummaryQuery&);
void Fields(auto& io, Is<SummaryQuery> auto& m) {
  using P = v1::SummaryQuery;
  io.Any(m.nonce, &P::nonce, &P::set_nonce);
  io.Text("dataset", m.dataset, &P::dataset, &P::mutable_dataset, 1, kMaxNameBytes);
  io.Message("transfer", m.transfer, &P::transfer, &P::mutable_transfer);
  io.Check([&](Checker& check) {
    if (check.ok()) check.Adopt(Validate(m.transfer));
  });
}

inline void Read(const v1::SummaryQuery& in, SummaryQuery& out, Checker& check) { ReadFields(WithStandards(in), out, check); }

void Fields(auto& io, Is<Percentile> auto& m) {
  using P = v1::Percentile;
  io.Between("percent", m.percent, &P::percent, &P::set_percent, 0, 100);
  io.Finite("value", m.value, &P::value, &P::set_value);
}

void Fields(auto& io, Is<Label> auto& m) {
  using P = v1::Label;
  auto& [red, green, blue] = m.color;
  io.Range("value", m.value, &P::value, &P::set_value, 1, kMaxLabelValue);
  io.Text("name", m.name, &P::name, &P::mutable_name, 0, kMaxLabelNameBytes);
  io.Finite("red", red, &P::red, &P::set_red);
  io.Finite("green", green, &P::green, &P::set_green);
  io.Finite("blue", blue, &P::blue, &P::set_blue);
  io.Check([&](Checker& check) {
    for (const float share : m.color) check.That(share >= 0 && share <= 1, "", "a colour that is not in [0, 1]");
  });
}

v1::SummaryReply ProtoOf(const SummaryReply&);
void Fields(auto& io, Is<SummaryReply> auto& m) {
  using P = v1::SummaryReply;
  io.Any(m.nonce, &P::nonce, &P::set_nonce);
  io.Message("description", m.description, &P::description, &P::mutable_description);
  io.Message("range", m.range, &P::range, &P::mutable_range);
  io.Numbers("histogram", m.histogram, &P::histogram, &P::mutable_histogram, kHistogramBins);
  io.Any(m.non_finite, &P::non_finite, &P::set_non_finite);
  io.Messages("percentiles", m.percentiles, &P::percentiles, &P::mutable_percentiles, kMaxPercentiles);
  io.Message("transfer", m.transfer, &P::transfer, &P::mutable_transfer);
  io.Messages("labels", m.labels, &P::labels, &P::mutable_labels, kMaxLabels);
  io.Check([&](Checker& check) {
    check.That(m.histogram.size() == kHistogramBins, "histogram", "not as many bins as expected");
    for (std::size_t i = 1; i < m.labels.size(); ++i) check.That(m.labels[i - 1].value < m.labels[i].value, "labels", "values do not rise");
    if (check.ok()) check.Adopt(Validate(m.transfer));
  });
}

v1::SampleQuery ProtoOf(const SampleQuery&);
void Fields(auto& io, Is<SampleQuery> auto& m) {
  using P = v1::SampleQuery;
  io.Any(m.nonce, &P::nonce, &P::set_nonce);
  io.Text("dataset", m.dataset, &P::dataset, &P::mutable_dataset, 1, kMaxNameBytes);
  io.Messages("points", m.points, &P::points, &P::mutable_points, kMaxSamplePoints);
  io.Check([&](Checker& check) { check.That(!m.points.empty(), "points", "none"); });
}

void Fields(auto& io, Is<LabelAt> auto& m) {
  using P = v1::LabelAt;
  io.Range("value", m.value, &P::value, &P::set_value, 0, kMaxLabelValue);
  io.Text("name", m.name, &P::name, &P::mutable_name, 0, kMaxLabelNameBytes);
}

void Fields(auto& io, Is<VolumeSample> auto& m) {  // all but value, overlay and interpolated
  using P = v1::VolumeSample;
  io.Message("at", m.at, &P::at, &P::mutable_at);
  io.Any(m.inside, &P::inside, &P::set_inside);
  io.Any(m.rest, &P::rest, &P::set_rest);
  io.Message("voxel", m.voxel, &P::voxel, &P::mutable_voxel);
  io.Optional("label", m.label, &P::has_label, &P::label, &P::mutable_label);
}

inline void Write(const VolumeSample& in, v1::VolumeSample& out) {
  WriteFields(in, out);
  if (in.value) out.set_value(*in.value);
  if (in.overlay) out.set_overlay(*in.overlay);
  if (in.interpolated) out.set_interpolated(*in.interpolated);
}
inline void Read(const v1::VolumeSample& in, VolumeSample& out, Checker& check) {
  ReadFields(in, out, check);
  if (in.has_value()) out.value = check.Finite("value", in.value());
  if (in.has_overlay()) out.overlay = check.Finite("overlay", in.overlay());
  if (in.has_interpolated()) out.interpolated = check.Finite("interpolated", in.interpolated());
}

v1::SampleReply ProtoOf(const SampleReply&);
void Fields(auto& io, Is<SampleReply> auto& m) {
  using P = v1::SampleReply;
  io.Any(m.nonce, &P::nonce, &P::set_nonce);
  io.Messages("samples", m.samples, &P::samples, &P::mutable_samples, kMaxSamplePoints);
}

v1::StatisticsQuery ProtoOf(const StatisticsQuery&);
void Fields(auto& io, Is<StatisticsQuery> auto& m) {
  using P = v1::StatisticsQuery;
  io.Any(m.nonce, &P::nonce, &P::set_nonce);
  io.Text("dataset", m.dataset, &P::dataset, &P::mutable_dataset, 1, kMaxNameBytes);
  io.Message("box", m.box, &P::box, &P::mutable_box);
  io.Any(m.labels, &P::labels, &P::set_labels);
}
inline void Read(const v1::StatisticsQuery& in, StatisticsQuery& out, Checker& check) { ReadFields(WithStandards(in), out, check); }

// Two messages have these fields.
template <class P>
void BoxStatisticsFields(auto& io, auto& statistics) {
  auto& [voxels, non_finite, mean, deviation, least, largest] = statistics;
  io.Any(voxels, &P::voxels, &P::set_voxels);
  io.Any(non_finite, &P::non_finite, &P::set_non_finite);
  io.Finite("mean", mean, &P::mean, &P::set_mean);
  io.Between("deviation", deviation, &P::deviation, &P::set_deviation, 0, std::numeric_limits<double>::max());
  io.Finite("least", least, &P::least, &P::set_least);
  io.Finite("largest", largest, &P::largest, &P::set_largest);
}

void Fields(auto& io, Is<LabelStatistics> auto& m) {
  using P = v1::LabelStatistics;
  io.Message("label", m.label, &P::label, &P::mutable_label);
  BoxStatisticsFields<P>(io, m.statistics);
}

v1::StatisticsReply ProtoOf(const StatisticsReply&);
void Fields(auto& io, Is<StatisticsReply> auto& m) {
  using P = v1::StatisticsReply;
  io.Any(m.nonce, &P::nonce, &P::set_nonce);
  BoxStatisticsFields<P>(io, m.statistics);
  io.Message("description", m.description, &P::description, &P::mutable_description);
  io.Messages("labels", m.labels, &P::labels, &P::mutable_labels, kMaxLabels);
  io.Check([&](Checker& check) {
    for (std::size_t i = 1; i < m.labels.size(); ++i)
      check.That(m.labels[i - 1].label.value < m.labels[i].label.value, "labels", "values do not rise");
  });
}

v1::JointHistogramQuery ProtoOf(const JointHistogramQuery&);
void Fields(auto& io, Is<JointHistogramQuery> auto& m) {
  using P = v1::JointHistogramQuery;
  io.Any(m.nonce, &P::nonce, &P::set_nonce);
  io.Text("dataset", m.dataset, &P::dataset, &P::mutable_dataset, 1, kMaxNameBytes);
}

v1::JointHistogramReply ProtoOf(const JointHistogramReply&);
void Fields(auto& io, Is<JointHistogramReply> auto& m) {
  using P = v1::JointHistogramReply;
  constexpr std::size_t kCounts = std::size_t{kJointValues} * kJointSlopes;
  io.Any(m.nonce, &P::nonce, &P::set_nonce);
  io.Message("range", m.range, &P::range, &P::mutable_range);
  io.Between("steepest", m.histogram.steepest, &P::steepest, &P::set_steepest, 0, std::numeric_limits<double>::max());
  io.Numbers("counts", m.histogram.counts, &P::counts, &P::mutable_counts, kCounts);
  io.Check([&](Checker& check) { check.That(m.histogram.counts.size() == kCounts, "counts", "not as many bins as expected"); });
}

v1::PickQuery ProtoOf(const PickQuery&);
void Fields(auto& io, Is<PickQuery> auto& m) {
  using P = v1::PickQuery;
  io.Any(m.nonce, &P::nonce, &P::set_nonce);
  io.Message("frame", m.frame, &P::frame, &P::mutable_frame);
  io.Between("x", m.x, &P::x, &P::set_x, 0, m.frame.size.width);
  io.Between("y", m.y, &P::y, &P::set_y, 0, m.frame.size.height);
}

v1::PickReply ProtoOf(const PickReply&);
void Fields(auto& io, Is<PickReply> auto& m) {
  using P = v1::PickReply;
  io.Any(m.nonce, &P::nonce, &P::set_nonce);
  io.Optional("sample", m.sample, &P::has_sample, &P::sample, &P::mutable_sample);
  io.Finite("depth", m.depth, &P::depth, &P::set_depth);
}

void Fields(auto& io, Is<Ball> auto& m) {
  using P = v1::Ball;
  io.Message("centre", m.centre, &P::centre, &P::mutable_centre);
  io.Finite("radius", m.radius, &P::radius, &P::set_radius);
  io.Check([&](Checker& check) { check.Positive("radius", m.radius); });
}

v1::ViewQuery ProtoOf(const ViewQuery&);
void Fields(auto& io, Is<ViewQuery> auto& m) {
  using P = v1::ViewQuery;
  io.Any(m.nonce, &P::nonce, &P::set_nonce);
  io.Message("frame", m.frame, &P::frame, &P::mutable_frame);
  io.Optional("framed", m.framed, &P::has_framed, &P::framed, &P::mutable_framed);
}

v1::ViewReply ProtoOf(const ViewReply&);
void Fields(auto& io, Is<ViewReply> auto& m) {
  using P = v1::ViewReply;
  io.Any(m.nonce, &P::nonce, &P::set_nonce);
  io.Message("view", m.view, &P::view, &P::mutable_view);
  io.Optional("framed", m.framed, &P::has_framed, &P::framed, &P::mutable_framed);
}

}  // namespace slabstream
