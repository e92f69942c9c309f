#include "common/frame/label_use.h"

namespace slabstream {

std::vector<LabelUse> UsesOf(const LabelLook& look) {
  constexpr float kLeastOpacity = 0.5F;
  std::vector<LabelUse> uses = {LabelUse::kAsVolume};
  const bool tint = look.mode == LabelMode::kTint;
  for (const LabelLook::Entry& entry : look.entries) {
    const bool clear = entry.opacity < kLeastOpacity;
    if (tint) {
      uses.push_back(!entry.shown || clear ? LabelUse::kClear : LabelUse::kAsVolume);
    } else {
      uses.push_back(!entry.shown ? LabelUse::kAsVolume : clear ? LabelUse::kClear : LabelUse::kOpaque);
    }
  }
  return uses;
}

}  // namespace slabstream
