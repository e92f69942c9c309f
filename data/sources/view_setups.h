// The XML file of BigDataViewer and BigStitcher, beside the file or folder that holds the samples: how far voxels are apart, and in which
// unit; and the file of settings beside it: how its user shows them.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/status.h"
#include "common/math/vec.h"
#include "common/volume/field_info.h"
#include "common/volume/orientation.h"

namespace slabstream {

struct ViewSetup {
  int id = 0;
  FieldInfo channel = {};
  std::optional<Vec3> spacing = {};  // each > 0, finite
  std::optional<LengthUnit> unit = {};
};

// Those that have a number; at most 65536. Elements that are not known are skipped. InvalidArgument: no well-formed XML.
Result<std::vector<ViewSetup>> ParseViewSetups(const std::string& xml);

// Takes colours, windows and what is shown from `xml`, of settings. InvalidArgument: no well-formed XML.
Status TakeViewSettings(const std::string& xml, std::vector<ViewSetup>& setups);

// The XML file beside `path` that has the same name with another ending, and its settings, NAME.settings.xml; a warning tells if these
// cannot be taken. InvalidArgument, ResourceExhausted: the XML file cannot be taken; the message names it.
struct ViewSetupFile {
  std::vector<std::string> files;  // paths of those that are there
  std::vector<ViewSetup> setups;

  // Of the group or folder that is called by `prefix` and the setup's number. One without a name if the file does not list it.
  ViewSetup Of(const std::string& name, std::string_view prefix) const;
};
Result<ViewSetupFile> ReadViewSetupsBeside(const std::string& path);

// Of names, those that are `prefix` and a number: "setup0".
std::vector<std::string> Numbered(const std::vector<std::string>& names, std::string_view prefix);

}  // namespace slabstream
