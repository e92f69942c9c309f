#include <algorithm>
#include <utility>

#include "coordinator/datasets/dataset_machine_state.h"

namespace slabstream {
namespace {

// The picture that a question is about; null: it is about the dataset.
FrameRequest* FrameOf(Question& question) {
  if (auto* pick = std::get_if<PickQuery>(&question)) return &pick->frame;
  return nullptr;
}

}  // namespace

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
  if (IsLevelName(name) || (datasets.folders.empty() && datasets.Find(name) == nullptr)) {
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
    const Result<ChosenView> chosen = ChooseView(*frame, levels.levels.front().geometry, levels.overview);
    if (!chosen.ok()) return chosen.status();
    frame->view = chosen->view;
    const Result<LevelMap> drawn = LevelsOf(*frame, levels);
    if (!drawn.ok()) return drawn.status();
    level = drawn->levels.front();
    *frame = AtLevel(*frame, levels.levels.front().geometry, levels.levels[std::size_t(level)].geometry);
  }
  open.entry = LevelName(open.entry, level);
  open.check = Seek(open.entry);
  return Status::Ok();
}

// What can be answered now.
void DatasetMachine::State::AskExecutor() {
  std::vector<std::pair<QuestionId, Status>> wrong;
  for (auto& [id, open] : questions) {
    const auto can_be_asked = [this](const OpenQuestion& question) {
      const DatasetTable::Entry& entry = *datasets.Find(question.entry);
      return entry.state == DatasetState::kReady && entry.checks.IsOver(question.check);
    };
    if (open.asked || !can_be_asked(open)) continue;
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
    actions.emplace_back(
        AnswerQuestion{id, open.question, entry.id, summary != nullptr ? summary : entry.summary, about_view ? levels : nullptr});
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
