#include "client/cli/option_groups.h"

#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <span>
#include <utility>

#include "client/cli/cores.h"
#include "client/request/volume_argument.h"
#include "client/service/service_state.h"
#include "common/cli/add_option.h"
#include "common/otlp/trace_sender.h"
#include "common/volume/memory_budget.h"
#include "data/open/cache_option.h"
#include "data/volume_io/read_options.h"

namespace slabstream {
namespace {

constexpr char kSuitable[] = "suitable";  // what --local alone stands for

// Of a picture, these are options of the request: a file is a dataset with all of its channels and times.
const std::initializer_list<std::string_view> kOfRequests = {"channel", "time"};

void AddConnectionOptions(const Command& app, ConnectionOptions& connection) {
  app.GroupOptions("Service");
  const auto parse = [](const std::string& option, const std::string& text) -> Result<int> {
    if (text == kSuitable) return ConnectionOptions::kSuitableWorkers;
    return ParseInteger(option, text, 1, kMaxLocalWorkers);
  };
  AddOptionalValue(
      app, "--local", connection.local_workers, kSuitable, parse,
      fmt::format("Render the file SOURCE in this process, with N workers, or else with one for {} cores, and no more than one "
                  "for each GiB of --memory; needs no service, and is not needed where no service is named and none runs",
                  kThreadsOfAWorker))
      .TypeName("[N]");
  AddThreads(app, connection.local_threads, "Render threads of each worker of --local");
  AddParsed(app, "--memory", connection.local_memory, ParseMemoryLimit, "Memory limit of this process, with --local: 2G or 512M")
      .TypeName("SIZE")
      .Default("none");
  AddCacheOption(app, connection.local_cache);
  AddService(app, connection.service);
}

// Whether this process renders each SOURCE: --local says so, or the user names no service, and all are paths of files or, where none runs,
// files' names. Then the number of workers is known, too.
bool RendersHere(std::span<const std::string> sources, ConnectionOptions& connection) {
  const int suitable = WorkersWithin(connection.local_memory, std::min(WorkersForOneUser(), kMaxLocalWorkers));
  if (connection.local_workers == ConnectionOptions::kSuitableWorkers) connection.local_workers = suitable;
  if (connection.local_workers > 0) return true;
  const Result<ServiceChoice> named = NamedService(connection.service);
  if (!named.ok() || !named->text().empty() || !std::ranges::all_of(sources, NamesVolumeFile)) return false;
  const bool may_be_datasets =
      std::ranges::any_of(sources, [](const std::string& source) { return source.find('/') == std::string::npos; });
  if (may_be_datasets && FindState("")) return false;
  connection.local_workers = suitable;
  connection.unasked = true;
  return true;
}
bool RendersHere(const std::string& source, ConnectionOptions& connection) { return RendersHere({&source, 1}, connection); }

constexpr char kSourceHelp[] = "A dataset's name at the service, or a volume file, with --local or where no service runs";

}  // namespace

Option AddThreads(const Command& app, int& threads, const std::string& help) {
  return AddInteger(app, "--threads", threads, 1, int(kMaxThreads), help).Default("the cores divided by the workers");
}

void AddReadOptions(const Command& app, std::initializer_list<std::string_view> except) {
  app.GroupOptions(kReadingGroup);
  for (const ReadOption& option : ReadOptionList()) {
    if (std::ranges::count(except, option.name) > 0) continue;
    if (option.value.empty()) {
      const std::string purpose(option.purpose);
      app.AddFlag(fmt::format("--{}", option.name), purpose);
      continue;
    }
    const auto check = [&option](const std::string& name, const std::vector<std::string>& texts) {
      for (const std::string& text : texts) {
        ReadOptions scratch;
        if (Status status = option.set(scratch, name, text); !status.ok()) return status;
      }
      return Status::Ok();
    };
    const Option added = app.AddOption(fmt::format("--{}", option.name), check, std::string(option.purpose));
    added.TypeName(std::string(option.value));
    if (option.of_addresses) added.Repeatable();
  }
  app.GroupOptions("Options");
}

namespace {

// The source with those options for reading that were given to `app`.
std::string WithReadOptions(const Command& app, std::string source) {
  for (const ReadOption& option : ReadOptionList()) {
    const Option given = app.FindOption(fmt::format("--{}", option.name));
    const bool reads = given && given.group() == kReadingGroup;  // a command may have an option of the same name
    if (!reads) continue;
    for (const std::string& value : given.texts()) source = WithReadOption(source, option.name, value);
  }
  return source;
}

// WithReadOptions. InvalidArgument if there are such options although the source is no file.
Result<std::string> WithReadOptionsOfFile(const Command& app, const std::string& source, bool is_file) {
  std::string with_options = WithReadOptions(app, source);
  if (with_options != source && !is_file) {
    return Status::InvalidArgument(
        fmt::format("'{}' is a dataset at the service; give options for reading its file where the service names it, as in --data {}",
                    source, WithReadOptions(app, "NAME=FILE")));
  }
  return with_options;
}

// The parts of VOLUME:TRANSFER, with the options for reading that were given to `app`; without TRANSFER, `usual` is the transfer function.
Result<SourceChoice> Resolved(const Command& app, const std::string& volume, TransferChoice usual, bool is_file) {
  Result<VolumeArgument> argument = ParseVolumeArgument("SOURCE", volume, is_file);
  if (!argument.ok()) return argument.status();
  if (argument->transfer && app.FindOption("--transfer").given()) {
    return Status::InvalidArgument(fmt::format("SOURCE '{}' names a transfer function, and so does --transfer", volume));
  }
  Result<std::string> source = WithReadOptionsOfFile(app, argument->volume, is_file);
  if (!source.ok()) return source.status();
  SourceChoice choice{*std::move(source), std::move(usual)};
  if (argument->transfer) {
    choice.transfer.choice = *std::move(argument->transfer);
  } else {
    LetSurfacesStandAlone(app, choice.transfer);
  }
  return choice;
}

}  // namespace

void TakeReadOptions(const Command& app, std::string& source) {
  app.AfterParse([app, &source] {
    source = WithReadOptions(app, source);
    return Status::Ok();
  });
}

void ResolveSource(const Command& app, Option source, std::string& volume, TransferChoice& transfer, std::function<bool()> is_file) {
  app.AfterParse([app, source, &volume, &transfer, is_file = std::move(is_file)] {
    if (!source.given()) return Status::Ok();
    Result<SourceChoice> choice = Resolved(app, volume, transfer, is_file());
    if (!choice.ok()) return choice.status();
    volume = std::move(choice->source);
    transfer = std::move(choice->transfer);
    return Status::Ok();
  });
}

void AddSource(const Command& app, AskedVolume& volume) {
  app.GroupOptions("Options");
  app.AddText("SOURCE", volume.source, kSourceHelp).Required();
  AddReadOptions(app, kOfRequests);
  app.AddText("--channel", volume.field,
              "Which channel, by its number or name (`value`: channels, separated by commas); of a file also luminance, of red, green and "
              "blue, or magnitude, of a vector")
      .TypeName("CHANNEL")
      .Default("the first one that is shown");
  app.AddText("--time", volume.time, "Which time: its number, a number with a unit of time, or last, the newest one")
      .TypeName("N|3.5s|last")
      .Default("that of the file, mostly the first");
  AddConnectionOptions(app, volume.connection);
  app.GroupOptions("Options");
  app.AfterParse([app, &volume] {
    const bool is_file = RendersHere(volume.source, volume.connection);
    Result<std::string> with_options = WithReadOptionsOfFile(app, volume.source, is_file);
    if (!with_options.ok()) return with_options.status();
    volume.source = *std::move(with_options);
    // A reader mixes it; it is no field of the file.
    if (is_file && IsMixedChannel(volume.field)) volume.source = WithReadOption(volume.source, "channel", std::exchange(volume.field, ""));
    return Status::Ok();
  });
}

void AddSliceOptions(const Command& app, SliceOptions& options) {
  app.GroupOptions("Options");
  Option source = app.AddText("SOURCE", options.source, kSourceHelp).Required();
  AddReadOptions(app, kOfRequests);
  AddConnectionOptions(app, options.connection);
  AddSlicePictureOptions(app, options.slice, &options.layers);
  ResolveSource(app, source, options.source, options.slice.frame.transfer,
                [&options] { return RendersHere(options.source, options.connection); });
}

void AddFrameOptions(const Command& app, FrameOptions& options, std::vector<SourceChoice>* sources) {
  app.GroupOptions("Options");
  const std::string help = fmt::format("{}; append :TRANSFER to choose its transfer function", kSourceHelp);
  auto texts = std::make_shared<std::vector<std::string>>();  // of several sources
  const Option source = sources == nullptr ? app.AddText("SOURCE", options.source, help).Required()
                                           : app.AddTexts("SOURCE", *texts, help + "; several make a picture each").Required();
  AddReadOptions(app, kOfRequests);
  AddConnectionOptions(app, options.connection);
  AddRenderPictureOptions(app, options.request, options.format, &options.layers);
  if (sources == nullptr) {
    ResolveSource(app, source, options.source, options.request.transfer,
                  [&options] { return RendersHere(options.source, options.connection); });
  } else {
    app.AfterParse([app, &options, texts, sources] {
      const bool here = RendersHere(*texts, options.connection);
      for (const std::string& text : *texts) {
        Result<SourceChoice> choice = Resolved(app, text, options.request.transfer, here);
        if (!choice.ok()) return choice.status();
        sources->push_back(*std::move(choice));
      }
      return Status::Ok();
    });
  }
  app.GroupOptions(kOutputGroup);
  app.AddFlag("!--no-record", options.record,
              "Leave the record out of pictures: SOURCE, options and version, as `slabstream info PICTURE` prints them");
  app.AddText("--save-camera", options.camera_path, "Write the camera that was used to a file for --camera and --path").TypeName("FILE");
  app.AddText("--stats", options.stats_path, "Write plan, bytes and stage times as JSON").TypeName("FILE");
  app.AddText("--trace", options.trace_path, "Write the timeline of each worker, for Perfetto or chrome://tracing").TypeName("FILE");
  AddParsed(app, "--otlp", options.collector, ParseCollector,
            "Send the timeline to an OpenTelemetry collector, by OTLP over HTTP without TLS; the path is /v1/traces unless given")
      .TypeName("URL");
  app.AddFlag("--progress", options.progress, "Show progress on stderr");
}

}  // namespace slabstream
