#include "common/frame/label_use.h"

namespace slabstream {

std::vector<LabelUse> UsesOf(const LabelLook& look) {
  constexpr float kLeastOpacity = 0.5F;
  std::vector<LabelUse> uses = {LabelUse::kAsVolume};
  const LabelUse drawn = look.mode == LabelMode::kSurface ? LabelUse::kOpaque : LabelUse::kAsVolume;
  for (const LabelLook::Entry& entry : look.entries) {
    uses.push_back(!entry.shown ? LabelUse::kAsVolume : entry.opacity < kLeastOpacity ? LabelUse::kClear : drawn);
  }
  return uses;
}

}  // namespace slabstream
