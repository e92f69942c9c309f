#include "data/stores/watched_object.h"

#include <future>
#include <mutex>
#include <utility>

namespace slabstream {
namespace {

class WatchedObject {
 public:
  WatchedObject(std::shared_ptr<Store> store, std::string key) : store_(std::move(store)), key_(std::move(key)) {}

  bool HasChanged(Time now) {
    constexpr std::chrono::seconds kPatience(1);
    const std::lock_guard lock(mutex_);
    if (changed_ || (!answer_.valid() && now < looked_ + kLookAgain)) return changed_;
    if (!answer_.valid()) {
      looked_ = now;
      answer_ = store_->HasChanged(key_);
    }
    if (answer_.wait_for(kPatience) == std::future_status::ready) {
      const Result<bool> answer = answer_.get();
      changed_ = answer.ok() ? *answer : answer.status().code() == StatusCode::kNotFound;
    }
    return changed_;
  }

 private:
  const std::shared_ptr<Store> store_;
  const std::string key_;
  std::mutex mutex_;  // guards what follows
  Time looked_ = MonotonicNow();
  std::future<Result<bool>> answer_;  // valid: of a look under way
  bool changed_ = false;
};

}  // namespace

std::shared_ptr<const FileStamp> WatchObject(std::shared_ptr<Store> store, std::string key) {
  const auto object = std::make_shared<WatchedObject>(std::move(store), std::move(key));
  return std::make_shared<const FileStamp>(FileStamp{.ask = [object](Time now) { return object->HasChanged(now); }});
}

}  // namespace slabstream
