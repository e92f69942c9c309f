#include <algorithm>
#include <utility>

#include "coordinator/frame_machine_state.h"

namespace slabstream {

void FrameMachine::State::Ask(PeerToken client, Question question) {
  const std::string& name = DatasetOf(question);
  OpenQuestion open{.client = client, .question = question};
  const auto of_client = std::ranges::count(questions, client, [](const auto& each) { return each.second.client; });
  if (std::size_t(of_client) >= kMaxOpenQuestions || questions.size() >= config.max_queued) {
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
  open.look = SeekData(name);
  questions.emplace(++last_question, std::move(open));
}

// What can be answered now.
void FrameMachine::State::AskExecutor() {
  std::vector<std::pair<QuestionId, Status>> hopeless;
  for (auto& [id, open] : questions) {
    if (open.asked) continue;
    const std::string& name = DatasetOf(open.question);
    const DatasetTable::Entry* const entry = datasets.Find(name);
    if (entry == nullptr) {
      ++refused.unknown_dataset;
      hopeless.emplace_back(id, datasets.NoSuchDataset(name));
    } else if (entry->awaited == 0 && entry->state == DatasetState::kReady && entry->looks.IsOver(open.look)) {
      open.asked = true;
      actions.emplace_back(AnswerQuestion{id, open.question, entry->id, entry->summary});
    }
  }
  for (const auto& [id, status] : hopeless) RefuseQuestion(questions.extract(id).mapped(), status);
}

void FrameMachine::State::On(const QuestionAnswered& event) {
  const auto open = questions.extract(event.question);
  if (!open.empty()) SendClient(open.mapped().client, event.answer);  // else its client has gone
}

bool FrameMachine::State::IsAskedAbout(const std::string& dataset) const {
  return std::ranges::any_of(questions, [&](const auto& each) { return !each.second.asked && DatasetOf(each.second.question) == dataset; });
}

void FrameMachine::State::RefuseQuestions(const std::string& dataset, const Status& status) {
  std::erase_if(questions, [&](const auto& each) {
    const OpenQuestion& open = each.second;
    if (open.asked || DatasetOf(open.question) != dataset) return false;
    RefuseQuestion(open, status);
    return true;
  });
}

void FrameMachine::State::RefuseQuestion(const OpenQuestion& open, const Status& status) {
  Tell(NoteAbout::kFrames, LogLevel::kInfo, "a question of client {} about dataset {} is refused: {}", open.client,
       DatasetOf(open.question), status.message());
  SendClient(open.client, OrderRefused{.nonce = NonceOf(open.question), .status = Bounded(status)});
}

}  // namespace slabstream
