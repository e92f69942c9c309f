// CheckCounter: numbers the checks of something that may change at any time, such as files. A check tells how things were after it began.
// So whoever wants to know needs a check that begins later; all who ask while a check is under way share the next one.
#pragma once

#include <cstdint>

namespace slabstream {

using CheckId = std::uint64_t;  // from 1; 0: none

class CheckCounter {
 public:
  CheckId Want() { return wanted_ = begun_ + 1; }  // the check for somebody who asks now
  bool MustBegin() const { return begun_ == ended_ && wanted_ > begun_; }
  void Begin() { ++begun_; }
  void End() { ended_ = begun_; }           // the one under way, if any, or its answer is no longer wanted
  CheckId Last() const { return wanted_; }  // the last check that was asked for
  bool UnderWay() const { return begun_ > ended_; }
  bool IsOver(CheckId check) const { return check <= ended_; }
  // There is nothing to check: what was asked for is answered.
  void AnswerAll() { begun_ = ended_ = wanted_; }

 private:
  CheckId wanted_ = 0, begun_ = 0, ended_ = 0;
};

}  // namespace slabstream
