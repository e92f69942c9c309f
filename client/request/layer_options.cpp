#include "client/request/layer_options.h"

#include <string>

#include "client/request/request_options.h"
#include "common/base/check.h"

namespace slabstream {
namespace {

const std::string& GroupOf(std::string_view option) {
  const RequestOption* const found = FindRequestOption(option);
  CHECK(found != nullptr);
  return found->group;
}

}  // namespace

void AddLayerFiles(const Command& app, LayerFiles& files, FrameRequest* shown) {
  app.GroupOptions(GroupOf("label-mode"));
  const auto set_labels = [&files, shown](const std::string& option, const std::vector<std::string>& texts) {
    if (texts.back().empty()) return Status::InvalidArgument(option + " needs a file");
    SetLabelFiles(texts.back(), files);
    if (shown != nullptr && !shown->labels) shown->labels.emplace();
    return Status::Ok();
  };
  app.AddOption("--labels", set_labels,
                "A volume of labels, the numbers of structures, on any grid, and a table of their colours: .lut, FreeSurfer, ITK-SNAP, "
                "ParaView (default: X.nii.lut beside X.nii.gz, else colours of our own); with --local")
      .TypeName("FILE[:COLOURS]");
  const auto set_overlay = [&files, shown](const std::string& option, const std::vector<std::string>& texts) {
    if (texts.back().empty()) return Status::InvalidArgument(option + " needs a file");
    files.overlay = texts.back();
    if (shown != nullptr && !shown->overlay) shown->overlay.emplace();
    return Status::Ok();
  };
  app.AddOption("--overlay", set_overlay, "A second volume of values, on any grid, such as a statistical map; with --local")
      .TypeName("FILE");
}

}  // namespace slabstream
