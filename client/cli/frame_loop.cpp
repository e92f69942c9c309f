#include "client/cli/frame_loop.h"

#include <chrono>
#include <deque>
#include <future>
#include <map>
#include <utility>

#include "client/cli/interrupt.h"
#include "client/cli/picture_record.h"
#include "client/cli/progress_display.h"

namespace slabstream {
namespace {

using std::chrono::milliseconds;

class FrameLoop {
 public:
  FrameLoop(Client& client, const std::vector<FrameJob>& jobs, const FrameLoopOptions& options)
      : client_(client),
        jobs_(jobs),
        options_(options),
        display_(options.progress, int(jobs.size()), options.label),
        records_(jobs.size()) {}

  Status Run() {
    const InterruptGuard interrupt(client_.wakeup());
    while (next_ < jobs_.size() || !open_.empty()) {
      if (interrupt.interrupted()) return Abandon(Status::Cancelled("interrupted"));
      SubmitAhead();
      // A finished write ends the wait too. The timeout is for a write that finishes just as a message arrives.
      if (auto event = client_.Next(milliseconds(50))) {
        if (Status status = Handle(*std::move(event)); !status.ok()) return Abandon(std::move(status));
      }
      while (!writes_.empty() && writes_.front().wait_for(milliseconds(0)) == std::future_status::ready) {
        if (Status status = FinishWrite(); !status.ok()) return Abandon(std::move(status));
      }
    }
    while (!writes_.empty()) {
      if (Status status = FinishWrite(); !status.ok()) return status;
    }
    return Status::Ok();
  }

  std::vector<FrameRecord> TakeRecords() { return std::move(records_); }

 private:
  // Pictures that wait to be written count too, so that neither frames nor memory run ahead of the disk.
  void SubmitAhead() {
    const std::size_t limit = std::size_t(options_.in_flight);
    while (next_ < jobs_.size() && open_.size() < limit && writes_.size() < limit) {
      open_[client_.Submit(jobs_[next_].request)] = next_;
      ++next_;
    }
  }

  Status Handle(ClientEvent event) {
    const auto found = open_.find(event.request);
    if (found == open_.end()) return Status::Ok();
    const std::size_t index = found->second;
    if (const auto* progress = std::get_if<FrameProgress>(&event.what)) {
      display_.Show(int(index), *progress);
      return Status::Ok();
    }
    if (auto* failure = std::get_if<Status>(&event.what)) {
      open_.erase(found);
      return std::move(*failure);
    }
    auto& picture = std::get<Picture>(event.what);
    // Written at once, so that it cannot come after the final picture in the same file.
    if (!picture.final) return Write(picture, jobs_[index]);
    open_.erase(found);
    display_.FrameDone(int(index));
    FrameRecord& record = records_[index];
    record = {jobs_[index].output, picture.latency, std::move(picture.statistics)};
    if (!options_.keep_reports) record.statistics.reports = {};
    if (record.output.empty()) return Status::Ok();
    writes_.push_back(std::async(std::launch::async, [this, picture = std::move(picture), index] {
      Status status = Write(picture, jobs_[index]);
      client_.wakeup().Notify();
      return status;
    }));
    return Status::Ok();
  }

  Status Write(const Picture& picture, const FrameJob& job) const {
    PictureNotes notes{.geometry = picture.geometry, .record = {}};
    if (!options_.source.empty())
      notes.record = RecordText(options_.source, job.request, options_.format, picture.geometry, options_.layers);
    return WritePicture(picture.image, picture.size, job.output, options_.format, notes);
  }

  Status FinishWrite() {
    Status status = writes_.front().get();
    writes_.pop_front();
    return status;
  }

  // Lets the service free its workers, and gives the message some time to leave.
  Status Abandon(Status why) {
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
  ProgressDisplay display_;
  std::vector<FrameRecord> records_;
  std::size_t next_ = 0;                    // of jobs_: the first that has not been requested yet
  std::map<RequestId, std::size_t> open_;   // to the job's index
  std::deque<std::future<Status>> writes_;  // oldest first
};

}  // namespace

Result<std::vector<FrameRecord>> RenderFrames(Client& client, const std::vector<FrameJob>& jobs, const FrameLoopOptions& options) {
  FrameLoop loop(client, jobs, options);
  if (Status status = loop.Run(); !status.ok()) return status;
  return loop.TakeRecords();
}

}  // namespace slabstream
