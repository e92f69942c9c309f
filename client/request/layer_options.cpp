#include "client/request/layer_options.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <functional>
#include <string_view>
#include <utility>
#include <variant>

#include "client/request/picture_record.h"
#include "client/request/values.h"
#include "client/request/volume_argument.h"
#include "common/cli/add_option.h"
#include "common/cli/parse.h"

namespace slabstream {
namespace {

constexpr int kGreatestLabel = int(kMaxLabelValue);
constexpr NumberRange kShare = {0, 1};
const std::vector<std::string_view> kModes = {"tint", "surface"};

// The parts of a list with commas.
Status ForEachItem(std::string_view list, const std::function<Status(std::string_view)>& read) {
  while (true) {
    const std::size_t comma = list.find(',');
    if (Status status = read(list.substr(0, comma)); !status.ok()) return status;
    if (comma == std::string_view::npos) return Status::Ok();
    list.remove_prefix(comma + 1);
  }
}

// 3=0.5,7=0
Status ReadOpacities(const std::string& option, const std::string& text, LabelChoice& labels) {
  return ForEachItem(text, [&](std::string_view item) {
    const std::size_t equals = item.find('=');
    if (equals == std::string_view::npos) return Status::InvalidArgument(fmt::format("{} '{}' is not LABEL=OPACITY", option, item));
    const Result<int> value = ParseInteger(option, item.substr(0, equals), 1, kGreatestLabel);
    if (!value.ok()) return value.status();
    const Result<double> opacity = ParseNumber(option, item.substr(equals + 1), {0, 1});
    if (!opacity.ok()) return opacity.status();
    labels.opacities.push_back({std::uint32_t(*value), *opacity});
    return Status::Ok();
  });
}

// 1,5-9
Status ReadShown(const std::string& option, const std::string& text, LabelChoice& labels) {
  return ForEachItem(text, [&](std::string_view item) {
    const std::size_t hyphen = item.find('-');
    const Result<int> first = ParseInteger(option, item.substr(0, hyphen), 1, kGreatestLabel);
    if (!first.ok()) return first.status();
    const Result<int> last =
        hyphen == std::string_view::npos ? first : ParseInteger(option, item.substr(hyphen + 1), *first, kGreatestLabel);
    if (!last.ok()) return last.status();
    labels.shown.push_back({std::uint32_t(*first), std::uint32_t(*last)});
    return Status::Ok();
  });
}

// An option whose text `read` takes.
CLI::Option* AddText(CLI::App& app, const std::string& name, const std::string& help,
                     const std::function<Status(const std::string& option, const std::string& text)>& read) {
  return app.add_option(name, CLI::callback_t([name, read](const CLI::results_t& texts) {
                          if (const Status status = read(name, texts.back()); !status.ok()) throw CLI::ValidationError(status.message());
                          return true;
                        }),
                        help);
}

// What the layer's own options change; the first one shows the layer.
template <class Choice>
Choice& Shown(std::optional<Choice>& choice) {
  return choice ? *choice : choice.emplace();
}

void AddFiles(CLI::App& app, LayerFiles& files, const std::function<void()>& labels_shown, const std::function<void()>& overlay_shown) {
  AddText(app, "--labels",
          "A volume of labels, the numbers of structures, on any grid, and a table of their colours: .lut, FreeSurfer, ITK-SNAP, ParaView "
          "(default: X.nii.lut beside X.nii.gz, else colours of our own); with --local",
          [&files, labels_shown](const std::string& option, const std::string& text) {
            if (text.empty()) return Status::InvalidArgument(option + " needs a file");
            SetLabelFiles(text, files);
            labels_shown();
            return Status::Ok();
          })
      ->type_name("FILE[:COLOURS]");
  AddText(app, "--overlay", "A second volume of values, on any grid, such as a statistical map; with --local",
          [&files, overlay_shown](const std::string& option, const std::string& text) {
            if (text.empty()) return Status::InvalidArgument(option + " needs a file");
            files.overlay = text;
            overlay_shown();
            return Status::Ok();
          })
      ->type_name("FILE");
}

}  // namespace

void AddLayerFiles(CLI::App& app, LayerFiles& files) {
  AddFiles(
      app, files, [] {}, [] {});
}

void AddLayerOptions(CLI::App& app, FrameRequest& request, LayerFiles* files, bool opacities) {
  app.option_defaults()->group("Layers (any option shows the dataset's labels or its overlay)");
  if (files != nullptr) {
    AddFiles(
        app, *files, [&request] { Shown(request.labels); }, [&request] { Shown(request.overlay); });
  }
  NoteChoices(
      AddText(app, "--label-mode",
              "tint: labels colour what the transfer function shows, and a label that is not shown takes its material away; surface: "
              "labels are material of their own",
              [&request](const std::string& option, const std::string& text) {
                const Result<std::size_t> mode = ParseChoice(option, text, kModes);
                if (mode.ok()) Shown(request.labels).mode = *mode == 0 ? LabelMode::kTint : LabelMode::kSurface;
                return mode.status();
              }),
      kModes)
      ->type_name("tint|surface")
      ->default_str("tint");
  NoteRange(AddText(app, "--label-tint", "Share of a label's colour in that of the material, for --label-mode tint",
                    [&request](const std::string& option, const std::string& text) {
                      const Result<double> tint = ParseNumber(option, text, kShare);
                      if (tint.ok()) Shown(request.labels).tint = *tint;
                      return tint.status();
                    }),
            kShare)
      ->type_name("NUMBER")
      ->default_str(fmt::format("{:g}", kDefaultTint));
  if (opacities) {
    AddText(app, "--label-opacity",
            "Opacities of labels from 0 to 1, others have 1; tint: a factor of the material's; surface: of a voxel length; zbuffer: clear "
            "below 0.5",
            [&request](const std::string& option, const std::string& text) {
              Shown(request.labels).opacities.clear();
              return ReadOpacities(option, text, *request.labels);
            })
        ->type_name("LABEL=OPACITY,...");
  }
  AddText(app, "--labels-shown", "The labels that are shown, as in 1,5-9 (default: all)",
          [&request](const std::string& option, const std::string& text) {
            Shown(request.labels).shown.clear();
            return ReadShown(option, text, *request.labels);
          })
      ->type_name("LABEL[-LABEL],...");
  AddText(app, "--overlay-transfer", "Transfer function of the overlay, as --transfer",
          [&request, files](const std::string& option, const std::string& text) {
            auto transfer = files != nullptr ? ParseTransfer(option, text) : ParseTransferText(option, text);
            if (transfer.ok()) Shown(request.overlay).transfer.choice = *std::move(transfer);
            return transfer.status();
          })
      ->type_name("TRANSFER")
      ->default_str("auto");
  AddText(app, "--overlay-range", "Stretch the overlay's transfer function, as --scalar-range",
          [&request](const std::string& option, const std::string& text) {
            const Result<ScalarRange> range = ParseScalarRange(option, text);
            if (range.ok()) Shown(request.overlay).transfer.scalar_range = *range;
            return range.status();
          })
      ->type_name("LOW:HIGH");
  NoteRange(AddText(app, "--overlay-weight", "Factor of the overlay's density in the mix, from 0 to 1",
                    [&request](const std::string& option, const std::string& text) {
                      const Result<double> weight = ParseNumber(option, text, kShare);
                      if (weight.ok()) Shown(request.overlay).weight = *weight;
                      return weight.status();
                    }),
            kShare)
      ->type_name("NUMBER")
      ->default_str("1");
}

std::vector<std::string> LayerArguments(const FrameRequest& request, const LayerFiles& files) {
  std::vector<std::string> arguments;
  const auto add = [&](const std::string& option, const std::string& value) { arguments.insert(arguments.end(), {option, value}); };
  if (!files.labels.empty()) add("--labels", LabelText(files));
  if (!files.overlay.empty()) add("--overlay", files.overlay);
  if (request.labels) {
    const LabelChoice usual;
    const auto& [mode, tint, opacities, shown] = *request.labels;
    if (files.labels.empty() || mode != usual.mode) add("--label-mode", std::string(kModes[mode == LabelMode::kTint ? 0 : 1]));
    if (tint != usual.tint) add("--label-tint", fmt::format("{}", tint));
    std::vector<std::string> items;
    for (const auto& [value, opacity] : opacities) items.push_back(fmt::format("{}={}", value, opacity));
    if (!items.empty()) add("--label-opacity", fmt::format("{}", fmt::join(items, ",")));
    items.clear();
    for (const auto& [first, last] : shown) {
      items.push_back(first == last ? fmt::format("{}", first) : fmt::format("{}-{}", first, last));
    }
    if (!items.empty()) add("--labels-shown", fmt::format("{}", fmt::join(items, ",")));
  }
  if (request.overlay) {
    const auto& [transfer, weight] = *request.overlay;
    const auto* preset = std::get_if<std::string>(&transfer.choice);
    add("--overlay-transfer", preset != nullptr ? *preset : kOverlayMapFile);
    if (transfer.scalar_range) arguments.push_back("--overlay-range=" + ScalarRangeText(*transfer.scalar_range));
    if (weight != 1) add("--overlay-weight", fmt::format("{}", weight));
  }
  return arguments;
}

}  // namespace slabstream
