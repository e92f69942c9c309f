#include "client/cli/option_groups.h"

#include <fmt/format.h>

#include <array>
#include <filesystem>
#include <vector>

#include "client/cli/cores.h"
#include "common/base/files.h"
#include "common/combining/schemes.h"
#include "common/decomposition/decomposition.h"
#include "common/planning/assignment.h"
#include "common/planning/policy_names.h"
#include "common/transport/endpoint.h"
#include "common/wire/control_messages.h"

namespace slabstream {
namespace {

constexpr std::size_t kMaxTransferFileBytes = std::size_t{16} << 20;

constexpr char kLeftToThePlanner[] = "what should be fastest for this volume, view and service";

// An option that takes one of the names of a list such as Decompositions(), whose entries have a name and a purpose. `automatic`: the
// purpose of kAutomatic, if the option takes it beside them.
template <class T, class Entries>
CLI::Option* AddNamed(CLI::App& app, const std::string& name, T& target, const Entries& entries, const std::string& help,
                      std::string_view automatic = {}) {
  std::string text = help;
  std::vector<std::string_view> names;
  if (!automatic.empty()) {
    names.push_back(kAutomatic);
    text += fmt::format("\n  {}: {}", kAutomatic, automatic);
  }
  for (const auto& entry : entries) {
    names.push_back(entry.name);
    text += fmt::format("\n  {}: {}", entry.name, entry.purpose);
  }
  const auto parse = [names](const std::string& option, const std::string& value) -> Result<std::string> {
    const Result<std::size_t> index = ParseChoice(option, value, names);
    if (!index.ok()) return index.status();
    return value;
  };
  return AddParsed(app, name, target, parse, text)->type_name(fmt::format("{{{}}}", fmt::join(names, ",")));
}

// An option that takes one of `names`, which stand for `values`.
template <class T, std::size_t count>
CLI::Option* AddChoice(CLI::App& app, const std::string& name, T& target, const std::array<std::string_view, count>& names,
                       const std::array<T, count>& values, const std::string& help) {
  const auto parse = [names, values](const std::string& option, const std::string& text) -> Result<T> {
    const Result<std::size_t> index = ParseChoice(option, text, names);
    if (!index.ok()) return index.status();
    return values[*index];
  };
  return AddParsed(app, name, target, parse, help)->type_name(fmt::format("{}", fmt::join(names, "|")));
}

void AddCombining(CLI::App& app, std::string& target) {
  std::string text = fmt::format("How partial images become one\n  {}: {}", kAutomatic, kLeftToThePlanner);
  for (const CombiningEntry& entry : CombiningSchemes()) {
    text += fmt::format("\n  {}{}{}: {}", entry.name, entry.arguments.empty() ? "" : ":", entry.arguments, entry.purpose);
  }
  const auto parse = [](const std::string& option, const std::string& value) -> Result<std::string> {
    if (value == kAutomatic) return value;
    const Result<CombiningChoice> choice = ParseCombining(value);
    if (!choice.ok()) return Status::InvalidArgument(fmt::format("{} {}", option, choice.status().message()));
    return value;
  };
  AddParsed(app, "--combine", target, parse, text)->type_name("NAME[:ARGUMENTS]")->default_str(target);
}

void AddConnectionOptions(CLI::App& app, ConnectionOptions& connection) {
  // Takes its value with `=` only, so that a SOURCE after a bare --local stays the source. CLI11 hands over "true" for the bare form.
  const auto parse = [](const std::string& option, const std::string& text) -> Result<int> {
    if (text == "true") return std::min(CoreCount(), kMaxLocalWorkers);
    return ParseInteger(option, text, 1, kMaxLocalWorkers);
  };
  CLI::Option* local =
      AddParsed(app, "--local", connection.local_workers, parse,
                fmt::format("Render the file SOURCE in this process; --local=N: by N workers (default: one a core, {} here)", CoreCount()))
          ->expected(0);
  AddThreads(app, connection.local_threads, "Render threads of each worker of --local")->needs(local);
  AddEndpoint(app, connection.endpoint);
}

void AddViewOptions(CLI::App& app, ViewParameters& view, ImageSize& size) {
  const NumberRange angle{-kMaxAngleDegrees, kMaxAngleDegrees};
  AddParsed(
      app, "--size", size, [](const std::string& option, const std::string& text) { return ParseImageSize(option, text); },
      "Pixels: WIDTHxHEIGHT, or one number for a square")
      ->type_name("WxH|S")
      ->default_str("512");
  AddChoice<Projection, 2>(app, "--projection", view.projection, {"orthographic", "perspective"},
                           {Projection::kOrthographic, Projection::kPerspective}, "")
      ->default_str("orthographic");
  AddNumber(app, "--azimuth", view.azimuth_degrees, angle, "Degrees that the eye turns about +z; at 90 it is on the +x side");
  AddNumber(app, "--elevation", view.elevation_degrees, angle, "Degrees that the eye is lifted towards +z");
  AddNumber(app, "--roll", view.roll_degrees, angle, "Degrees that the picture is turned clockwise");
  AddNumber(app, "--zoom", view.zoom, {kMinZoom, kMaxZoom}, "Magnification; at 1 the volume's bounding sphere fills the shorter side");
  AddNumber(app, "--fov", view.fov_degrees, {kMinFovDegrees, kMaxFovDegrees}, "Degrees of the cone that holds the sphere (perspective)");
}

void AddLookOptions(CLI::App& app, FrameRequest& request, PictureFormat& format) {
  AddChoice<RendererKind, 2>(app, "--renderer", request.renderer, {"splat", "zbuffer"}, {RendererKind::kSplat, RendererKind::kZBuffer},
                             "Translucent splatting, or the first surface by Z-buffer")
      ->default_str("splat");
  AddTransferOptions(app, request.transfer);
  AddChoice<bool, 2>(app, "--shading", request.shading.phong, {"phong", "none"}, {true, false}, "")->default_str("phong");
  app.add_option("--light", CLI::callback_t([&request](const CLI::results_t& texts) {
                   request.shading.lights.clear();
                   for (const std::string& text : texts) {
                     const Result<Vec3> light = ParseDirection("--light", text);
                     if (!light.ok()) throw CLI::ValidationError(light.status().message());
                     request.shading.lights.push_back(*light);
                   }
                   if (int(texts.size()) <= kMaxLights) return true;
                   throw CLI::ValidationError(fmt::format("--light is given {} times, at most {} are possible", texts.size(), kMaxLights));
                 }),
                 "Direction towards a light, in volume axes; may be repeated (default: a headlight)")
      ->type_name("X,Y,Z")
      ->expected(1)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
  AddParsed(
      app, "--background", format.background, [](const std::string& option, const std::string& text) { return ParseColor(option, text); },
      "Colour behind the picture, each in [0, 1] (default: transparent)")
      ->type_name("R,G,B[,A]");
  AddNumber(app, "--termination", request.termination, {0, kMaxTermination},
            "Transmittance below which what lies behind is skipped; 0: never");
  AddChoice<int, 2>(app, "--depth", format.png_bits, {"8", "16"}, {8, 16}, "Bits of a PNG's channels")->default_str("8");
}

void AddPolicyOptions(CLI::App& app, Policy& policy) {
  AddNamed(app, "--decomposition", policy.decomposition, Decompositions(), "How the volume is divided", kLeftToThePlanner)
      ->default_str(policy.decomposition);
  AddChoice<AxisChoice, 5>(app, "--axis", policy.axis, {"x", "y", "z", "auto", "view"},
                           {AxisChoice::kX, AxisChoice::kY, AxisChoice::kZ, AxisChoice::kAuto, AxisChoice::kView},
                           "Axis that slabs are cut along, and other boxes first; view: the one nearest to the view direction")
      ->default_str("auto");
  AddNamed(app, "--split", policy.split, WorkSplits(), "What boxes have equal shares of")->default_str(policy.split);
  AddNamed(app, "--assignment", policy.assignment, Assignments(), "Who owns which box", kLeftToThePlanner)->default_str(policy.assignment);
  AddNamed(app, "--balance", policy.balance, BalanceModes(), "Whether boxes change while frames go by")->default_str(policy.balance);
  AddInteger(app, "--groups", policy.groups, 0, kMaxGroups,
             "Groups of boxes that are rendered one after the other; 0: chosen by the service");
  AddInteger(app, "--teams", policy.teams, 1, kMaxTeams,
             "Parts of the workers that frames go to in turn, each with all voxels; 1: all workers share every frame");
  AddCombining(app, policy.combine);
  AddNumber(app, "--pixel-error", policy.pixel_error, {0, kMaxPixelError},
            "How far a colour in [0, 1] may move because workers send each other 16 bits a channel instead of 32");
}

}  // namespace

Result<std::variant<std::string, TransferFunction>> ParseTransfer(const std::string& option, const std::string& text) {
  using Choice = std::variant<std::string, TransferFunction>;
  if (std::filesystem::path(text).extension() == ".json" || text.find('/') != std::string::npos) {
    const Result<std::string> json = ReadTextFile(text, kMaxTransferFileBytes);
    if (!json.ok()) return Status(json.status().code(), fmt::format("{} {}", option, json.status().message()));
    Result<TransferFunction> transfer = ParseParaViewColorMap(*json, text);
    if (!transfer.ok()) return Status(transfer.status().code(), fmt::format("{} {}", option, transfer.status().message()));
    return Choice(*std::move(transfer));
  }
  std::vector<std::string_view> names;
  for (const PresetInfo& preset : TransferPresets()) names.push_back(preset.name);
  const Result<std::size_t> index = ParseChoice(option, text, names);
  if (!index.ok()) return Status::InvalidArgument(index.status().message() + ", nor a .json file");
  return Choice(text);
}

CLI::Option* AddNumber(CLI::App& app, const std::string& names, double& target, NumberRange range, const std::string& help) {
  const auto parse = [range](const std::string& option, const std::string& text) { return ParseNumber(option, text, range); };
  return AddParsed(app, names, target, parse, help)->type_name("NUMBER")->default_str(fmt::format("{}", target));
}

CLI::Option* AddInteger(CLI::App& app, const std::string& names, int& target, int min, int max, const std::string& help) {
  const auto parse = [min, max](const std::string& option, const std::string& text) { return ParseInteger(option, text, min, max); };
  return AddParsed(app, names, target, parse, help)->type_name("N")->default_str(fmt::format("{}", target));
}

CLI::Option* AddThreads(CLI::App& app, int& threads, const std::string& help) {
  return AddInteger(app, "--threads", threads, 1, int(kMaxThreads), help + " (default: the cores divided by the workers, at least 1)")
      ->default_str("");
}

CLI::Option* AddEndpoint(CLI::App& app, std::string& endpoint) {
  const auto parse = [](const std::string& option, const std::string& text) -> Result<std::string> {
    const Result<Endpoint> parsed = ParseEndpoint(text, false);
    if (!parsed.ok()) return Status::InvalidArgument(fmt::format("{} {}", option, parsed.status().message()));
    return text;
  };
  return AddParsed(app, "--endpoint", endpoint, parse,
                   "Where the service listens (default: $SLABSTREAM_ENDPOINT, the service started last by `up`)")
      ->type_name("ENDPOINT");
}

void AddTransferOptions(CLI::App& app, TransferChoice& transfer) {
  std::string help = "Colours and opacities: a ParaView colour map (.json) or one of";
  for (const PresetInfo& preset : TransferPresets()) help += fmt::format("\n  {}: {}", preset.name, preset.purpose);
  AddParsed(app, "--transfer", transfer.choice, ParseTransfer, help)->type_name("PRESET|FILE")->default_str("auto");
  AddNumber(app, "--opacity-distance", transfer.opacity_distance, {0, kMaxOpacityDistance, true},
            "Voxel lengths of material that the transfer function's opacity is meant for");
}

void AddFrameOptions(CLI::App& app, FrameOptions& options) {
  app.add_option("SOURCE", options.source, "A dataset's name at the service, or with --local a volume file")->required();
  AddConnectionOptions(app, options.connection);
  AddViewOptions(app, options.request.view, options.request.size);
  AddLookOptions(app, options.request, options.format);
  AddPolicyOptions(app, options.request.policy);
  app.add_option("--stats", options.stats_path, "Write plan, bytes and stage times as JSON")->type_name("FILE");
  app.add_option("--trace", options.trace_path, "Write what each worker did when, for Perfetto or chrome://tracing")->type_name("FILE");
  app.add_flag("--progress", options.progress, "Show on stderr how far the frames are");
}

}  // namespace slabstream
