#include "common/base/did_you_mean.h"

#include <cctype>
#include <cstddef>
#include <limits>

#include "common/base/printable.h"

namespace slabstream {
namespace {

constexpr std::size_t kMostBytes = 64;  // of names that are compared letter by letter

// Lower case, with one kind of dash.
std::string Plain(std::string_view text) {
  std::string plain;
  for (const unsigned char c : text) plain += c == '_' || c == ' ' ? '-' : char(std::tolower(c));
  return plain;
}

// How many letters are wrong, missing, too many, or swapped with their neighbour (the optimal string alignment distance).
std::size_t Mistakes(std::string_view a, std::string_view b) {
  std::vector<std::size_t> before(b.size() + 1), last(b.size() + 1), row(b.size() + 1);  // of the letters of `a` up to i - 2, i - 1, i
  for (std::size_t j = 0; j <= b.size(); ++j) row[j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    before.swap(last);
    last.swap(row);
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      row[j] = std::min({last[j] + 1, row[j - 1] + 1, last[j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1)});
      const bool swapped = i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1];
      if (swapped) row[j] = std::min(row[j], before[j - 2] + 1);
    }
  }
  return row[b.size()];
}

// How unlike they are; none: too much.
constexpr std::size_t kNotAlike = std::numeric_limits<std::size_t>::max();
std::size_t Unlikeness(const std::string& text, const std::string& name) {
  constexpr std::size_t kLeastPart = 3;
  if (text == name) return 0;
  const std::size_t mistakes = Mistakes(text, name), most = std::max<std::size_t>(1, std::min(text.size(), name.size()) / 3);
  if (mistakes <= most && std::min(text.size(), name.size()) > 1) return mistakes;
  if (text.size() >= kLeastPart && name.find(text) != std::string::npos) return most + name.find(text) + 1;
  return kNotAlike;
}

}  // namespace

std::string_view MostAlike(std::string_view text, std::span<const std::string_view> names) {
  if (text.empty() || text.size() > kMostBytes) return {};
  const std::string plain = Plain(text);
  std::string_view best;
  std::size_t least = kNotAlike;
  for (const std::string_view name : names) {
    if (name.empty() || name.size() > kMostBytes) continue;
    const std::size_t unlike = Unlikeness(plain, Plain(name));
    if (unlike >= least) continue;
    least = unlike;
    best = name;
  }
  return best;
}

std::string DidYouMean(std::string_view text, std::span<const std::string_view> names) {
  const std::string_view meant = MostAlike(text, names);
  return meant.empty() ? "" : "; did you mean '" + Printable(std::string(meant)) + "'?";
}

}  // namespace slabstream
