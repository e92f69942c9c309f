#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <memory>
#include <utility>

#include "client/cli/commands.h"
#include "client/cli/completion.h"
#include "client/cli/cores.h"
#include "client/cli/laboratory.h"
#include "client/cli/option_groups.h"
#include "client/cli/picture_orders.h"
#include "client/movie/movie_format.h"
#include "client/movie/turntable.h"
#include "client/request/camera_file.h"
#include "client/request/picture_options.h"
#include "common/base/find_named.h"
#include "common/cli/program.h"
#include "common/text/parse_number.h"
#include "common/transport/this_machine.h"
#include "common/volume/memory_budget.h"
#include "data/catalogue/catalogue.h"
#include "data/isosurface/mesh_file.h"
#include "data/open/cache_option.h"
#include "data/volume_io/formats.h"

namespace slabstream {
namespace {

// The options of a command, for the parse. If the command was typed, `execute` runs with them.
template <class Options>
Options& OptionsOf(const CommandLine& line, const Command& sub, Status (*execute)(const Options&)) {
  auto options = std::make_shared<Options>();
  sub.OnTyped([&run = line.run, options, execute] { run = [options, execute] { return execute(*options); }; });
  return *options;
}

void DeclareRender(const CommandLine& line) {
  const Command sub = line.app.AddCommand("render", "Render a picture of a volume, or of each of several");
  RenderOptions& options = OptionsOf(line, sub, RunRender);
  sub.AddText("-o,--output", options.output,
              fmt::format("The picture: {}; of several SOURCEs, with {} in the place of their names", PictureEndings(), kNamePlace))
      .Required()
      .TypeName("FILE")
      .Group(kOutputGroup);
  AddFrameOptions(sub, options.frame, &options.sources);
  AddRequestOption(sub, *FindRequestOption("previews"), options.frame.request);
}

void DeclareTurntable(const CommandLine& line) {
  const Command sub =
      line.app.AddCommand("turntable", "Render a full turn about the volume's z axis, or volumes over time, as pictures or as a movie");
  TurntableOptions& options = OptionsOf(line, sub, RunTurntable);
  sub.GroupOptions(kOutputGroup);
  AddParsed(sub, "-o,--output", options.output, ParseTurntableOutput,
            "Pictures: a name with a place for the number, such as 'frame_%04d.png'; or a movie, " + MovieEndings() +
                ", encoded by the program ffmpeg")
      .Required()
      .TypeName("PATTERN|MOVIE");
  AddParsed(
      sub, "--frames", options.frames,
      [](const std::string& option, const std::string& text) { return ParseInteger(option, text, 1, kMaxTurntableFrames); },
      "Number of frames, spread evenly over turns, path and times")
      .TypeName("N")
      .Default("one for each time of --time, or the seconds of --path");
  const Option turns = AddInteger(sub, "--turns", options.turns, 0, kMaxTurns, kTurnsHelp);
  const Option path = AddParsed(sub, "--path", options.path, ParsePathFile, kPathHelp).TypeName("FILE").Excludes(turns);
  const auto set_times = [&options](const std::string& option, const std::vector<std::string>& texts) {
    const Result<TimeSteps> times = ParseTimeSteps(option, texts.back());
    if (times.ok()) options.times = *times;
    const bool number = times.ok() || texts.back().find(':') != std::string::npos;
    if (!number) options.frame.request.time = texts.back();
    return number ? times.status() : Status::Ok();
  };
  sub.AddOption("--time", set_times, kTimesHelp).TypeName(kTimesValue);
  AddParsed(
      sub, "--fps", options.frames_per_second,
      [](const std::string& option, const std::string& text) {
        return ParseNumber(option, text, {kMinFramesPerSecond, kMaxFramesPerSecond});
      },
      kFramesPerSecondHelp)
      .TypeName("NUMBER")
      .Default(fmt::format("{:g}", MovieShape().frames_per_second));
  AddInteger(sub, "--in-flight", options.in_flight, 1, kMaxInFlight, "Number of frames requested at the same time");
  AddFrameOptions(sub, options.frame);
  ExcludeViewOptions(sub, path);
  path.Excludes(sub.FindOption("--camera"));
}

void DeclareSlice(const CommandLine& line) {
  const Command sub = line.app.AddCommand("slice", "Render planes or thick slabs of a volume");
  SliceOptions& options = OptionsOf(line, sub, RunSlice);
  sub.AddText("-o,--output", options.output, "The picture: " + PictureEndings()).Required().TypeName("FILE").Group(kOutputGroup);
  AddSliceOptions(sub, options);
}

void DeclareInfo(const CommandLine& line) {
  const Command sub = line.app.AddCommand(
      "info", "Print size, type, orientation and values of a volume file, the cells of an unstructured grid, or the record of a picture");
  InfoOptions& options = OptionsOf(line, sub, RunInfo);
  Option source = sub.AddText("SOURCE", options.path, "A volume file, as FILE or FILE:TRANSFER, or a picture, .png or .exr").Required();
  for (const char* name : {"transfer", "scalar-range", "opacity-distance"})
    AddRequestOption(sub, *FindRequestOption(name), options.request);
  AddLayerFiles(sub, options.layers);
  AddReadOptions(sub);
  AddCacheOption(sub, options.cache);
  ResolveSource(sub, source, options.path, options.request.transfer, [] { return true; });
  sub.AddFlag("--json", options.json, "Print JSON");
}

void DeclareValue(const CommandLine& line) {
  const Command sub = line.app.AddCommand("value", "Print voxel, value and label at points of a dataset or a volume file");
  ValueOptions& options = OptionsOf(line, sub, RunValue);
  AddSource(sub, options.volume);
  AddRepeated(sub, "--at", options.points, "A point of the world").Required().TypeName("X,Y,Z");
  AddLayerFiles(sub, options.layers);
  sub.AddFlag("--json", options.json, "Print JSON");
}

void DeclareMeasure(const CommandLine& line) {
  const Command sub = line.app.AddCommand("measure", "Measure distances, angles, profiles, boxes and labels in a dataset or a volume file");
  MeasureOptions& options = OptionsOf(line, sub, RunMeasure);
  AddSource(sub, options.volume);
  sub.GroupOptions("Measures, in the unit of the world (mm of a patient); each may be repeated");
  AddRepeated(sub, "--distance", options.distances, "Distance of two points of the world").TypeName("X,Y,Z:X,Y,Z");
  AddRepeated(sub, "--angle", options.angles, "Angle at the second of three points").TypeName("X,Y,Z:X,Y,Z:X,Y,Z");
  AddRepeated(sub, "--profile", options.profiles, "Values from one point to another, interpolated between voxels").TypeName("X,Y,Z:X,Y,Z");
  AddInteger(sub, "--samples", options.samples, 2, int(kMaxSamplePoints), "Values of each profile").Default("one for each voxel");
  AddRepeated(sub, "--box", options.boxes,
              "Mean, standard deviation and extremes of the voxels with their centres in a box, given as for --clip-box of `render`")
      .TypeName("X0:X1,Y0:Y1,Z0:Z1");
  sub.AddOption(
         "--labels",
         [&options](const std::string&, const std::vector<std::string>& texts) {
           options.labels = true;
           if (!texts.back().empty()) SetLabelFiles(texts.back(), options.layers);
           return Status::Ok();
         },
         "Volume, mean, standard deviation and extremes of each label: of the dataset's labels, or with --local of those in FILE, which "
         "are laid onto the voxels of SOURCE")
      .TypeName("[FILE]")
      .MaybeValue();
  sub.GroupOptions("Options");
  const Option json = sub.AddFlag("--json", options.json, "Print JSON");
  sub.AddFlag("--csv", options.csv, "Print the table of --labels as comma-separated values").Excludes(json);
}

void DeclareTransfer(const CommandLine& line) {
  const Command sub = line.app.AddCommand("transfer", "Print a preset transfer function as JSON for --transfer");
  TransferOptions& options = OptionsOf(line, sub, RunTransfer);
  std::vector<std::string_view> names;
  for (const TransferPreset& preset : TransferPresets()) names.push_back(preset.name);
  const Option preset = AddParsed(
      sub, "PRESET", options.request.transfer.choice,
      [is_name = OneOf(names)](const std::string& option, const std::string& text) -> Result<std::variant<std::string, TransferFunction>> {
        const Result<std::string> name = is_name(option, text);
        if (!name.ok()) return name.status();
        return std::variant<std::string, TransferFunction>(*name);
      },
      "Which" + Explained(TransferPresets()));
  preset.Choices(names);
  sub.AddText("SOURCE", options.path, "The volume file: a preset depends on its values");
  const Option list = sub.AddFlag("--list", options.list, "Print the names of all presets; on a terminal with the colours of colour maps");
  sub.AddText("--preview", options.preview, "With --list: draw the colour maps into a picture: " + PictureEndings())
      .TypeName("FILE")
      .Needs(list);
  AddRequestOption(sub, *FindRequestOption("scalar-range"), options.request);
  AddReadOptions(sub);
  TakeReadOptions(sub, options.path);
}

// X0:X1,Y0:Y1,Z0:Z1 in voxels; a missing end is the volume's, which 0 stands for.
Result<Box> ParseVoxelBox(const std::string& option, const std::string& text) {
  Box box;
  const std::vector<std::string_view> axes = Split(text, ',');
  const auto refuse = [&] { return Status::InvalidArgument(fmt::format("{} '{}' is not X0:X1,Y0:Y1,Z0:Z1", option, text)); };
  if (axes.size() != 3) return refuse();
  for (const Axis axis : {Axis::kX, Axis::kY, Axis::kZ}) {
    const std::vector<std::string_view> ends = Split(axes[std::size_t(Number(axis))], ':');
    if (ends.size() != 2) return refuse();
    for (const bool high : {false, true}) {
      if (ends[high ? 1 : 0].empty()) continue;
      const Result<int> bound = ParseInteger(option, ends[high ? 1 : 0], high ? 1 : 0, kMaxVolumeSide);
      if (!bound.ok()) return bound.status();
      (high ? box.end : box.begin)[axis] = *bound;
    }
  }
  return box;
}

void DeclareConvert(const CommandLine& line) {
  const Command sub = line.app.AddCommand("convert", "Write a volume in another format, or with samples of another type");
  ConvertOptions& options = OptionsOf(line, sub, RunConvert);
  sub.AddText("SOURCE", options.source, "A volume file, or a folder of slices").Required();
  sub.AddText("OUTPUT", options.output, "The file to write: " + WritableEndings() + "; or a folder, .ome.zarr").Required();
  AddParsed(
      sub, "--type", options.type,
      [](const std::string& option, const std::string& text) -> Result<std::optional<SampleType>> {
        ReadOptions parsed;
        const Status status = FindNamed(ReadOptionList(), "type")->set(parsed, option, text);
        return status.ok() ? Result(parsed.type) : status;
      },
      "Type of the samples in OUTPUT: " + SampleTypeNames() +
          "; every value must fit. Raw samples in SOURCE have this type too, unless SOURCE says ?type=...")
      .TypeName("TYPE")
      .Default("the type of SOURCE, or the smallest that holds its values");
  AddInteger(sub, "--level", options.level, 0, kMaxLevels - 1, "Convert this level of SOURCE; 0 is the finest one");
  AddParsed(sub, "--box", options.box, ParseVoxelBox, "Convert these voxels of the level alone: from each first one to before the second")
      .TypeName("X0:X1,Y0:Y1,Z0:Z1")
      .Default("all");
  AddParsed(sub, "--memory", options.memory, ParseMemoryLimit, "Memory limit of this process: 2G or 512M")
      .TypeName("SIZE")
      .Default("none; 1G for what is not read as a whole");
  AddCacheOption(sub, options.cache);
  AddParsed(
      sub, "--zarr-version", options.zarr_version,
      [](const std::string& option, const std::string& text) -> Result<OmeZarrVersion> {
        for (const OmeZarrVersion version : {OmeZarrVersion::k04, OmeZarrVersion::k05}) {
          if (text == ToString(version)) return version;
        }
        return Status::InvalidArgument(option + ": expected 0.4 or 0.5, not '" + text + "'");
      },
      "Version of an OME-Zarr: 0.4 (Zarr 2) or 0.5 (Zarr 3 with shards)")
      .TypeName("VERSION")
      .Default("0.5");
  sub.AddFlag("--progress", options.progress, "Show progress on stderr");
  AddReadOptions(sub, {"type"});
  TakeReadOptions(sub, options.source);
}

void DeclareIndex(const CommandLine& line) {
  const Command sub = line.app.AddCommand(
      "index", "Read a volume once and note the values of its parts, so that later pictures read only what can show something");
  IndexingOptions& options = OptionsOf(line, sub, RunIndex);
  sub.AddText("SOURCE", options.source,
              "A volume that is read in parts: a file, or a folder such as an OME-Zarr; or an unstructured grid, whose cells are put in "
              "order on disk")
      .Required();
  AddParsed(sub, "--memory", options.memory, ParseMemoryLimit, "Memory limit of this process: 2G or 512M").TypeName("SIZE").Default("1G");
  AddCacheOption(sub, options.cache);
  sub.AddFlag("--progress", options.progress, "Show progress on stderr");
  AddReadOptions(sub);
  TakeReadOptions(sub, options.source);
}

Result<SurfaceShare> ParseSurfaceShare(const std::string& option, const std::string& text) {
  const std::size_t slash = std::min(text.find('/'), text.size());
  const std::optional<int> part = ParseNumber<int>(text.substr(0, slash)),
                           parts = ParseNumber<int>(text.substr(std::min(slash + 1, text.size())));
  if (part && parts && *part >= 1 && *part <= *parts && *parts <= kMostSurfaceParts) return SurfaceShare{*part, *parts};
  return Status::InvalidArgument(
      fmt::format("{}: expected K/N, such as 3/16, with K from 1 to N and N at most {}, not '{}'", option, kMostSurfaceParts, text));
}

void DeclareIsosurface(const CommandLine& line) {
  const Command sub = line.app.AddCommand("isosurface", "Write the surface of an isovalue or of a label as a mesh");
  IsosurfaceCommandOptions& options = OptionsOf(line, sub, RunIsosurface);
  sub.AddText("SOURCE", options.source, "A volume file, or a folder such as an OME-Zarr").Required();
  sub.AddText("-o,--output", options.output, "The mesh: " + MeshEndings()).Required().TypeName("FILE").Group(kOutputGroup);
  const Option isovalue = AddParsed(
                              sub, "--isovalue", options.isovalue,
                              [](const std::string& option, const std::string& text) -> Result<std::optional<double>> {
                                const double most = std::numeric_limits<double>::max();
                                const Result<double> value = ParseNumber(option, text, {-most, most});
                                return value.ok() ? Result(std::optional(*value)) : value.status();
                              },
                              "The value of the surface")
                              .TypeName("NUMBER");
  AddParsed(
      sub, "--label", options.label,
      [](const std::string& option, const std::string& text) -> Result<std::optional<std::uint64_t>> {
        const std::optional<std::uint64_t> label = ParseNumber<std::uint64_t>(text);
        if (label && *label > 0) return label;
        return Status::InvalidArgument(fmt::format("{}: expected a whole number of at least 1, not '{}'", option, text));
      },
      "The label whose smooth surface is wanted; the values of SOURCE are labels then")
      .TypeName("N")
      .Excludes(isovalue);
  AddInteger(sub, "--level", options.level, 0, kMaxLevels - 1, "The level of SOURCE; 0 is the finest one");
  sub.AddFlag("--caps", options.caps, "Close the surface where it leaves the volume");
  AddParsed(
      sub, "--part", options.share, ParseSurfaceShare,
      "Make part K of N alone: start N commands that differ in K alone, on hosts that see the same files. Who ends last joins the parts")
      .TypeName("K/N");
  AddCacheOption(sub, options.cache);
  sub.AddFlag("--progress", options.progress, "Show progress on stderr");
  AddReadOptions(sub, {"ids"});
  TakeReadOptions(sub, options.source);
}

void DeclareSphere(const CommandLine& line) {
  const Command sub = line.app.AddCommand("sphere", "Make one of the two test volumes of Yagel and Machiraju");
  SphereOptions& options = OptionsOf(line, sub, RunSphere);
  AddParsed(
      sub, "--class", options.request.sphere_class,
      [](const std::string& option, const std::string& text) -> Result<SphereClass> {
        const Result<int> number = ParseInteger(option, text, 1, 2);
        if (!number.ok()) return number.status();
        return SphereClass(*number);
      },
      "1: hollow, 2: filled")
      .Required()
      .TypeName("N");
  AddInteger(sub, "--size", options.request.size, 2, 4096, "Voxels a side").Required();
  AddNumber(sub, "--occupancy", options.request.occupancy, {0, 1, true}, "Share of voxels that are not empty");
  sub.AddText("-o,--output", options.output, "The volume: " + WritableEndings()).Required().TypeName("FILE");
}

void DeclareClusters(const CommandLine& line) {
  const Command sub = line.app.AddCommand("clusters", "Make a sparse test volume: balls that lie dense near a corner");
  ClustersOptions& options = OptionsOf(line, sub, RunClusters);
  AddInteger(sub, "--size", options.request.size, 8, 4096, "Voxels a side").Required();
  AddNumber(sub, "--occupancy", options.request.occupancy, {0.001, 0.3}, "Share of voxels that are not empty");
  AddInteger(sub, "--balls", options.request.balls, 1, 1000, "How many");
  AddInteger(sub, "--seed", options.request.seed, 0, std::numeric_limits<int>::max(), "Of their places");
  AddNumber(sub, "--time", options.request.time, {0, 1}, "They drift along x: 0 is the beginning, 1 the end");
  sub.AddText("-o,--output", options.output, "The volume: " + WritableEndings()).Required().TypeName("FILE");
}

void DeclareUp(const CommandLine& line) {
  const Command sub = line.app.AddCommand("up", "Start a coordinator and workers on this machine");
  auto options = std::make_shared<UpOptions>();
  options->listen = fmt::format("tcp://{}:7420", OwnHost());
  AddInteger(sub, "--workers", options->workers, 1, kMaxUpWorkers, "Worker processes")
      .Default("one a core, but no more than one for each GiB of --memory");
  AddThreads(sub, options->threads, "Render threads of each worker");
  AddRepeated(sub, "--data", options->data, kDataHelp).TypeName("[NAME=]FILE|FOLDER");
  AddParsed(sub, "--listen", options->listen, EndpointText(true),
            "Address of this machine for clients; port * takes any free port. An address that is not loopback gets keys")
      .TypeName("ENDPOINT")
      .Default(options->listen);
  AddOptionalValue(
      sub, "--compress", options->compress, "on", OneOf({"auto", "on", "off"}),
      "Compress images with zstd. auto: between workers whose link is slower than zstd. on (--compress alone): all images between workers, "
      "and pictures for clients behind a slow tunnel. off: never")
      .TypeName("[=MODE]")
      .Default("auto");
  sub.AddText("--keys", options->keys, "Encrypt connections with the keys in this folder; make it if it does not exist")
      .TypeName("FOLDER")
      .Default("a folder beside the logs if --listen is not loopback, else none");
  options->memory = DefaultServiceMemory();
  AddParsed(sub, "--memory", options->memory, ParseMemoryLimit,
            "Memory limit of all processes: the coordinator gets a third, the workers share the rest")
      .TypeName("SIZE")
      .Default(fmt::format("three quarters of this machine's memory: {}", MemoryText(options->memory)));
  AddCacheOption(sub, options->cache);
  AddInteger(sub, "--metrics", options->metrics, 1, 65535,
             "Serve metrics for Prometheus on loopback: the coordinator at this port, each worker at one of the next")
      .TypeName("PORT")
      .Default("no metrics");
  sub.AddFlag("--unlisted", options->unlisted).Group(kHidden);
  sub.AddFlag("--detach", options->detach, "Return when the service is ready; `slabstream down` ends it");
  AddLogLevel(sub, line.log_level).Default("info for the processes that it starts, warning for itself");
  sub.OnTyped([&run = line.run, options, &log_level = line.log_level] {
    run = [options, &log_level] {
      options->log_level = log_level;
      if (options->workers == 0) options->workers = WorkersWithin(options->memory, std::min(CoreCount(), kMaxUpWorkers));
      return RunUp(*options);
    };
  });
}

Result<std::string> ParseLoopbackPort(std::string_view option, std::string_view text) {
  const Result<int> port = ParseInteger(option, text, 0, 65535);
  if (!port.ok()) return port.status();
  return fmt::format("{}:{}", OwnHost(), *port);
}

void DeclareView(const CommandLine& line) {
  const Command sub =
      line.app.AddCommand("view", "Show a volume in the browser; starts a service and a gateway if needed, and ends them at Ctrl-C");
  ViewOptions& options = OptionsOf(line, sub, RunView);
  sub.AddText("SOURCE", options.source, "A volume file, which a new service serves, or the name of a dataset at the service").Required();
  AddLayerFiles(sub, options.layers, nullptr);
  AddReadOptions(sub);
  TakeReadOptions(sub, options.source);
  AddService(sub, options.service);
  AddCacheOption(sub, options.cache);
  options.listen = OwnHost() + ":0";
  const Option listen = sub.AddText("--listen", options.listen, "Address of the gateway; port 0 takes any free port")
                            .TypeName("HOST:PORT")
                            .Default(options.listen);
  AddParsed(sub, "--port", options.listen, ParseLoopbackPort,
            "Port of the gateway on this machine: with --token-file, an address that stays")
      .TypeName("PORT")
      .Excludes(listen);
  sub.AddText("--token-file", options.token_file, "Use the token in this file; make the file, with a new token, if it does not exist")
      .TypeName("FILE");
  sub.AddFlag("!--no-browser", options.browser, "Only print the address");
}

Result<Duration> ParseLifetime(std::string_view option, std::string_view text) {
  constexpr Duration kLongest = std::chrono::hours(24 * 366);
  Result<Duration> lasts = ParseDuration(option, text, kLongest);
  if (!lasts.ok() || *lasts >= std::chrono::seconds(1)) return lasts;
  return Status::InvalidArgument(fmt::format("{} {} is less than 1s", option, text));
}

Result<std::string> ParseTokenDataset(std::string_view option, std::string_view text) {
  if (!text.empty() && text.size() <= kMaxNameBytes) return std::string(text);
  return Status::InvalidArgument(fmt::format("{} has {} bytes, must have 1 to {}", option, text.size(), kMaxNameBytes));
}

void DeclareToken(const CommandLine& line) {
  const Command sub =
      line.app.AddCommand("token", "Make a token for a gateway that expires, and may be for viewing or some datasets alone");
  TokenOptions& options = OptionsOf(line, sub, RunToken);
  AddParsed(sub, "--for", options.lasts, ParseLifetime, "How long it is valid, from now on").Required().TypeName("TIME");
  AddParsedList(sub, "--dataset", options.datasets, ParseTokenDataset, "Only for this dataset; may be given several times")
      .TypeName("NAME")
      .Default("all of the service");
  sub.AddFlag("--view-only", options.view_only, "Its holder may send no files and change no parameters of simulations");
  sub.AddText("--token-file", options.token_file, "The file with the gateway's own token")
      .TypeName("FILE")
      .Default("the token of the gateway that this user started here last");
}

void DeclareDown(const CommandLine& line) {
  const Command sub = line.app.AddCommand("down", "End a service that `up` started");
  DownOptions& options = OptionsOf(line, sub, RunDown);
  const Option endpoint = AddService(sub, options.service);
  sub.AddFlag("--all", options.all, "End every service that `up` started here").Excludes(endpoint).Excludes(sub.FindOption("--service"));
}

void DeclareStatus(const CommandLine& line) {
  const Command sub = line.app.AddCommand("status", "Show a service's workers, datasets and frames");
  StatusOptions& options = OptionsOf(line, sub, RunStatus);
  AddService(sub, options.service);
  sub.AddFlag("--json", options.json, "Print JSON");
}

void DeclareKeys(const CommandLine& line) {
  const Command sub = line.app.AddCommand("keys", "List, issue, change and revoke the keys that a service admits; for admins");
  sub.TakeCommand(true);
  const auto declare = [&](const char* name, const char* purpose, KeysAction action) {
    const Command order = sub.AddCommand(name, purpose);
    KeysOptions& options = OptionsOf(line, order, RunKeys);
    options.order.action = action;
    AddService(order, options.service);
    return std::pair<Command, KeysOptions&>(order, options);
  };
  declare("list", "List the keys: id, role, when they were made, public key, name, and when each was heard last", KeysAction::kList);
  const auto [issue, issue_options] = declare("issue", "Make a key for one person, and write a service file with it", KeysAction::kIssue);
  issue.AddText("--name", issue_options.order.name, "Whose key it is; `status`, `keys list` and `keys revoke` know it by this name")
      .Required()
      .TypeName("NAME");
  AddChoice<Role, 2>(issue, "--role", issue_options.order.role, {NameOf(Role::kClient), NameOf(Role::kAdmin)},
                     {Role::kClient, Role::kAdmin}, "What its holder may do: client or admin")
      .Default("client");
  issue.AddText("-o,--output", issue_options.output, "The service file, which must not exist yet").TypeName("FILE").Default("NAME.json");
  const auto [rotate, rotate_options] =
      declare("rotate", "Put a new key into the service file of a role; old keys stay valid until they are revoked", KeysAction::kRotate);
  AddChoice<Role, kRoles.size()>(rotate, "ROLE", rotate_options.order.role,
                                 {NameOf(kRoles[0]), NameOf(kRoles[1]), NameOf(kRoles[2]), NameOf(kRoles[3])}, kRoles,
                                 "client, worker, admin or owner")
      .Required();
  const auto [revoke, revoke_options] = declare("revoke", "Revoke a key and end its connections", KeysAction::kRevoke);
  revoke
      .AddText("KEY", revoke_options.order.key,
               "The name or the id of a key, or the public key itself, as `slabstream keys list` shows them")
      .Required();
}

void DeclareData(const CommandLine& line) {
  const Command sub = line.app.AddCommand(
      "data", "List, add, remove and reload datasets of a running service; changes need an admin's key if the service has keys");
  sub.TakeCommand(true);
  const auto declare = [&](const char* name, const char* purpose, DataAction action) {
    const Command order = sub.AddCommand(name, purpose);
    DataOptions& options = OptionsOf(line, order, RunData);
    options.order.action = action;
    AddService(order, options.service);
    order.AddFlag("--json", options.json, "Print JSON");
    return std::pair<Command, DataOptions&>(order, options);
  };
  declare("list", "Print each dataset: state, size, samples and last error", DataAction::kList);
  const auto [add, add_options] =
      declare("add", "Add volumes, or folders to watch, until the coordinator ends; paths are on the coordinator's host", DataAction::kAdd);
  add.AddTexts("DATA", add_options.order.items, "FILE, NAME=FILE or a folder, as for --data of `slabstream up`, with an absolute path")
      .Required();
  const auto [remove, remove_options] =
      declare("remove", "Remove datasets from the catalogue, or stop watching folders. Files are not deleted, and running frames finish",
              DataAction::kRemove);
  remove.AddTexts("NAME", remove_options.order.items, "Names of datasets, or the absolute paths of watched folders").Required();
  const auto [reload, reload_options] =
      declare("reload", "Read the files again at the next frame, even if they seem unchanged. Running frames finish with the old voxels",
              DataAction::kReload);
  reload.AddTexts("NAME", reload_options.order.items, "Names of datasets").Required();
}

void DeclareSteer(const CommandLine& line) {
  const Command sub =
      line.app.AddCommand("steer", "Change parameters of a simulation whose voxels a running service shows, and print them");
  SteerOptions& options = OptionsOf(line, sub, RunSteer);
  sub.AddText("DATASET", options.order.dataset, "The dataset that the simulation holds").Required();
  sub.AddTexts("VALUES", options.values, "NAME=VALUE of parameters; none: print what they are");
  AddService(sub, options.service);
  sub.AddFlag("--json", options.json, "Print JSON");
}

void DeclareLogs(const CommandLine& line) {
  const Command sub = line.app.AddCommand("logs", "Print the logs of a service that `up` started on this machine, in order of time");
  LogsOptions& options = OptionsOf(line, sub, RunLogs);
  AddService(sub, options.service);
  sub.AddFlag("--follow", options.follow, "Print new lines until the service ends, or Ctrl-C");
  constexpr Duration kLongest = std::chrono::hours(24 * 365);
  AddParsed(
      sub, "--since", options.since,
      [kLongest](const std::string& option, const std::string& text) { return ParseDuration(option, text, kLongest); },
      "Skip older lines: 30s, 10m or 2h")
      .TypeName("TIME")
      .Default("the beginning");
}

void DeclareSlurm(const CommandLine& line) {
  const Command sub = line.app.AddCommand("slurm", "Print a job script for Slurm: a service on the nodes of a cluster");
  SlurmOptions& options = OptionsOf(line, sub, RunSlurm);
  AddInteger(sub, "--nodes", options.nodes, 1, kMaxJobNodes, "Nodes with workers; the coordinator runs on one of them");
  AddInteger(sub, "--workers-per-node", options.workers_per_node, 1, kMaxWorkersPerNode, "Worker processes on each node");
  AddInteger(sub, "--threads", options.threads, 1, int(kMaxThreads),
             "Render threads of each worker, for nodes that are shared with other jobs")
      .Default("the job gets whole nodes, and workers divide their cores");
  sub.AddText("--time", options.time, "Time limit of the job, as Slurm takes it: 90 (minutes), 1:30:00, 2-12:00:00")
      .TypeName("TIME")
      .Default("the partition's");
  AddInteger(sub, "--notice", options.notice_seconds, 1, kMaxNoticeSeconds,
             "Seconds before the time limit at which workers leave; below --time");
  AddRepeated(sub, "--data", options.data, kDataHelp).Required().TypeName("[NAME=]FILE|FOLDER");
  sub.AddText("--folder", options.folder, "Folder shared by all nodes; each job makes a folder in it for its service files")
      .TypeName("FOLDER")
      .Default("the folder from which the job is submitted");
  AddRepeated(sub, "--sbatch", options.directives, "A further option for sbatch, without its dashes, such as partition=long")
      .TypeName("OPTION");
}

void DeclareAnnotate(const CommandLine& line) {
  const Command sub = line.app.AddCommand(kAnnotateCommand, "Draw annotations onto the pixels on stdin; for the Python package");
  sub.Group(kHidden);
  sub.OnTyped([&run = line.run] { run = RunAnnotate; });
}

}  // namespace

std::span<const DeclareCommand> ClientCommands() {
  static constexpr DeclareCommand kCommands[] = {
      DeclareRender,  DeclareTurntable, DeclareSlice,      DeclareInfo,       DeclareValue,    DeclareMeasure, DeclareTransfer,
      DeclareConvert, DeclareIndex,     DeclareIsosurface, DeclareSphere,     DeclareClusters, DeclareUp,      DeclareView,
      DeclareToken,   DeclareDown,      DeclareStatus,     DeclareAnnotate,   DeclareKeys,     DeclareData,    DeclareSteer,
      DeclareLogs,    DeclareSlurm,     DeclareLaboratory, DeclareCompletion, DeclareHelpPages};
  return kCommands;
}

}  // namespace slabstream
