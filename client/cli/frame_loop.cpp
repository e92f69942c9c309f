#include "client/cli/frame_loop.h"

#include <fmt/format.h>

#include <chrono>
#include <deque>
#include <future>
#include <map>
#include <optional>
#include <thread>
#include <utility>

#include "client/cli/interrupt.h"
#include "client/cli/progress.h"
#include "common/cli/program.h"

namespace slabstream {
namespace {

using std::chrono::milliseconds;

class FrameLoop {
 public:
  FrameLoop(Client& client, const std::vector<FrameJob>& jobs, const FrameLoopOptions& options)
      : client_(client), jobs_(jobs), options_(options), bar_(options.progress, double(jobs.size())) {}

  Status Run() {
    const InterruptGuard interrupt(client_.wakeup());
    while (!Done()) {
      if (interrupt.interrupted()) return Abandon(Status::Cancelled("interrupted"));
      SubmitAhead();
      // A task that ends wakes this up too. The timeout is for one that ends just as a message arrives.
      if (auto event = client_.Next(milliseconds(50))) {
        if (Status status = Handle(*std::move(event)); !status.ok()) return Abandon(std::move(status));
      }
      while (!tasks_.empty() && tasks_.front().result.wait_for(milliseconds(0)) == std::future_status::ready) {
        if (Status status = EndTask(); !status.ok()) return Abandon(std::move(status));
      }
      PutPictures();
    }
    return Status::Ok();
  }

  std::vector<FrameRecord> TakeRecords() {
    std::vector<FrameRecord> records;
    for (auto& [index, record] : records_) records.push_back(std::move(record));
    return records;
  }

 private:
  // A call of the sink, on a thread of its own.
  struct Task {
    std::future<Status> result;
    std::jthread thread;
  };

  bool Done() const {
    const bool rendered = next_ == jobs_.size() && open_.empty();
    return rendered && tasks_.empty() && (options_.pictures == nullptr || finishing_);
  }

  // Pictures that wait to be put count too, so that neither frames nor memory run ahead of the sink.
  void SubmitAhead() {
    const std::size_t limit = std::size_t(options_.in_flight);
    while (next_ < jobs_.size() && open_.size() < limit && waiting_.size() + tasks_.size() < limit) {
      FrameRequest request = jobs_[next_].request;
      request.straight8 = false;
      if (options_.pictures != nullptr) options_.pictures->ChooseCodes(jobs_[next_], request);
      open_[client_.Submit(request)] = next_;
      ++next_;
    }
  }

  Status Handle(ClientEvent event) {
    const Time received = MonotonicNow();
    const auto found = open_.find(event.request);
    if (found == open_.end()) return Status::Ok();
    const std::size_t index = found->second;
    if (const auto* progress = std::get_if<FrameProgress>(&event.what)) {
      const double part = progress->group_count == 0 ? 0 : double(progress->groups_done) / progress->group_count;
      Show(index, part, Describe(*progress, jobs_[index].source));
      return Status::Ok();
    }
    if (const auto* failure = std::get_if<Status>(&event.what)) {
      open_.erase(found);
      return PassOver(index, *failure);
    }
    auto& picture = std::get<Picture>(event.what);
    // A preview is put at once, so that it cannot come after the final picture.
    if (!picture.final) return options_.pictures == nullptr ? Status::Ok() : options_.pictures->Put(picture, jobs_[index]);
    open_.erase(found);
    FrameDone(index);
    failed_in_a_row_ = 0;
    const std::string& lowered = picture.statistics.lowered;
    if (!lowered.empty() && !std::exchange(told_lowered_, true)) PrintWarning(lowered);
    const std::string& missing = picture.statistics.missing;
    if (missing != std::exchange(told_missing_, missing) && !missing.empty()) PrintWarning(missing);
    std::vector<RankReport> reports = std::exchange(picture.statistics.reports, {});  // many, which the sink does not need
    FrameRecord& record = records_[index];
    record = {jobs_[index].output, picture.latency, received, picture.statistics, picture.image.IsEmpty(), picture.direct};
    if (options_.keep_reports) record.statistics.reports = std::move(reports);
    if (options_.pictures != nullptr) waiting_.emplace(index, std::move(picture));
    return Status::Ok();
  }

  // `part`: of a frame that is not done.
  void Show(std::size_t index, double part, const std::string& what) {
    const std::string label = options_.label.empty() ? "" : options_.label + ": ";
    bar_.Show(frames_done_ + part, fmt::format("{}frame {} of {}: {}", label, index + 1, jobs_.size(), what));
  }
  void FrameDone(std::size_t index) {
    ++frames_done_;
    Show(index, 0, "done");
  }

  // Ok: the loop goes on without this frame.
  Status PassOver(std::size_t index, const Status& failure) {
    constexpr int kMostInARow = 2;
    if (options_.failures == nullptr || index == 0 || records_.empty() || ++failed_in_a_row_ > kMostInARow) return failure;
    options_.failures->emplace_back(
        failure.code(), fmt::format("frame {} of {} ({}): {}", index + 1, jobs_.size(), jobs_[index].output, failure.message()));
    FrameDone(index);
    if (options_.pictures != nullptr) waiting_.emplace(index, std::nullopt);
    return Status::Ok();
  }

  void PutPictures() {
    PictureSink* const pictures = options_.pictures;
    if (pictures == nullptr) return;
    while (!waiting_.empty() && (!pictures->in_order() || (waiting_.begin()->first == put_ && tasks_.empty()))) {
      auto first = waiting_.extract(waiting_.begin());
      ++put_;
      StartTask([pictures, &job = jobs_[first.key()], picture = std::move(first.mapped())] {
        return picture ? pictures->Put(*picture, job) : pictures->Skip(job);
      });
    }
    if (put_ == jobs_.size() && tasks_.empty() && !std::exchange(finishing_, true)) {
      StartTask([pictures] { return pictures->Finish(); });
    }
  }

  template <class Function>
  void StartTask(Function function) {
    std::packaged_task<Status()> task(std::move(function));
    std::future<Status> result = task.get_future();
    tasks_.push_back({std::move(result), std::jthread([this, task = std::move(task)]() mutable {
                        task();
                        client_.wakeup().Notify();
                      })});
  }

  Status EndTask() {
    Status status = tasks_.front().result.get();
    tasks_.pop_front();
    return status;
  }

  // Lets the service free its workers, and gives the message some time to leave.
  Status Abandon(Status why) {
    if (options_.pictures != nullptr) options_.pictures->Abandon();
    for (const auto& [request, index] : open_) client_.Cancel(request);
    const Time deadline = MonotonicNow() + std::chrono::seconds(2);
    while (!open_.empty() && MonotonicNow() < deadline) {
      const auto event = client_.Next(milliseconds(100));
      if (event && !std::holds_alternative<FrameProgress>(event->what)) open_.erase(event->request);
    }
    return why;
  }

  Client& client_;
  const std::vector<FrameJob>& jobs_;
  const FrameLoopOptions& options_;
  ProgressBar bar_;
  int frames_done_ = 0;
  std::map<std::size_t, FrameRecord> records_;             // of pictures, by the job's index
  int failed_in_a_row_ = 0;                                // frames since the last picture
  bool told_lowered_ = false;                              // once; it is much the same of all frames
  std::string told_missing_;                               // last
  std::size_t next_ = 0;                                   // of jobs_: the first that has not been requested yet
  std::map<RequestId, std::size_t> open_;                  // to the job's index
  std::map<std::size_t, std::optional<Picture>> waiting_;  // to be put, by the job's index; nullopt: it has failed
  std::size_t put_ = 0;                                    // pictures that have been given to the sink
  bool finishing_ = false;                                 // the sink's Finish has been called
  std::deque<Task> tasks_;                                 // oldest first
};

}  // namespace

Result<std::vector<FrameRecord>> RenderFrames(Client& client, const std::vector<FrameJob>& jobs, const FrameLoopOptions& options) {
  FrameLoop loop(client, jobs, options);
  if (Status status = loop.Run(); !status.ok()) return status;
  return loop.TakeRecords();
}

}  // namespace slabstream
