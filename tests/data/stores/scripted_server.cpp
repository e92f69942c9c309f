#include "tests/data/stores/scripted_server.h"

#include <fmt/format.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <iterator>
#include <utility>

#include "common/base/check.h"
#include "tests/support/whole_file.h"

namespace slabstream {

ScriptedServer::ScriptedServer(Script script) : script_(std::move(script)) {
  accepting_ = std::jthread([this] {
    for (int connection = 0; (connection = ::accept4(listener_.socket, nullptr, nullptr, SOCK_CLOEXEC)) >= 0;) {
      {
        const std::lock_guard lock(mutex_);
        connections_.insert(connection);
      }
      std::thread([this, connection] {
        Serve(connection);
        const std::lock_guard lock(mutex_);
        connections_.erase(connection);
        ::close(connection);
        removed_.notify_all();
      }).detach();
    }
  });
}

ScriptedServer::~ScriptedServer() {
  ::shutdown(listener_.socket, SHUT_RDWR);
  accepting_.join();
  {
    std::unique_lock lock(mutex_);
    for (const int connection : connections_) ::shutdown(connection, SHUT_RDWR);
    removed_.wait(lock, [this] { return connections_.empty(); });
  }
  ::close(listener_.socket);
}

std::string ScriptedServer::url() const { return fmt::format("http://127.0.0.1:{}", port()); }

std::vector<ServerRequest> ScriptedServer::requests() const {
  const std::lock_guard lock(mutex_);
  return requests_;
}

void ScriptedServer::Serve(int connection) {
  std::string read;
  while (true) {
    std::size_t end = 0;
    while ((end = read.find("\r\n\r\n")) == std::string::npos) {
      char buffer[4096];
      const ssize_t bytes = ::recv(connection, buffer, sizeof buffer, 0);
      if (bytes <= 0) return;
      read.append(buffer, std::size_t(bytes));
    }
    const std::string head = read.substr(0, end + 2);
    read.erase(0, end + 4);
    const std::size_t first = head.find(' '), second = head.find(' ', first + 1);
    ServerRequest request{head.substr(0, first), head.substr(first + 1, second - first - 1), {}};
    for (std::size_t begin = head.find("\r\n") + 2; begin < head.size();) {
      const std::size_t line_end = head.find("\r\n", begin), colon = head.find(": ", begin);
      std::string name = head.substr(begin, colon - begin);
      std::ranges::transform(name, name.begin(), [](unsigned char c) { return char(std::tolower(c)); });
      request.headers[name] = head.substr(colon + 2, line_end - colon - 2);
      begin = line_end + 2;
    }
    const int at_a_time = ++at_a_time_;
    for (int most = most_at_a_time_; at_a_time > most && !most_at_a_time_.compare_exchange_weak(most, at_a_time);) {
    }
    {
      const std::lock_guard lock(mutex_);
      requests_.push_back(request);
    }
    const std::string answer = script_(request);
    --at_a_time_;
    if (answer.empty() || ::send(connection, answer.data(), answer.size(), MSG_NOSIGNAL) != ssize_t(answer.size())) break;
    if (answer.find("Connection: close") != std::string::npos) break;
  }
  ::shutdown(connection, SHUT_RDWR);
}

std::string AnswerText(const std::string& status, const std::string& body, const std::string& headers) {
  return fmt::format("HTTP/1.1 {}\r\nContent-Length: {}\r\n{}\r\n{}", status, body.size(), headers, body);
}

ScriptedServer::Script ServesFolder(const std::string& folder) {
  return [folder](const ServerRequest& request) -> std::string {
    const std::string path = folder + request.target;
    if (!std::filesystem::is_regular_file(path)) return AnswerText("404 Not Found", "nothing here");
    const std::string all = ReadFile(path);
    const std::string tag = fmt::format("ETag: \"{:x}\"\r\n", std::hash<std::string>()(all));
    if (request.method == "HEAD") return fmt::format("HTTP/1.1 200 OK\r\nContent-Length: {}\r\n{}\r\n", all.size(), tag);
    if (tag == "ETag: " + request.header("if-none-match") + "\r\n") return AnswerText("304 Not Modified", "", tag);
    const std::string range = request.header("range");
    if (range.empty()) return AnswerText("200 OK", all, tag);
    std::size_t begin = 0, last = 0;
    CHECK_EQ(std::sscanf(range.c_str(), "bytes=%zu-%zu", &begin, &last), 2) << range;
    if (begin >= all.size()) return AnswerText("416 Range Not Satisfiable", "", fmt::format("Content-Range: bytes */{}\r\n", all.size()));
    last = std::min(last, all.size() - 1);
    return AnswerText("206 Partial Content", all.substr(begin, last + 1 - begin),
                      fmt::format("Content-Range: bytes {}-{}/{}\r\n{}", begin, last, all.size(), tag));
  };
}

}  // namespace slabstream
