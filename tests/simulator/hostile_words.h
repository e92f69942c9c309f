// HostileWords: what peers say that were let in and keep to no protocol. All of it can be decoded: messages of other peers said again, by
// others and elsewhere; unknown ids; the ids of others; numbers at the ends of their range. Three things they do not do. Only a worker's
// own connection knows its incarnation. Nobody says false things of images that are its own to make, since nothing protects from that
// (docs/security.md). And nobody ends the service, which is a client's right.
#pragma once

#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "common/memory/bytes.h"
#include "common/wire/any_message.h"
#include "tests/support/random.h"

namespace slabstream {

class HostileWords {
 public:
  explicit HostileWords(Random& random) : random_(random) {}

  struct Speaker {
    Epoch epoch = 0;  // the coordinator's epoch
    WorkerId worker = 0;
    Incarnation incarnation = 0;  // 0: it is no worker
    std::uint32_t node = 0;
  };
  template <class Messages>
  struct Words {
    Messages message;
    Bytes payload;
  };

  // From now on it may be said again.
  void Overhear(const WorkerToCoordinator& message);
  void Overhear(const PartialImage& image, const Bytes& payload);

  ClientToCoordinator OfClient(const Policy& policy);
  Words<WorkerToCoordinator> OfWorker(const Speaker& self, std::uint32_t nodes);  // `nodes`: workers that there ever were
  Words<WorkerToWorker> ToWorker(const Speaker& self);

 private:
  std::uint64_t Number();
  std::uint32_t Number32() { return std::uint32_t(Number()); }
  Epoch EpochLike(Epoch epoch) { return random_.Chance(0.8) ? epoch : Number(); }
  GroupKey Key() { return {Number(), Number32(), Number32()}; }
  Status Reason();
  ClientToCoordinator MakeOfClient(const Policy& policy);
  WorkerToCoordinator MakeOfWorker(const Speaker& self, std::uint32_t nodes);
  WorkerToWorker MakeToWorker(const Speaker& self);

  Random& random_;
  // The last words that were overheard.
  template <class Messages>
  class Memory {
   public:
    void Keep(Words<Messages> words);
    std::optional<Words<Messages>> Again(Random& random) const;

   private:
    std::vector<Words<Messages>> words_;
    std::size_t next_place_ = 0;
  };
  Memory<WorkerToCoordinator> of_workers_;
  Memory<WorkerToWorker> images_;
};

}  // namespace slabstream
