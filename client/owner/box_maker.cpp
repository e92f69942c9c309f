#include "client/owner/box_maker.h"

#include <algorithm>

#include "common/base/printable.h"
#include "common/threads/guarded.h"
#include "data/sources/copy_samples.h"

namespace slabstream {

BoxMaker::BoxMaker(std::shared_ptr<OwnerMemory> memory, std::shared_ptr<const MappedOwner> own, std::uint64_t most_bytes, MakeBox make,
                   std::function<void()> answered)
    : memory_(std::move(memory)),
      own_(std::move(own)),
      most_bytes_(most_bytes),
      make_(std::move(make)),
      answered_(std::move(answered)),
      thread_([this] { Run(); }) {}

BoxMaker::~BoxMaker() {
  {
    const std::lock_guard lock(mutex_);
    ends_ = true;
  }
  changed_.notify_all();
  thread_.join();
  std::unique_lock lock(mutex_);
  Drop(kept_.DropIf([](const auto&) { return true; }), lock);
}

void BoxMaker::SetTime(std::uint32_t slot, std::uint64_t time) {
  std::unique_lock lock(mutex_);
  times_[slot] = time;
  if (time == 0) Drop(kept_.DropIf([slot](const auto& entry) { return entry.key.first == slot; }), lock);
}

// Readers notice before samples are freed. They are freed without the mutex, since whoever made them may call this class then.
void BoxMaker::Drop(LruMap<Key, MadeBox>::Entries dropped, std::unique_lock<std::mutex>& lock) {
  for (const auto& each : dropped) memory_->Make(each.key.first, each.key.second, nullptr);
  lock.unlock();
  dropped.clear();
}

void BoxMaker::Ask(std::size_t box, const ChunkRequest& request) {
  {
    const std::lock_guard lock(mutex_);
    const auto slot = std::ranges::find_if(times_, [&](const auto& each) { return each.second == request.dataset; });
    const Key key(slot == times_.end() ? 0 : slot->first, box);
    if (slot != times_.end() && kept_.Find(key) == nullptr) {
      std::vector<ChunkRequest>& asked = asked_[key];
      asked.push_back(request);
      if (asked.size() == 1) order_.push_back(key);
      return changed_.notify_all();
    }
    answers_.push_back({request, SamplesOf(box, request)});
  }
  answered_();
}

std::vector<BoxMaker::Answer> BoxMaker::TakeAnswers() {
  const std::lock_guard lock(mutex_);
  return std::exchange(answers_, {});
}

bool BoxMaker::is_making() const {
  const std::lock_guard lock(mutex_);
  return !order_.empty();
}

// With the mutex, so that nothing is dropped meanwhile.
Result<Bytes> BoxMaker::SamplesOf(std::size_t box, const ChunkRequest& request) const {
  // In place one voxel tells whether the box is there.
  const Box part = request.in_place ? Box{request.box.begin, request.box.begin + Uniform(1)} : request.box;
  std::vector<std::byte> samples(std::size_t(part.voxel_count()) * BytesPerSample(own_->layout().samples));
  const Status read = own_->Read(box, part, 0, request.dataset, BoxRoom::Dense(part, samples.data(), true));
  if (!read.ok()) return read;
  return request.in_place ? Bytes() : Bytes(std::move(samples));
}

void BoxMaker::Run() {
  std::unique_lock lock(mutex_);
  while (true) {
    changed_.wait(lock, [this] { return ends_ || !order_.empty(); });
    if (ends_) return;
    const Key key = order_.front();
    const auto [slot, box] = key;
    const std::uint64_t time = times_[slot];
    lock.unlock();
    Result<MadeBox> made = Guarded("a box that was asked for", [&, box = box] { return make_(box, time); });
    lock.lock();
    LruMap<Key, MadeBox>::Entries dropped;
    if (made.ok()) {
      const HeldBox& held = own_->layout().boxes[box];
      kept_.Put(key, *std::move(made), std::uint64_t(held.held.voxel_count()) * BytesPerSample(own_->layout().samples));
      // It may have taken so long that the slot has another time.
      if (time == 0 || times_[slot] != time) dropped = kept_.Drop(key);
      if (dropped.empty()) memory_->Make(slot, box, kept_.Find(key)->get());
    }
    const auto asked = asked_.extract(key);
    for (const ChunkRequest& request : asked.mapped()) {
      answers_.push_back({request, made.ok() ? SamplesOf(box, request) : Result<Bytes>(Printable(made.status()))});
    }
    order_.pop_front();
    dropped.splice(dropped.end(), kept_.DropBeyond(most_bytes_));
    Drop(std::move(dropped), lock);
    answered_();
    lock.lock();
  }
}

}  // namespace slabstream
