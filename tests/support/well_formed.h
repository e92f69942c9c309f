// WhyNotWellFormed: whether a text is well-formed XML, as far as reports use it: elements nest and close, attributes are quoted and named
// once, and & and < stand only where they may. No DTD beyond a DOCTYPE, no comments, no processing instructions.
#pragma once

#include <cctype>
#include <set>
#include <string>
#include <string_view>
#include <vector>

namespace slabstream {

// Empty: it is. Else what is wrong, and where.
inline std::string WhyNotWellFormed(std::string_view text) {
  const auto at = [](std::size_t place) { return " at " + std::to_string(place); };
  const auto entity_ok = [&](std::size_t i) {
    const std::size_t end = text.find(';', i);
    return end != std::string_view::npos && end > i + 1 && end - i < 12;
  };
  std::vector<std::string> open;
  bool root_seen = false;
  std::size_t i = text.starts_with("<!DOCTYPE") ? text.find('>') + 1 : 0;
  while (i < text.size()) {
    if (text[i] == '&' && !entity_ok(i)) return "& that begins no entity" + at(i);
    if (text[i] != '<') {
      if (open.empty() && std::isspace(static_cast<unsigned char>(text[i])) == 0) return "text outside of the root" + at(i);
      ++i;
      continue;
    }
    if (text.substr(i, 2) == "</") {
      const std::size_t end = text.find('>', i);
      const std::string name(text.substr(i + 2, end - i - 2));
      if (open.empty() || open.back() != name)
        return "</" + name + "> closes " + (open.empty() ? "nothing" : "<" + open.back() + ">") + at(i);
      open.pop_back();
      i = end + 1;
      continue;
    }
    const auto is_name = [](char c) { return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '-' || c == ':' || c == '_'; };
    std::size_t j = i + 1;
    while (j < text.size() && is_name(text[j])) ++j;
    const std::string name(text.substr(i + 1, j - i - 1));
    if (name.empty()) return "< that begins no element" + at(i);
    if (open.empty() && root_seen) return "a second root <" + name + ">" + at(i);
    root_seen = true;
    std::set<std::string> attributes;
    while (j < text.size() && text[j] != '>' && text[j] != '/') {
      if (std::isspace(static_cast<unsigned char>(text[j])) != 0) {
        ++j;
        continue;
      }
      const std::size_t begin = j;
      while (j < text.size() && is_name(text[j])) ++j;
      const std::string attribute(text.substr(begin, j - begin));
      if (attribute.empty() || text.substr(j, 2) != "=\"") return "an attribute without a quoted value" + at(begin);
      if (!attributes.insert(attribute).second) return "attribute " + attribute + " twice" + at(begin);
      const std::size_t end = text.find('"', j + 2);
      if (end == std::string_view::npos) return "a quotation mark that is not closed" + at(j);
      for (std::size_t k = j + 2; k < end; ++k) {
        if (text[k] == '<' || (text[k] == '&' && !entity_ok(k))) return "a bare " + std::string(1, text[k]) + " in an attribute" + at(k);
      }
      j = end + 1;
    }
    if (text.substr(j, 2) == "/>") {
      i = j + 2;
    } else if (j < text.size() && text[j] == '>') {
      open.push_back(name);
      i = j + 1;
    } else {
      return "<" + name + " is not closed" + at(i);
    }
  }
  if (!open.empty()) return "<" + open.back() + "> is not closed";
  return root_seen ? "" : "no element";
}

}  // namespace slabstream
