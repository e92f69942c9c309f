#include "coordinator/frames/clients.h"

#include <algorithm>
#include <utility>

namespace slabstream {

void ClientTable::Meet(PeerToken client, Time now) { clients_[client].last_heard = now; }

void ClientTable::Touch(PeerToken client, Time now) {
  const auto found = clients_.find(client);
  if (found != clients_.end()) found->second.last_heard = now;
}

bool ClientTable::Forget(PeerToken token) {
  const auto client = clients_.find(token);
  if (client == clients_.end()) return false;
  unread_of_all_ -= client->second.unread();
  clients_.erase(client);
  return true;
}

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

void ClientTable::Sent(PeerToken token, std::size_t bytes) {
  const auto client = clients_.find(token);
  if (client == clients_.end()) return;
  client->second.sent_bytes += bytes;
  unread_of_all_ += bytes;
}

void ClientTable::Read(PeerToken token, std::uint64_t bytes, std::uint64_t unsent) {
  const auto found = clients_.find(token);
  if (found == clients_.end()) return;
  Client& client = found->second;
  unread_of_all_ -= client.unread();
  if (!client.read_before) client.read_before = bytes - std::min(bytes, client.sent_bytes);
  const std::uint64_t left = client.sent_bytes - std::min(client.sent_bytes, unsent);
  client.read_bytes = std::min(left, bytes - std::min(bytes, *client.read_before));
  unread_of_all_ += client.unread();
}

bool ClientTable::IsBehind(PeerToken token) const {
  const auto client = clients_.find(token);
  if (client == clients_.end()) return false;
  const std::uint64_t unread = client->second.unread();
  return unread >= kMaxUnreadBytes ||
         (unread_of_all_ >= most_unread_ && unread >= std::max(most_unread_ / clients_.size(), kLeastUnreadPart));
}

void ClientTable::Keep(PeerToken token, Answer answer) {
  Client& client = clients_.at(token);
  client.answer_bytes += answer.payload.size();
  client.answers.push_back(std::move(answer));
  const std::size_t most_bytes = std::min(kMaxKeptAnswerBytes, kKeptAnswerBytesOfAll / clients_.size());
  while (client.answers.size() > kMaxKeptAnswers || client.answer_bytes > most_bytes) {
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
