#include <algorithm>
#include <utility>

#include "coordinator/datasets/dataset_machine_state.h"

namespace slabstream {
namespace {

// The picture that a question is about; null: it is about the dataset.
FrameRequest* FrameOf(Question& question) {
  if (auto* pick = std::get_if<PickQuery>(&question)) return &pick->frame;
  if (auto* view = std::get_if<ViewQuery>(&question)) return &view->frame;
  return nullptr;
}

}  // namespace

void DatasetMachine::State::Ask(PeerToken client, Question question) {
  if (FrameRequest* const frame = FrameOf(question)) *frame = WithOverlayAsField(std::move(*frame));
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
  if (IsPart(name) || (datasets.folders.empty() && datasets.Find(name) == nullptr)) {
    ++refused.unknown_dataset;
    return RefuseQuestion(open, datasets.NoSuchDataset(name));
  }
  open.check = Seek(name);
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
  return Status::Ok();
}

// Of a dataset that is open: the question waits for the first field that it is about. Errors of FieldsToShow and TimeToShow.
Status DatasetMachine::State::FindField(OpenQuestion& open) {
  const FrameRequest picture = PictureOf(open.question);
  Result<ShownAtTime> shown = WhatShows(picture, datasets.Find(open.entry)->fields);
  if (!shown.ok()) return shown.status();
  open.fields = std::move(shown->fields);
  open.fields.others.clear();  // the question is about the first one
  const auto& fields = open.fields.dataset->fields;
  const auto overlay = std::ranges::find(fields, false, &FieldInfo::channel);
  const bool of_points = std::holds_alternative<SampleQuery>(open.question) || std::holds_alternative<PickQuery>(open.question);
  if (of_points && overlay != fields.end()) {
    open.overlay = SourceOf(picture.dataset, int(overlay - fields.begin()), shown->time);
    open.overlay_check = Seek(open.overlay);
  }
  const std::string source = SourceOf(picture.dataset, open.fields.volume, shown->time);
  if (source == open.entry) return Status::Ok();
  open.entry = source;
  open.check = Seek(source);
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
      return is_there(question.entry, question.check) && (question.overlay.empty() || is_there(question.overlay, question.overlay_check));
    };
    if (open.asked || !can_be_asked(open)) continue;
    if (open.fields.dataset == nullptr) {
      if (const Status found = FindField(open); !found.ok()) {
        wrong.emplace_back(id, found);
        continue;
      }
      if (!can_be_asked(open)) continue;
    }
    if (!open.overlay.empty() && datasets.Find(open.overlay)->levels != nullptr) {
      open.overlay = LevelName(open.overlay, 0);
      open.overlay_check = Seek(open.overlay);
      if (!can_be_asked(open)) continue;
    }
    const std::shared_ptr<const VolumeLevels> levels = datasets.Find(open.entry)->levels;
    const bool about_view = std::holds_alternative<ViewQuery>(open.question);
    std::shared_ptr<const VolumeSummary> summary;
    if (levels != nullptr && std::holds_alternative<SummaryQuery>(open.question)) {
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
    open.asked = true;
    AnswerQuestion ask{id,         open.question, entry.id, summary != nullptr ? summary : entry.summary, about_view ? levels : nullptr,
                       open.fields};
    if (!open.overlay.empty()) {
      ask.overlay = datasets.Find(open.overlay)->id;
      ask.overlay_summary = datasets.Find(open.overlay)->summary;
    }
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
