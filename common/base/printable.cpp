#include "common/base/printable.h"

#include <algorithm>
#include <string_view>

namespace slabstream {

std::string Printable(std::string text) {
  constexpr std::string_view kLeftOut = " ... ";
  constexpr std::size_t kEnd = kMaxPrintableBytes / 4, kBegin = kMaxPrintableBytes - kEnd - kLeftOut.size();
  if (text.size() > kMaxPrintableBytes) text.replace(kBegin, text.size() - kBegin - kEnd, kLeftOut);
  std::replace_if(
      text.begin(), text.end(), [](unsigned char c) { return c < ' ' || c == 0x7f; }, '?');
  return text;
}

Status Printable(const Status& status) { return status.ok() ? status : Status(status.code(), Printable(status.message())); }

}  // namespace slabstream
