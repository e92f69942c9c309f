// The elements of an XDMF file, and where its references lead. Source: https://www.xdmf.org/index.php/XDMF_Model_and_Format
//
// A file is hostile until proven otherwise: bytes, elements, depth and the search for references have limits. One thread at a time.
#pragma once

#include <cstdint>
#include <deque>
#include <initializer_list>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "common/base/status.h"

namespace slabstream {

struct XdmfElement {
  std::string name;  // "Grid"
  std::vector<std::pair<std::string, std::string>> attributes;
  std::string_view text;  // before the first element in it, without blanks round it; lives as long as the document
  std::vector<const XdmfElement*> children;

  // The attribute of the first of these names that it has, since versions call them differently; "": it has none.
  std::string Attribute(std::initializer_list<std::string_view> names) const;
  // The same in small letters: XDMF does not tell them from capital ones.
  std::string Word(std::initializer_list<std::string_view> names) const;
};

class XdmfDocument {
 public:
  // NotFound: no such file. InvalidArgument: it is no XDMF, or includes other files (XInclude with href). ResourceExhausted: it is too
  // long, too deep or has too many elements. Messages name the path.
  static Result<std::shared_ptr<XdmfDocument>> Read(const std::string& path);

  const std::string& path() const { return path_; }
  const XdmfElement& root() const { return elements_.front(); }

  // The element, or the one that its reference leads to: an XPath of names, numbers and attributes from the root ("/Xdmf/Domain/Grid[2]",
  // "//DataItem[@Name='p']"). InvalidArgument: it leads nowhere, to an element of another name or in a circle, or is another XPath.
  // ResourceExhausted: as of Spend.
  Result<const XdmfElement*> Resolved(const XdmfElement& element);
  // The first child of that name, as its reference leads; or the one that is included from elsewhere in the document (XInclude), as finite
  // element programs share the mesh of all times. Errors of Resolved; InvalidArgument: there is none.
  Result<const XdmfElement*> Needed(const XdmfElement& element, std::string_view name);
  static std::vector<const XdmfElement*> Children(const XdmfElement& element, std::string_view name);

  // Counts what is done for this file: small elements can stand for much work. ResourceExhausted: too much.
  Status Spend(std::uint64_t steps);

  // "a.xmf: DataItem 'p'"
  std::string Named(const XdmfElement& element) const;
  Status Wrong(const XdmfElement& element, const std::string& why) const { return Status::InvalidArgument(Named(element) + ": " + why); }

 private:
  explicit XdmfDocument(std::string path) : path_(std::move(path)) {}
  Status Parse();
  Result<const XdmfElement*> NeededAt(const XdmfElement& element, std::string_view name, int includes);
  Result<const XdmfElement*> Find(const XdmfElement& from, std::string_view path);

  const std::string path_;
  std::string text_;
  std::deque<XdmfElement> elements_;  // in the order of the file; the first is the root
  std::uint64_t spent_ = 0;
};

}  // namespace slabstream
