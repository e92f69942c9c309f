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
#include "common/wire/control_messages.h"
#include "data/open/cache_option.h"
#include "data/volume_io/read_options.h"

namespace slabstream {
namespace {

constexpr char kSuitable[] = "suitable";  // what --local alone stands for

void AddConnectionOptions(CLI::App& app, ConnectionOptions& connection) {
  app.option_defaults()->group("Service");
  const auto parse = [](const std::string& option, const std::string& text) -> Result<int> {
    if (text == kSuitable) return ConnectionOptions::kSuitableWorkers;
    return ParseInteger(option, text, 1, kMaxLocalWorkers);
  };
  AddOptionalValue(
      app, "--local", connection.local_workers, kSuitable, parse,
      fmt::format("Render the file SOURCE in this process, with N workers, or else with one for {} cores, and no more than one "
                  "for each GiB of --memory; needs no service, and is not needed where no service is named and none runs",
                  kThreadsOfAWorker))
      ->type_name("[N]");
  AddThreads(app, connection.local_threads, "Render threads of each worker of --local");
  AddParsed(app, "--memory", connection.local_memory, ParseMemoryLimit, "Memory limit of this process, with --local: 2G or 512M")
      ->type_name("SIZE")
      ->default_str("none");
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

CLI::Option* AddThreads(CLI::App& app, int& threads, const std::string& help) {
  return AddInteger(app, "--threads", threads, 1, int(kMaxThreads), help)->default_str("the cores divided by the workers");
}

void AddReadOptions(CLI::App& app, std::initializer_list<std::string_view> except) {
  app.option_defaults()->group(kReadingGroup);
  for (const ReadOption& option : ReadOptionList()) {
    if (std::ranges::count(except, option.name) > 0) continue;
    if (option.value.empty()) {
      const std::string purpose(option.purpose);
      app.add_flag(fmt::format("--{}", option.name), purpose);
      continue;
    }
    const auto check = [&option](const CLI::results_t& texts) {
      for (const std::string& text : texts) {
        ReadOptions scratch;
        if (Status status = option.set(scratch, fmt::format("--{}", option.name), text); !status.ok()) {
          throw CLI::ValidationError(status.message());
        }
      }
      return true;
    };
    CLI::Option* const added = app.add_option(fmt::format("--{}", option.name), CLI::callback_t(check), std::string(option.purpose))
                                   ->type_name(std::string(option.value));
    if (option.of_addresses) added->expected(1)->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
  }
  app.option_defaults()->group("Options");
}

std::string WithReadOptions(const CLI::App& app, std::string source) {
  for (const ReadOption& option : ReadOptionList()) {
    const CLI::Option* const given = app.get_option_no_throw(fmt::format("--{}", option.name));
    const bool reads = given != nullptr && given->get_group() == kReadingGroup;  // a command may have an option of the same name
    if (!reads) continue;
    for (const std::string& value : given->results()) source = WithReadOption(source, option.name, value);
  }
  return source;
}

namespace {

// WithReadOptions. Throws what CLI11 takes for an error if there are such options although the source is no file.
std::string WithReadOptionsOfFile(const CLI::App& app, const std::string& source, bool is_file) {
  std::string with_options = WithReadOptions(app, source);
  if (with_options != source && !is_file) {
    throw CLI::ValidationError(
        fmt::format("'{}' is a dataset at the service; give options for reading its file where the service names it, as in --data {}",
                    source, WithReadOptions(app, "NAME=FILE")));
  }
  return with_options;
}

// The parts of VOLUME:TRANSFER, with the options for reading that were given to `app`; without TRANSFER, `usual` is the transfer function.
SourceChoice Resolved(const CLI::App& app, const std::string& volume, TransferChoice usual, bool is_file) {
  Result<VolumeArgument> argument = ParseVolumeArgument("SOURCE", volume, is_file);
  if (!argument.ok()) throw CLI::ValidationError(argument.status().message());
  if (argument->transfer && app.get_option("--transfer")->count() > 0) {
    throw CLI::ValidationError(fmt::format("SOURCE '{}' names a transfer function, and so does --transfer", volume));
  }
  SourceChoice choice{WithReadOptionsOfFile(app, argument->volume, is_file), std::move(usual)};
  if (argument->transfer) {
    choice.transfer.choice = *std::move(argument->transfer);
  } else {
    LetSurfacesStandAlone(app, choice.transfer);
  }
  return choice;
}

}  // namespace

void ResolveSource(CLI::App& app, const CLI::Option* source, std::string& volume, TransferChoice& transfer, std::function<bool()> is_file) {
  app.parse_complete_callback([&app, source, &volume, &transfer, is_file = std::move(is_file)] {
    if (source->count() == 0) return;
    const bool file = is_file();
    SourceChoice choice = Resolved(app, volume, transfer, file);
    volume = std::move(choice.source);
    transfer = std::move(choice.transfer);
  });
}

void AddSource(CLI::App& app, std::string& source, ConnectionOptions& connection) {
  app.option_defaults()->group("Options");
  app.add_option("SOURCE", source, kSourceHelp)->required();
  AddReadOptions(app);
  AddConnectionOptions(app, connection);
  app.option_defaults()->group("Options");
  app.parse_complete_callback(
      [&app, &source, &connection] { source = WithReadOptionsOfFile(app, source, RendersHere(source, connection)); });
}

void AddSliceOptions(CLI::App& app, SliceOptions& options) {
  app.option_defaults()->group("Options");
  CLI::Option* source = app.add_option("SOURCE", options.source, kSourceHelp)->required();
  AddReadOptions(app);
  AddConnectionOptions(app, options.connection);
  AddSlicePictureOptions(app, options.slice, &options.layers);
  ResolveSource(app, source, options.source, options.slice.frame.transfer,
                [&options] { return RendersHere(options.source, options.connection); });
}

void AddFrameOptions(CLI::App& app, FrameOptions& options, std::initializer_list<std::string_view> except,
                     std::vector<SourceChoice>* sources) {
  app.option_defaults()->group("Options");
  const std::string help = fmt::format("{}; append :TRANSFER to choose its transfer function", kSourceHelp);
  auto texts = std::make_shared<std::vector<std::string>>();  // of several sources
  CLI::Option* source = sources == nullptr ? app.add_option("SOURCE", options.source, help)->required()
                                           : app.add_option("SOURCE", *texts, help + "; several make a picture each")->required();
  AddReadOptions(app, except);
  AddConnectionOptions(app, options.connection);
  AddRenderPictureOptions(app, options.request, options.format, &options.layers);
  if (sources == nullptr) {
    ResolveSource(app, source, options.source, options.request.transfer,
                  [&options] { return RendersHere(options.source, options.connection); });
  } else {
    app.parse_complete_callback([&app, &options, texts, sources] {
      const bool here = RendersHere(*texts, options.connection);
      for (const std::string& text : *texts) sources->push_back(Resolved(app, text, options.request.transfer, here));
    });
  }
  app.option_defaults()->group(kOutputGroup);
  app.add_flag("!--no-record", options.record,
               "Leave the record out of pictures: SOURCE, options and version, as `slabstream info PICTURE` prints them");
  app.add_option("--save-camera", options.camera_path, "Write the camera that was used to a file for --camera and --path")
      ->type_name("FILE");
  app.add_option("--stats", options.stats_path, "Write plan, bytes and stage times as JSON")->type_name("FILE");
  app.add_option("--trace", options.trace_path, "Write the timeline of each worker, for Perfetto or chrome://tracing")->type_name("FILE");
  AddParsed(app, "--otlp", options.collector, ParseCollector,
            "Send the timeline to an OpenTelemetry collector, by OTLP over HTTP without TLS; the path is /v1/traces unless given")
      ->type_name("URL");
  app.add_flag("--progress", options.progress, "Show progress on stderr");
}

}  // namespace slabstream
