#include "client/owner/owner_machine.h"

#include <algorithm>
#include <utility>

#include "common/base/overloaded.h"

namespace slabstream {

void OwnerMachine::Forget() {
  epoch_ = told_ = 0;
  next_send_ = {};
  used_.clear();
  hold_ = 0;
  looked_at_ = false;
}

void OwnerMachine::Hear(CoordinatorToOwner message, Time now) {
  heard_ = now;
  std::visit(Overloaded{[&](const OwnerWelcome& m) {
                          if (m.incarnation != registration_.incarnation) return;
                          epoch_ = m.epoch;
                          refused_since_.reset();
                          heartbeat_ = std::chrono::milliseconds(m.heartbeat_ms);
                          timeout_ = std::chrono::milliseconds(m.timeout_ms);
                          next_send_ = now;
                        },
                        [&](OwnerPong& m) {
                          if (m.epoch != epoch_) return;
                          std::ranges::sort(m.used);
                          if (m.hold != hold_) next_send_ = now;
                          used_ = std::move(m.used);
                          hold_ = m.hold;
                          looked_at_ = m.looked_at;
                        },
                        [&](const OwnerSteered& m) {
                          if (m.epoch != epoch_ || m.values.size() != registration_.steered.size()) return;
                          for (std::size_t i = 0; i < m.values.size(); ++i) registration_.steered[i].value = m.values[i];
                        },
                        [&](OwnerRefused& m) {
                          if (m.incarnation != registration_.incarnation) return;
                          if (!refused_since_) refused_since_ = now;
                          if (m.status.code() == StatusCode::kUnavailable && now < *refused_since_ + kOthersLeave) return;
                          refused_ = std::move(m.status);
                        },
                        [&](const Retire&) {
                          if (epoch_ != 0) Forget();
                        },
                        [](const ChunkRequest&) {}},
             message);
}

std::vector<OwnerToCoordinator> OwnerMachine::Say(Time now, bool making) {
  if (epoch_ != 0 && now >= heard_ + timeout_) Forget();
  if (!refused_.ok()) return {};
  std::vector<OwnerToCoordinator> said;
  const bool beats = now >= next_send_;
  // Repeated, since a connection that ends may have lost it.
  if (epoch_ != 0 && latest_ != 0 && (beats || latest_ > told_)) said.emplace_back(OwnerTime{epoch_, latest_, simulated_});
  told_ = latest_;
  if (!beats) return said;
  next_send_ = now + heartbeat_;
  if (epoch_ != 0) {
    said.emplace_back(OwnerPing{.epoch = epoch_, .hold = hold_, .gone = gone_, .making = making});
  } else {
    said.emplace_back(registration_);
  }
  return said;
}

std::optional<std::uint32_t> OwnerMachine::FreeSlot() const {
  std::optional<std::uint32_t> oldest;
  for (std::uint32_t slot = 0; slot < slots_; ++slot) {
    const std::uint64_t time = times_.at(slot);
    const bool in_use = std::ranges::binary_search(used_, time) || (hold_ != 0 && !used_.empty() && time > used_.back());
    if (time != 0 && (time == latest_ || in_use)) continue;
    if (!oldest || time < times_.at(*oldest)) oldest = slot;
  }
  return oldest;
}

std::uint64_t OwnerMachine::Begin(std::uint32_t slot) {
  const std::uint64_t freed = std::exchange(times_.at(slot), 0);
  gone_ = std::max(gone_, freed);
  return freed;
}

void OwnerMachine::Commit(std::uint32_t slot, std::uint64_t time, double simulated) {
  times_.at(slot) = latest_ = time;
  simulated_ = simulated;
}

}  // namespace slabstream
