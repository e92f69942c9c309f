#include <algorithm>
#include <tuple>
#include <utility>

#include "coordinator/datasets/dataset_machine_state.h"

namespace slabstream {

void DatasetMachine::State::Ask(PeerToken client, Question question) {
  const std::string& name = DatasetOf(question);
  OpenQuestion open{.client = client, .question = question, .entry = name};
  const auto of_client = std::ranges::count(questions, client, [](const auto& each) { return each.second.client; });
  if (std::size_t(of_client) >= kMaxOpenQuestions || questions.size() >= config.max_questions) {
    ++refused.over_quota;
    const bool own = std::size_t(of_client) >= kMaxOpenQuestions;
    return RefuseQuestion(
        open, Status::ResourceExhausted(fmt::format("{} questions are open, which is the limit of {}",
                                                    own ? std::size_t(of_client) : questions.size(), own ? "a client" : "the service")));
  }
  const FrameRequest* const frame = FrameOf(question);
  if (const Status known = CheckKnown(name, frame); !known.ok()) {
    ++refused.unknown_dataset;
    return RefuseQuestion(open, known);
  }
  open.check = Seek(name);
  if (frame != nullptr) open.shapes = SeekShapes(*frame);
  questions.emplace(++last_question, std::move(open));
}

// Of a dataset with several levels, that is open: a question about a picture is one about the finest level that it shows, any other one
// about the finest level of all. Errors of LevelsOf.
Status DatasetMachine::State::DescendQuestion(OpenQuestion& open, const VolumeLevels& levels) {
  int level = 0;
  if (FrameRequest* const frame = FrameOf(open.question)) {
    const Result<ChosenView> chosen = ChooseView(*frame, levels.levels.front().geometry, levels.overview, {}, open.fields);
    if (!chosen.ok()) return chosen.status();
    frame->view = chosen->view;
    const Result<LevelMap> drawn = LevelsOf(*frame, levels, open.fields);
    if (!drawn.ok()) return drawn.status();
    level = drawn->levels.front();
    *frame = AtLevel(*frame, levels.levels.front().geometry, levels.levels[std::size_t(level)].geometry);
  }
  open.entry = LevelName(open.entry, level);
  open.check = Seek(open.entry);
  for (Use::Entry& other : open.others) {
    if (datasets.Find(other.name)->levels == nullptr) continue;
    other.name = LevelName(other.name, level);  // a channel, which has the levels of the volume
    other.check = Seek(other.name);
  }
  return Status::Ok();
}

// Of a dataset that is open: the question waits for the fields that it is about, or for what must be known before (SourceOf). Errors of
// FieldsToShow, TimeToShow and SourceOf.
Status DatasetMachine::State::FindField(OpenQuestion& open) {
  const FrameRequest picture = PictureOf(open.question);
  Result<ShownAtTime> shown = WhatShows(picture, datasets.Find(picture.dataset)->fields);
  if (!shown.ok()) return shown.status();
  ShownFields found = std::move(shown->fields);
  const DatasetFields& fields = *found.dataset;
  if (FrameOf(open.question) == nullptr) {
    if (!std::exchange(found.volume_shows, true)) found.volume = shown->numbers[1];
    const bool names_none = picture.channels.empty();
    const auto is_no_other = [&](const FieldVolume& other) { return names_none || other.labels || other.number == found.volume; };
    std::erase_if(found.others, is_no_other);
    // Points that no field is named for tell of the first one and of the overlay.
    const int last = fields.values() - 1;
    const bool has_overlay = !fields.fields[std::size_t(last)].channel && last != found.volume;
    if (names_none && has_overlay && std::holds_alternative<SampleQuery>(open.question)) found.others.push_back({.number = last});
  }
  const bool of_points = std::holds_alternative<SampleQuery>(open.question) || std::holds_alternative<PickQuery>(open.question);
  const auto* const statistics = std::get_if<StatisticsQuery>(&open.question);
  const bool of_labels = of_points || (statistics != nullptr && statistics->labels) || LabelsOf(picture) != nullptr ||
                         HasLabelsAlone(fields) || std::holds_alternative<SummaryQuery>(open.question);
  Status failed;
  // False: something else must be ready first, or `failed`.
  const auto find = [&](int field, Use::Entry& entry) {
    const Result<FieldSource> source = SourceOf(picture.dataset, field, shown->time);
    if (!source.ok()) {
      failed = source.status();
      return false;
    }
    entry = {source->entry, source->entry == open.entry ? open.check : Seek(source->entry)};
    if (!source->ready) std::tie(open.entry, open.check) = std::tie(entry.name, entry.check);
    return source->ready;
  };
  Use::Entry volume, labels;
  if (!find(found.volume, volume)) return failed;
  if (of_labels && fields.labels() && !find(*fields.labels(), labels)) return failed;
  std::vector<Use::Entry> others(found.others.size());
  for (std::size_t i = 0; i < others.size(); ++i) {
    if (!find(found.others[i].number, others[i])) return failed;
  }
  for (FieldVolume& other : found.others) other.of_volume = {0};
  open.fields = std::move(found);
  open.time = shown->time;
  open.entry = volume.name;
  open.check = volume.check;
  open.labels = std::move(labels);
  open.others = std::move(others);
  return Status::Ok();
}

// What can be answered now.
void DatasetMachine::State::AskExecutor() {
  std::vector<std::pair<QuestionId, Status>> wrong;
  for (auto& [id, open] : questions) {
    const auto is_there = [this](const std::string& name, CheckId check) {
      const DatasetTable::Entry& entry = *datasets.Find(name);
      return entry.state == DatasetState::kReady && entry.checks.IsOver(check);
    };
    const auto can_be_asked = [&](const OpenQuestion& question) {
      return std::ranges::all_of(question.entries(), [&](const Use::Entry& of) { return is_there(of.name, of.check); });
    };
    if (open.asked || !can_be_asked(open)) continue;
    if (open.fields.dataset == nullptr) {
      if (const Status found = FindField(open); !found.ok()) {
        wrong.emplace_back(id, found);
        continue;
      }
      if (!can_be_asked(open)) continue;
    }
    if (const FrameRequest* const frame = FrameOf(open.question)) {
      const Result<bool> has_shapes = SeekAtTime(*frame, open.time, open.shapes);
      if (!has_shapes.ok()) {
        wrong.emplace_back(id, has_shapes.status());
        continue;
      }
      if (!can_be_asked(open)) continue;
    }
    const bool of_summary = std::holds_alternative<SummaryQuery>(open.question),
               about_view = std::holds_alternative<ViewQuery>(open.question);
    const auto seek_finest = [&](Use::Entry& other) {
      if (about_view || other.name.empty() || datasets.Find(other.name)->levels == nullptr) return;
      other.name = LevelName(other.name, 0);
      other.check = Seek(other.name);
    };
    if (!of_summary) seek_finest(open.labels);
    for (std::size_t i = 0; i < open.others.size(); ++i) {
      if (!open.fields.dataset->fields[std::size_t(open.fields.others[i].number)].channel) seek_finest(open.others[i]);
    }
    if (!can_be_asked(open)) continue;
    // What is known of a field, with the voxels of those that have one level by now.
    const auto known = [&](const Use::Entry& of) -> CoarserVolume {
      const DatasetTable::Entry& found = *datasets.Find(of.name);
      return {found.levels != nullptr ? 0 : found.id, found.overview()};
    };
    const auto note_others = [&] {
      for (std::size_t i = 0; i < open.others.size(); ++i) open.fields.others[i].levels = {known(open.others[i])};
      open.fields.shapes.clear();
      for (const Use::Entry& shape : open.shapes) open.fields.shapes.push_back(known(shape));
      open.fields.planes.clear();
      for (const Use::Entry& plane : open.planes) open.fields.planes.push_back(known(plane));
    };
    note_others();
    const std::shared_ptr<const VolumeLevels> levels = datasets.Find(open.entry)->levels;
    std::shared_ptr<const VolumeSummary> summary;
    const auto* const about = std::get_if<SummaryQuery>(&open.question);
    const bool at_time = about != nullptr && !about->time.empty() && open.fields.dataset->times.count > 1;
    if (levels != nullptr && at_time) {
      open.summary = std::make_shared<const VolumeSummary>(StatisticsOf(*levels));
      open.entry = LevelName(open.entry, int(levels->levels.size()) - 1);
      open.check = Seek(open.entry);
      if (!can_be_asked(open)) continue;
    } else if (levels != nullptr && of_summary) {
      summary = std::make_shared<const VolumeSummary>(StatisticsOf(*levels));
    } else if (levels != nullptr && about_view) {
      summary = levels->overview;
    } else if (levels != nullptr) {
      if (const Status found = DescendQuestion(open, *levels); !found.ok()) {
        wrong.emplace_back(id, found);
        continue;
      }
      if (!can_be_asked(open)) continue;
    }
    const DatasetTable::Entry& entry = *datasets.Find(open.entry);
    if (const FrameRequest* const frame = FrameOf(open.question); frame != nullptr && !about_view && open.planes.empty()) {
      open.planes = SeekPlanes(*frame, entry.summary->description.geometry, open.entry);
      if (!can_be_asked(open)) continue;
    }
    if (open.summary != nullptr) {
      VolumeSummary of_all = *open.summary;
      of_all.stored = entry.summary->stored;
      summary = std::make_shared<const VolumeSummary>(std::move(of_all));
    }
    open.asked = true;
    note_others();
    AnswerQuestion ask{id,          open.question, entry.id, summary != nullptr ? summary : entry.summary, about_view ? levels : nullptr,
                       open.fields, at_time};
    if (!open.labels.name.empty()) ask.labels = known(open.labels);
    ask.stop = open.answer->stop.get_token();
    actions.emplace_back(std::move(ask));
  }
  for (const auto& [id, why] : wrong) {
    ++refused.bad_request;
    RefuseQuestion(questions.extract(id).mapped(), why);
  }
}

void DatasetMachine::State::On(const QuestionAnswered& event) {
  const auto found = questions.extract(event.question);
  if (found.empty()) return;  // its client has gone
  const OpenQuestion& open = found.mapped();
  if (!event.answer.ok()) return RefuseQuestion(open, event.answer.status());
  Send(open.client, Widen<CoordinatorToClient>(*event.answer));
}

void DatasetMachine::State::RefuseQuestion(const OpenQuestion& open, const Status& status) {
  Tell(NoteAbout::kFrames, LogLevel::kInfo, "a question of client {} about dataset {} is refused: {}", open.client,
       DatasetOf(open.question), status.message());
  Send(open.client, OrderRefused{.nonce = NonceOf(open.question), .status = Bounded(status)});
}

}  // namespace slabstream
