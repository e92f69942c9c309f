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

const std::string& FileIn(const CLI::results_t& texts, const char* option) {
  if (texts.back().empty()) throw CLI::ValidationError(std::string(option) + " needs a file");
  return texts.back();
}

}  // namespace

void AddLayerFiles(CLI::App& app, LayerFiles& files, FrameRequest* shown) {
  app.option_defaults()->group(GroupOf("label-mode"));
  app.add_option("--labels", CLI::callback_t([&files, shown](const CLI::results_t& texts) {
                   SetLabelFiles(FileIn(texts, "--labels"), files);
                   if (shown != nullptr && !shown->labels) shown->labels.emplace();
                   return true;
                 }),
                 "A volume of labels, the numbers of structures, on any grid, and a table of their colours: .lut, FreeSurfer, ITK-SNAP, "
                 "ParaView (default: X.nii.lut beside X.nii.gz, else colours of our own); with --local")
      ->type_name("FILE[:COLOURS]");
  app.add_option("--overlay", CLI::callback_t([&files, shown](const CLI::results_t& texts) {
                   files.overlay = FileIn(texts, "--overlay");
                   if (shown != nullptr && !shown->overlay) shown->overlay.emplace();
                   return true;
                 }),
                 "A second volume of values, on any grid, such as a statistical map; with --local")
      ->type_name("FILE");
}

}  // namespace slabstream
