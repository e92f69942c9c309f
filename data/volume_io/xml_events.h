// XML, element by element, without keeping what lies between them: its text may be all samples of a volume. So elements say where in the
// input they begin and end.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <span>
#include <string>
#include <string_view>

#include "common/base/status.h"

namespace slabstream {

struct XmlTag {
  std::string name;
  std::map<std::string, std::string> attributes;  // attributes of a start tag
  std::int64_t begin = 0, end = 0;                // bytes of the input before the tag, and up to behind it

  // "" if it has none of this name.
  std::string Attribute(const std::string& key) const {
    const auto found = attributes.find(key);
    return found == attributes.end() ? "" : found->second;
  }
};

struct XmlEvents {
  std::function<bool(const XmlTag& tag)> start;  // false: reads no further, as where something else than XML follows
  std::function<void(const XmlTag& tag)> end;
};

// `read` fills the buffer and returns how many bytes it has got, 0 at the end. Takes memory for one tag, at most 1 MiB. InvalidArgument,
// with the line: no well-formed XML, a tag that is longer, or a document type definition that declares entities or attributes, which no
// volume has. A definition in another file is not read.
Status ReadXml(const std::function<std::size_t(std::span<char>)>& read, const XmlEvents& events);
Status ReadXml(std::string_view text, const XmlEvents& events);
// The same of a file. Messages begin with its path, and those of ReadXml then with `wrong`, such as "not a VTK file: ". NotFound; errors of
// CheckIsFile (common/files/files.h).
Status ReadXmlFile(const std::string& path, std::string_view wrong, const XmlEvents& events);

}  // namespace slabstream
