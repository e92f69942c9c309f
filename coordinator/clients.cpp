#include "coordinator/clients.h"

#include <algorithm>
#include <utility>

namespace slabstream {

void ClientTable::Meet(PeerToken client, Time now) { clients_[client].last_heard = now; }

void ClientTable::Touch(PeerToken client, Time now) {
  const auto found = clients_.find(client);
  if (found != clients_.end()) found->second.last_heard = now;
}

bool ClientTable::Forget(PeerToken client) { return clients_.erase(client) > 0; }

void ClientTable::Postpone(Duration duration) {
  for (auto& [token, client] : clients_) client.last_heard += duration;
}

std::vector<PeerToken> ClientTable::Silent(Time now) const {
  std::vector<PeerToken> silent;
  for (const auto& [token, client] : clients_) {
    if (now >= client.last_heard + timeout_) silent.push_back(token);
  }
  return silent;
}

Time ClientTable::NextWake() const {
  Time wake = Time::max();
  for (const auto& [token, client] : clients_) wake = std::min(wake, client.last_heard + timeout_);
  return wake;
}

void ClientTable::Keep(PeerToken token, Answer answer) {
  Client& client = clients_.at(token);
  client.answer_bytes += answer.payload.size();
  client.answers.push_back(std::move(answer));
  while (client.answers.size() > kMaxKeptAnswers || client.answer_bytes > kMaxKeptAnswerBytes) {
    client.answer_bytes -= client.answers.front().payload.size();
    client.answers.pop_front();
  }
}

Answer* ClientTable::FindAnswer(PeerToken token, RequestId request) {
  const auto client = clients_.find(token);
  if (client == clients_.end()) return nullptr;
  auto& answers = client->second.answers;
  const auto answer = std::ranges::find(answers, request, &Answer::request);
  return answer == answers.end() ? nullptr : &*answer;
}

}  // namespace slabstream
