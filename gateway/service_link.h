// ServiceLink: a client of the service on a thread of its own, for those who must not wait. Each link is a client of its own to the
// service, which shares its workers fairly among clients.
//
// It connects by itself, at once and again after the service was gone. All that the gateway reads of the service comes through a link, and
// this is where rights to datasets are checked: by what the finished request reads, in whatever words it was asked for.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>
#include <vector>

#include "client/client.h"
#include "common/base/status.h"
#include "gateway/rights.h"

namespace slabstream {

class ServiceLink {
 public:
  using Ticket = std::uint64_t;
  using Inquiry = Merged<Question, std::variant<StatusQuery, SteerDataset>>;
  using Answer = Merged<QuestionReply, std::variant<StatusReply, SteerReply>>;
  using AnswerHandler = std::function<void(Result<Answer>)>;
  struct Rendered {
    std::vector<Picture> pictures;  // one for each frame
    std::optional<Answer> answer;   // to a question without frames
  };
  struct Handlers {
    std::function<void(const FrameProgress&)> progress = {};  // may be empty
    std::function<void(Result<Rendered>)> done;               // once, unless the ticket was cancelled before
  };

  // `context` and what the handlers use must outlive it.
  ServiceLink(Context& context, ServiceAddress address);
  ~ServiceLink();  // cancels what is open
  ServiceLink(const ServiceLink&) = delete;
  ServiceLink& operator=(const ServiceLink&) = delete;

  // Any thread. Renders `frames`, at least one, all at once; the first failure is that of all. The handlers are called on the link's
  // thread. Unavailable: the service does not answer. NotFound: there is no such dataset, or none that `asker` may read.
  Ticket Render(Asker asker, std::vector<FrameRequest> frames, Duration deadline, Handlers handlers);
  // Any thread. As Render; `done` is called on the link's thread, once, unless the ticket was cancelled before.
  Ticket Ask(Asker asker, Inquiry question, Duration deadline, AnswerHandler done);
  // Any thread. The handlers may still be called if they are about to be.
  void Cancel(Ticket ticket);
  // Any thread, returns at once: the link's thread begins to end. Then the destructor hardly waits.
  void RequestStop();

 private:
  struct Task {
    Ticket ticket = 0;
    Asker asker;
    std::vector<FrameRequest> frames = {};
    Duration deadline{};
    Handlers handlers;
    std::optional<Inquiry> question = {};  // instead of frames
  };
  struct OpenTask {
    Asker asker;
    Handlers handlers;
    std::vector<RequestId> requests;  // one for each frame, or that of the question
    Rendered rendered;
    std::size_t left = 0;  // requests that are not finished
  };

  Ticket Post(Task task);
  void Run();
  void Turn();
  void FailAll(const Status& why);  // ends every open task
  void Connect();
  void TakeOrders();
  void Begin(Task task);
  void Handle(ClientEvent event);
  void Forget(std::map<Ticket, OpenTask>::iterator task);  // cancels its frames
  void WakeUp();

  Context& context_;
  const ServiceAddress address_;
  // Used by the link's thread alone.
  std::map<Ticket, OpenTask> open_;
  std::map<RequestId, Ticket> requests_;
  Status reason_;  // why there is no client
  // Shared.
  std::mutex mutex_;
  std::condition_variable changed_;
  std::unique_ptr<Client> client_;  // made and ended by the link's thread; others use its wakeup only, under the mutex
  std::vector<Task> tasks_;
  std::vector<Ticket> cancelled_;
  Ticket last_ticket_ = 0;
  bool stopping_ = false;
  std::thread thread_;
};

// The datasets that a question reads.
std::vector<std::string> DatasetsOf(const ServiceLink::Inquiry& question);

}  // namespace slabstream
