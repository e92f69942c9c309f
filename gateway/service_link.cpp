#include "gateway/service_link.h"

#include <algorithm>
#include <type_traits>
#include <utility>

#include "common/base/log.h"
#include "common/threads/guarded.h"

namespace slabstream {
namespace {

constexpr Duration kConnectTimeout = std::chrono::seconds(1);
constexpr Duration kConnectPause = std::chrono::milliseconds(500);
constexpr Duration kIdle = std::chrono::seconds(5);

}  // namespace

ServiceLink::ServiceLink(Context& context, ServiceAddress address) : context_(context), address_(std::move(address)) {
  thread_ = std::thread([this] { Run(); });
}

ServiceLink::~ServiceLink() {
  RequestStop();
  thread_.join();
}

void ServiceLink::RequestStop() {
  const std::lock_guard lock(mutex_);
  stopping_ = true;
  WakeUp();
}

// With the mutex held.
void ServiceLink::WakeUp() {
  changed_.notify_one();
  if (client_ != nullptr) client_->wakeup().Notify();
}

ServiceLink::Ticket ServiceLink::Post(Task task) {
  const std::lock_guard lock(mutex_);
  const Ticket ticket = task.ticket = ++last_ticket_;
  tasks_.push_back(std::move(task));
  WakeUp();
  return ticket;
}

ServiceLink::Ticket ServiceLink::Render(Asker asker, std::vector<FrameRequest> frames, Duration deadline, Handlers handlers) {
  return Post({.asker = std::move(asker), .frames = std::move(frames), .deadline = deadline, .handlers = std::move(handlers)});
}

ServiceLink::Ticket ServiceLink::Ask(Asker asker, Inquiry question, Duration deadline, AnswerHandler done) {
  const auto answered = [done = std::move(done)](Result<Rendered> rendered) {
    done(rendered.ok() ? Result<Answer>(*std::move(rendered->answer)) : Result<Answer>(rendered.status()));
  };
  return Post({.asker = std::move(asker), .deadline = deadline, .handlers = {.done = answered}, .question = std::move(question)});
}

void ServiceLink::Cancel(Ticket ticket) {
  const std::lock_guard lock(mutex_);
  if (std::erase_if(tasks_, [&](const Task& task) { return task.ticket == ticket; }) > 0) return;
  cancelled_.push_back(ticket);
  WakeUp();
}

void ServiceLink::Run() {
  while (true) {
    {
      const std::lock_guard lock(mutex_);
      if (stopping_) break;
    }
    const Status done = Guarded("the link to the service", [this] { Turn(); });
    if (!done.ok()) FailAll(done);
  }
  while (!open_.empty()) Forget(open_.begin());
  const std::lock_guard lock(mutex_);
  client_.reset();
}

void ServiceLink::Turn() {
  if (client_ == nullptr) Connect();
  TakeOrders();
  if (client_ == nullptr) {
    std::unique_lock lock(mutex_);
    changed_.wait_for(lock, kConnectPause, [this] { return stopping_ || !tasks_.empty(); });
  } else if (std::optional<ClientEvent> event = client_->Next(kIdle)) {
    Handle(*std::move(event));
  }
}

void ServiceLink::FailAll(const Status& why) {
  LogError(why.message());
  while (!open_.empty()) {
    const auto done = std::move(open_.begin()->second.handlers.done);
    Forget(open_.begin());
    (void)Guarded("the link to the service", [&] { done(why); });  // it may lack memory, too
  }
}

void ServiceLink::Connect() {
  Result<Client> client = Client::Connect(context_, address_, kConnectTimeout, {}, [this] {
    const std::lock_guard lock(mutex_);
    return stopping_;
  });
  reason_ = client.status();
  if (!client.ok()) return;
  const std::lock_guard lock(mutex_);
  client_ = std::make_unique<Client>(*std::move(client));
}

void ServiceLink::TakeOrders() {
  std::vector<Task> tasks;
  std::vector<Ticket> cancelled;
  {
    const std::lock_guard lock(mutex_);
    std::swap(tasks, tasks_);
    std::swap(cancelled, cancelled_);
  }
  for (const Ticket ticket : cancelled) {
    if (const auto found = open_.find(ticket); found != open_.end()) Forget(found);
  }
  for (Task& task : tasks) {
    if (client_ != nullptr) {
      Begin(std::move(task));
    } else {
      task.handlers.done(Status::Unavailable(reason_.message()));
    }
  }
}

void ServiceLink::Begin(Task task) {
  Status may = task.question ? task.asker.MayRead(DatasetsOf(*task.question)) : Status::Ok();
  for (const FrameRequest& frame : task.frames) may = may.ok() ? task.asker.MayRead(DatasetsOf(frame)) : may;
  if (!may.ok()) return task.handlers.done(std::move(may));
  OpenTask& open = open_[task.ticket];
  open.asker = std::move(task.asker);
  open.handlers = std::move(task.handlers);
  open.rendered.pictures.resize(task.frames.size());
  for (const FrameRequest& frame : task.frames) open.requests.push_back(client_->Submit(frame, task.deadline));
  if (task.question) {
    const auto submit = [&](auto& question) { return client_->Submit(std::move(question), task.deadline); };
    open.requests.push_back(std::visit(submit, *task.question));
  }
  open.left = open.requests.size();
  for (const RequestId request : open.requests) requests_[request] = task.ticket;
}

void ServiceLink::Handle(ClientEvent event) {
  const auto request = requests_.find(event.request);
  if (request == requests_.end()) return;
  const auto found = open_.find(request->second);
  OpenTask& task = found->second;
  if (const auto* progress = std::get_if<FrameProgress>(&event.what)) {
    if (task.handlers.progress) task.handlers.progress(*progress);
    return;
  }
  if (auto* failure = std::get_if<Status>(&event.what)) {
    Status status = ShownStatus(std::move(*failure), task.asker.access);
    requests_.erase(request);
    const auto done = std::move(task.handlers.done);
    Forget(found);
    return done(std::move(status));
  }
  if (auto* picture = std::get_if<Picture>(&event.what)) {
    if (!picture->final) return;
    const auto place = std::ranges::find(task.requests, event.request) - task.requests.begin();
    task.rendered.pictures[std::size_t(place)] = std::move(*picture);
  } else if (auto* status = std::get_if<StatusReply>(&event.what)) {
    task.rendered.answer = std::move(*status);
  } else if (auto* steered = std::get_if<SteerReply>(&event.what)) {
    task.rendered.answer = std::move(*steered);
  } else {
    task.rendered.answer = Widen<Answer>(std::get<QuestionReply>(std::move(event.what)));
  }
  requests_.erase(request);
  if (--task.left > 0) return;
  OpenTask finished = std::move(task);
  open_.erase(found);
  finished.handlers.done(std::move(finished.rendered));
}

void ServiceLink::Forget(std::map<Ticket, OpenTask>::iterator task) {
  for (const RequestId id : task->second.requests) {
    if (requests_.erase(id) > 0) client_->Cancel(id);
  }
  open_.erase(task);
}

std::vector<std::string> DatasetsOf(const ServiceLink::Inquiry& question) {
  const auto of = []<class Query>(const Query& query) -> std::vector<std::string> {
    if constexpr (requires { query.frame; }) return DatasetsOf(query.frame);
    if constexpr (requires { query.dataset; }) return {query.dataset};
    static_assert(
        requires { query.frame; } || requires { query.dataset; } || std::is_same_v<Query, StatusQuery>);
    return {};
  };
  return std::visit(of, question);
}

}  // namespace slabstream
