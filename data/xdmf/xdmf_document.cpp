#include "data/xdmf/xdmf_document.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>

#include "common/base/printable.h"
#include "common/files/files.h"
#include "common/text/parse_number.h"
#include "common/text/trimmed.h"
#include "data/volume_io/text_header.h"
#include "data/volume_io/xml_events.h"

namespace slabstream {
namespace {

constexpr std::size_t kMostBytes = std::size_t{64} << 20;
constexpr std::size_t kMostParts = std::size_t{1} << 20;  // elements and attributes
constexpr std::size_t kMostNested = 64;
constexpr std::uint64_t kMostSteps = std::uint64_t{1} << 26;  // a fraction of a second
constexpr int kMostReferences = 16;                           // one behind the other
constexpr std::string_view kInclude = ":include";

// What an XPath says in brackets: a number from 1 on, or an attribute.
struct Condition {
  std::size_t number = 0;  // 0: an attribute
  std::string_view key = {}, value = {};
};

std::optional<Condition> ConditionIn(std::string_view text) {
  text = Trimmed(text);
  if (const auto number = ParseNumber<std::size_t>(text)) return *number > 0 ? std::optional(Condition{*number}) : std::nullopt;
  const std::size_t equal = text.find('=');
  if (!text.starts_with('@') || equal == std::string_view::npos) return std::nullopt;
  const std::string_view value = Trimmed(text.substr(equal + 1));
  if (value.size() < 2 || value.front() != value.back() || (value.front() != '"' && value.front() != '\'')) return std::nullopt;
  return Condition{0, Trimmed(text.substr(1, equal - 1)), value.substr(1, value.size() - 2)};
}

// The first step of a path without its slash, which is taken off.
struct Step {
  std::string_view name;
  std::vector<Condition> conditions;

  bool Fits(const XdmfElement& element, std::size_t& number) const {
    if (element.name != name) return false;
    for (const Condition& condition : conditions) {
      if (condition.number == 0 && element.Attribute({condition.key}) != condition.value) return false;
      if (condition.number > 0 && ++number != condition.number) return false;
    }
    return true;
  }
};

std::optional<Step> TakeStep(std::string_view& path) {
  const std::size_t end = std::min(path.find_first_of("[/"), path.size());
  Step step{.name = path.substr(0, end), .conditions = {}};
  path.remove_prefix(end);
  while (path.starts_with('[')) {
    std::size_t close = 1;
    for (char quote = '\0'; close < path.size() && (quote != '\0' || path[close] != ']'); ++close) {
      if (quote == '\0' && (path[close] == '"' || path[close] == '\'')) {
        quote = path[close];
      } else if (path[close] == quote) {
        quote = '\0';
      }
    }
    const std::optional<Condition> condition = ConditionIn(path.substr(1, close - 1));
    if (close == path.size() || !condition) return std::nullopt;
    step.conditions.push_back(*condition);
    path.remove_prefix(close + 1);
  }
  return step.name.empty() ? std::nullopt : std::optional(std::move(step));
}

}  // namespace

std::string XdmfElement::Attribute(std::initializer_list<std::string_view> names) const {
  for (const std::string_view wanted : names) {
    const auto found = std::ranges::find(attributes, wanted, [](const auto& attribute) { return std::string_view(attribute.first); });
    if (found != attributes.end()) return found->second;
  }
  return "";
}

std::string XdmfElement::Word(std::initializer_list<std::string_view> names) const {
  return ToLower(std::string(Trimmed(Attribute(names))));
}

Result<std::shared_ptr<XdmfDocument>> XdmfDocument::Read(const std::string& path) {
  const std::shared_ptr<XdmfDocument> document(new XdmfDocument(path));
  Result<std::string> text = ReadTextFile(path, kMostBytes);
  if (!text.ok()) return text.status();
  document->text_ = *std::move(text);
  if (Status status = document->Parse(); !status.ok()) return status;
  return document;
}

Status XdmfDocument::Parse() {
  std::vector<XdmfElement*> open;
  std::vector<std::int64_t> text_begins;  // of the open ones; -1: an element has begun in it
  std::size_t parts = 0;
  Status wrong;
  const auto end_text = [&](std::int64_t end) {
    if (open.empty() || text_begins.back() < 0) return;
    const std::int64_t begin = text_begins.back(), size = std::max<std::int64_t>(0, end - begin);
    open.back()->text = Trimmed(std::string_view(text_).substr(std::size_t(begin), std::size_t(size)));
    text_begins.back() = -1;
  };
  const auto start = [&](const XmlTag& tag) {
    end_text(tag.begin);
    parts += 1 + tag.attributes.size();
    if (open.size() == kMostNested || parts > kMostParts) {
      wrong = Status::ResourceExhausted(
          fmt::format("{}: has more than {} elements and attributes, or elements in more than {} others", path_, kMostParts, kMostNested));
    } else if (open.empty() && tag.name != "Xdmf") {
      wrong = Status::InvalidArgument(fmt::format("{}: its first element is '{}', must be Xdmf", path_, Printable(tag.name)));
    } else if (tag.name.ends_with(kInclude) && tag.attributes.contains("href")) {
      wrong = Status::InvalidArgument(path_ + ": includes other files (XInclude), which is not supported");
    }
    if (!wrong.ok()) return false;
    elements_.push_back({tag.name, {tag.attributes.begin(), tag.attributes.end()}, {}, {}});
    if (!open.empty()) open.back()->children.push_back(&elements_.back());
    open.push_back(&elements_.back());
    text_begins.push_back(tag.end);
    return true;
  };
  const auto end = [&](const XmlTag& tag) {
    end_text(tag.begin);
    open.pop_back();
    text_begins.pop_back();
  };
  if (const Status status = ReadXml(text_, {start, end}); !status.ok()) return Status(status.code(), path_ + ": " + status.message());
  return wrong;
}

std::vector<const XdmfElement*> XdmfDocument::Children(const XdmfElement& element, std::string_view name) {
  std::vector<const XdmfElement*> found;
  std::ranges::copy_if(element.children, std::back_inserter(found), [&](const XdmfElement* child) { return child->name == name; });
  return found;
}

Result<const XdmfElement*> XdmfDocument::Needed(const XdmfElement& element, std::string_view name) { return NeededAt(element, name, 0); }

Result<const XdmfElement*> XdmfDocument::NeededAt(const XdmfElement& element, std::string_view name, int includes) {
  for (const XdmfElement* child : element.children) {
    if (child->name == name) return Resolved(*child);
  }
  for (const XdmfElement* child : element.children) {
    if (!child->name.ends_with(kInclude)) continue;
    // "xpointer(PATH/*[self::Topology or self::Geometry])"
    const std::string pointer = child->Attribute({"xpointer"});
    const std::size_t begin = pointer.find('('), chosen = pointer.find("/*[");
    if (begin == std::string::npos || chosen == std::string::npos || includes == kMostReferences) {
      return Wrong(element, fmt::format("includes '{}', which is not supported; supported: xpointer(PATH/*[self::NAME or self::NAME])",
                                        Printable(pointer)));
    }
    if (pointer.find(fmt::format("self::{}", name), chosen) == std::string::npos) continue;
    const Result<const XdmfElement*> found = Find(element, std::string_view(pointer).substr(begin + 1, chosen - begin - 1));
    return found.ok() ? NeededAt(**found, name, includes + 1) : found;
  }
  return Wrong(element, fmt::format("has no {}", name));
}

Status XdmfDocument::Spend(std::uint64_t steps) {
  spent_ += std::min(steps, kMostSteps + 1);
  if (spent_ <= kMostSteps) return Status::Ok();
  return Status::ResourceExhausted(fmt::format("{}: its references and numbers take more than {} steps to read", path_, kMostSteps));
}

std::string XdmfDocument::Named(const XdmfElement& element) const {
  const std::string name = element.Attribute({"Name"});
  return path_ + ": " + Printable(name.empty() ? element.name : fmt::format("{} '{}'", element.name, name));
}

Result<const XdmfElement*> XdmfDocument::Find(const XdmfElement& from, std::string_view path) {
  const auto wrong = [&](const std::string& why) {
    return Wrong(from, fmt::format("Reference '{}' {}", Printable(std::string(path)), why));
  };
  std::string_view rest = path;
  const XdmfElement* found = nullptr;  // null: the document, in which the root is
  while (!rest.empty()) {
    const bool anywhere = found == nullptr && rest.starts_with("//");
    if (!rest.starts_with('/')) break;
    rest.remove_prefix(anywhere ? 2 : 1);
    const std::optional<Step> step = TakeStep(rest);
    if (!step) break;
    std::size_t number = 0;
    std::uint64_t steps = 0;
    const XdmfElement* next = nullptr;
    const auto is_next = [&](const XdmfElement& element) {
      ++steps;
      next = step->Fits(element, number) ? &element : nullptr;
      return next != nullptr;
    };
    if (found != nullptr) {
      (void)std::ranges::any_of(found->children, [&](const XdmfElement* child) { return is_next(*child); });
    } else if (anywhere) {
      (void)std::ranges::any_of(elements_, is_next);
    } else {
      (void)is_next(root());
    }
    if (Status status = Spend(steps); !status.ok()) return status;
    if (next == nullptr) return wrong("leads to no element");
    found = next;
    if (rest.empty()) return found;
  }
  return wrong("is not supported; supported: names from the root with [NUMBER] or [@NAME='VALUE']");
}

Result<const XdmfElement*> XdmfDocument::Resolved(const XdmfElement& element) {
  const XdmfElement* at = &element;
  for (int i = 0; i < kMostReferences; ++i) {
    const std::string reference = at->Attribute({"Reference"});
    if (reference.empty()) return at;
    const std::string path(reference == "XML" ? at->text : Trimmed(reference));
    const Result<const XdmfElement*> found = Find(*at, path);
    if (!found.ok()) return found;
    if ((*found)->name != element.name) {
      return Wrong(element,
                   fmt::format("Reference '{}' leads to an element {}, must lead to {}", Printable(path), (*found)->name, element.name));
    }
    at = *found;
  }
  return Wrong(element, fmt::format("has more than {} references one behind the other", kMostReferences));
}

}  // namespace slabstream
