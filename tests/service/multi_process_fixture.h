// MultiProcessTest: a coordinator and workers as processes of their own, over tcp, and a volume for them. SLABSTREAM_SEED=N repeats a run's
// choices.
#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <iterator>
#include <memory>
#include <optional>
#include <random>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "client/client.h"
#include "data/volume_io/volume_writer.h"
#include "tests/service/child_process.h"
#include "tests/service/pictures.h"
#include "tests/support/random.h"
#include "tests/support/temporary_directory.h"

namespace slabstream {

using std::chrono::seconds;
using testing::HasSubstr;

inline std::string FieldOf(const std::string& line, const std::string& key) {
  const std::size_t begin = line.find(key + "=");
  if (begin == std::string::npos) return {};
  const std::size_t value = begin + key.size() + 1;
  return line.substr(value, line.find(' ', value) - value);
}

class MultiProcessTest : public testing::Test {
 protected:
  MultiProcessTest() {
    std::cout << random_.trace() << std::endl;
    const Status written = WriteVolume(*volume_, (directory_ / "ball.nrrd").string());
    CHECK(written.ok()) << written.message();
  }
  ~MultiProcessTest() override {
    workers_.clear();
    coordinator_.reset();
  }

  void StartCoordinator(const std::string& listen = "tcp://127.0.0.1:*", const std::string& worker_listen = "tcp://127.0.0.1:*",
                        const std::vector<std::string>& more = {}) {
    std::vector<std::string> command = {SLABSTREAM_COORDINATOR_PROGRAM,
                                        "--listen",
                                        listen,
                                        "--worker-listen",
                                        worker_listen,
                                        "--data",
                                        "ball=" + (directory_ / "ball.nrrd").string(),
                                        "--log-level",
                                        "error"};
    command.insert(command.end(), more.begin(), more.end());
    coordinator_.emplace(command);
    const std::string ready = coordinator_->ReadLine();
    ASSERT_THAT(ready, HasSubstr("slabstream-coordinator ready"));
    client_endpoint_ = FieldOf(ready, "client");
    worker_endpoint_ = FieldOf(ready, "workers");
  }
  void StartWorker(const std::vector<std::string>& options = {}) {
    std::vector<std::string> command = {SLABSTREAM_WORKER_PROGRAM, "--coordinator", worker_endpoint_, "--log-level", "error"};
    command.insert(command.end(), options.begin(), options.end());
    workers_.emplace_back(command);
  }
  // It writes its log to a file, which WorkerLog reads.
  void StartLoggingWorker(const std::vector<std::string>& options = {}) {
    const std::string log = LogOf(workers_.size());
    std::vector<std::string> command = {
        "/bin/sh",     "-c",  "exec \"$0\" \"$@\" 2>'" + log + "'", SLABSTREAM_WORKER_PROGRAM, "--coordinator", worker_endpoint_,
        "--log-level", "info"};
    command.insert(command.end(), options.begin(), options.end());
    workers_.emplace_back(command);
  }
  std::string WorkerLog(std::size_t index) const {
    std::ifstream file(LogOf(index));
    return {std::istreambuf_iterator<char>(file), {}};
  }
  void KillWorker(std::size_t index) {
    workers_[index].Kill(SIGKILL);
    workers_[index].Wait();
    workers_.erase(workers_.begin() + std::ptrdiff_t(index));
  }
  Client Connect(const ClientTiming& timing = {}) {
    Result<Client> client = Client::Connect(context_, client_endpoint_, seconds(30), timing);
    CHECK(client.ok()) << client.status().message();
    return std::move(*client);
  }
  // Asks the service again and again until so many workers are registered: each answer is an event, nothing sleeps.
  void AwaitWorkers(Client& client, std::size_t count) {
    AwaitStatus(client, [count](const StatusReply& status) { return status.workers.size() >= count; });
  }
  template <class Condition>
  void AwaitStatus(Client& client, Condition&& condition) {
    const Time limit = MonotonicNow() + seconds(60);
    while (MonotonicNow() < limit) {
      const Result<StatusReply> status = client.QueryStatus(seconds(30));
      ASSERT_TRUE(status.ok()) << status.status().message();
      if (condition(*status)) return;
    }
    FAIL() << "the status that was waited for did not come within a minute";
  }
  // Waits for the end of a request; counts progress and previews and calls `at_event` at each.
  template <class Function>
  Result<Picture> Await(Client& client, RequestId id, Function&& at_event) {
    while (true) {
      std::optional<ClientEvent> event = client.Next(seconds(120));
      if (!event) return Status::DeadlineExceeded("no event for two minutes");
      if (event->request != id) continue;
      if (const auto* failure = std::get_if<Status>(&event->what)) return *failure;
      auto* picture = std::get_if<Picture>(&event->what);
      if (picture != nullptr && picture->final) return std::move(*picture);
      at_event();
    }
  }

  std::string LogOf(std::size_t worker) const { return (directory_ / ("worker-" + std::to_string(worker) + ".log")).string(); }

  Random random_{std::random_device{}()};
  const std::shared_ptr<const Volume> volume_ = TestSphere(64);
  TemporaryDirectory temporary_;
  const std::filesystem::path directory_ = temporary_.path();
  Context context_;
  std::optional<ChildProcess> coordinator_;
  std::vector<ChildProcess> workers_;
  std::string client_endpoint_, worker_endpoint_;
};

}  // namespace slabstream
