#include "laboratory/report/text.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace slabstream {

std::string Escape(std::string_view text) {
  std::string escaped;
  escaped.reserve(text.size());
  for (const char c : text) {
    switch (c) {
      case '&': escaped += "&amp;"; break;
      case '<': escaped += "&lt;"; break;
      case '>': escaped += "&gt;"; break;
      case '"': escaped += "&quot;"; break;
      case '\'': escaped += "&#39;"; break;
      case '\n':
      case '\t': escaped += c; break;
      default:
        if (static_cast<unsigned char>(c) < 0x20) {
          escaped += "\uFFFD";
        } else {
          escaped += c;
        }
    }
  }
  return escaped;
}

std::string FormatNumber(double value) {
  if (!std::isfinite(value)) return "–";
  const double size = std::abs(value);
  if (size == 0) return "0";
  if (size >= 1e7 || size < 1e-4) return fmt::format("{:.3g}", value);
  if (size >= 1000) return fmt::format("{:.0f}", value);
  return fmt::format("{:.4g}", value);
}

std::string FormatAbout(double value) {
  if (!std::isfinite(value) || value == 0) return FormatNumber(value);
  const double unit = std::pow(10, std::floor(std::log10(std::abs(value))) - 1);
  return FormatNumber(std::round(value / unit) * unit);
}

std::string FormatSpeed(double ratio) {
  constexpr double kSame = 1.02;
  if (ratio >= kSame) return fmt::format("{:.1f} times as fast", ratio);
  if (ratio * kSame <= 1) return fmt::format("{:.1f} times as slow", 1 / ratio);
  return "as fast";
}

std::string Slug(std::string_view text) {
  std::string slug;
  for (const char c : text) {
    const bool plain = (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9');
    const bool capital = c >= 'A' && c <= 'Z';
    if (plain || capital) {
      slug += capital ? char(c - 'A' + 'a') : c;
    } else if (!slug.empty() && slug.back() != '-') {
      slug += '-';
    }
  }
  while (!slug.empty() && slug.back() == '-') slug.pop_back();
  return slug.empty() ? "a" : slug;
}

}  // namespace slabstream
