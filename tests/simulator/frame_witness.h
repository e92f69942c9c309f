// FrameWitness: sees what a coordinator hands out and what comes of it, and checks what must hold of frames (simulation.h says what).
#pragma once

#include <cstdint>
#include <iterator>
#include <map>
#include <set>
#include <utility>
#include <vector>

#include "common/memory/bytes.h"
#include "common/wire/any_message.h"
#include "tests/simulator/tally.h"

namespace slabstream {

class FrameWitness {
 public:
  // Without faults more must hold.
  FrameWitness(bool faultless, Tally& tally) : faultless_(faultless), tally_(tally) {}

  void OnRestart();  // the coordinator has restarted: it knows of no frame
  void OnAssignment(const GroupAssignment& assignment, std::size_t workers, int teams);
  void OnPing(const Ping& ping);
  void OnGroupDone(const GroupDone& done);
  void OnPicture(const FrameImage& image, const Bytes& payload, const FrameReply& reply);

 private:
  // What the coordinator handed out for a frame.
  struct SeenFrame {
    ClientId client = 0;
    std::uint32_t group_count = 0;
    std::uint32_t attempt = 0;
    FrameSetup setup;
    std::map<std::uint32_t, std::vector<BoxId>> groups;
    std::map<BoxId, Box> boxes;
    WorkerId display = 0;                             // the display worker of this attempt
    std::set<std::uint32_t> handed_out;               // groups of this attempt
    std::map<WorkerId, std::uint32_t> done;           // groups that a display worker has said are done: the first so many
    std::set<std::pair<WorkerId, Box>> padded_boxes;  // who needed which voxels
    std::map<BoxId, OcclusionMask> left_out;          // what masks hide of each box, in any attempt
    std::set<BoxId> outside;                          // boxes outside the picture, which are not read
    bool all_cached = true;                           // when it was handed out, workers held all voxels that it needs
    bool over = false;
    std::size_t unfinished() const {  // handed out, and not done as the display worker sees it
      const auto known = done.find(display);
      return std::size_t(std::distance(handed_out.lower_bound(known == done.end() ? 0 : known->second), handed_out.end()));
    }
  };

  std::size_t OthersThan(ClientId client) const;
  void CheckHidden(const GroupAssignment& assignment, const SeenFrame& frame);

  const bool faultless_;
  Tally& tally_;
  std::map<FrameId, SeenFrame> frames_;         // the frames of this epoch
  std::map<BoxId, Box> last_boxes_;             // as they were handed out last
  std::set<std::pair<WorkerId, Box>> fetched_;  // voxels that workers hold for sure
};

}  // namespace slabstream
