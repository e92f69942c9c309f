#include <algorithm>
#include <utility>

#include "coordinator/dataset_machine_state.h"

namespace slabstream {

void DatasetMachine::State::Ask(PeerToken client, Question question) {
  const std::string& name = DatasetOf(question);
  OpenQuestion open{.client = client, .question = question};
  const auto of_client = std::ranges::count(questions, client, [](const auto& each) { return each.second.client; });
  if (std::size_t(of_client) >= kMaxOpenQuestions || questions.size() >= config.max_questions) {
    ++refused.over_quota;
    const bool own = std::size_t(of_client) >= kMaxOpenQuestions;
    return RefuseQuestion(
        open, Status::ResourceExhausted(fmt::format("{} questions are open, which is the limit of {}",
                                                    own ? std::size_t(of_client) : questions.size(), own ? "a client" : "the service")));
  }
  if (datasets.folders.empty() && datasets.Find(name) == nullptr) {
    ++refused.unknown_dataset;
    return RefuseQuestion(open, datasets.NoSuchDataset(name));
  }
  open.check = Seek(name);
  questions.emplace(++last_question, std::move(open));
}

// What can be answered now.
void DatasetMachine::State::AskExecutor() {
  for (auto& [id, open] : questions) {
    if (open.asked) continue;
    const DatasetTable::Entry& entry = *datasets.Find(DatasetOf(open.question));
    if (entry.state != DatasetState::kReady || !entry.checks.IsOver(open.check)) continue;
    open.asked = true;
    actions.emplace_back(AnswerQuestion{id, open.question, entry.id, entry.summary});
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
