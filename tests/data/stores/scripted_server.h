// An HTTP server on a loopback port of its own that answers as a test says, with bytes that need not make sense.
#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "tests/support/loopback_listener.h"

namespace slabstream {

struct ServerRequest {
  std::string method, target;
  std::map<std::string, std::string> headers;  // by their names in lower case

  // The value of a header; empty: there is none.
  std::string header(const std::string& name) const { return headers.contains(name) ? headers.at(name) : ""; }
};

class ScriptedServer {
 public:
  // The bytes of the answer; empty: the connection closes without one. Called on several threads at a time.
  using Script = std::function<std::string(const ServerRequest&)>;
  explicit ScriptedServer(Script script);
  ~ScriptedServer();

  std::string url() const;  // "http://127.0.0.1:PORT"
  std::uint16_t port() const { return listener_.port; }
  std::vector<ServerRequest> requests() const;  // so far
  int most_at_a_time() const { return most_at_a_time_; }

 private:
  void Serve(int connection);

  const Script script_;
  const LoopbackListener listener_ = ListenOnLoopback();
  mutable std::mutex mutex_;  // guards the next two
  std::vector<ServerRequest> requests_;
  std::set<int> connections_;  // each is served by a thread, which removes it
  std::condition_variable removed_;
  std::atomic<int> at_a_time_ = 0, most_at_a_time_ = 0;
  std::jthread accepting_;
};

// "HTTP/1.1 STATUS", the length of `body`, and `headers`, a line each.
std::string AnswerText(const std::string& status, const std::string& body, const std::string& headers = "");
// Answers with what lies in a folder, as web servers do: whole files, parts of them, sizes, or that a file is still the one that is known.
ScriptedServer::Script ServesFolder(const std::string& folder);

}  // namespace slabstream
