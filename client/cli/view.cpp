// `view`: a volume in the browser. Starts what is missing, a service for a file and the gateway, and ends what it started.
#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <memory>
#include <optional>
#include <utility>

#include "client/cli/commands.h"
#include "client/cli/cores.h"
#include "client/cli/input_volume.h"
#include "client/cli/service_connection.h"
#include "client/service/process.h"
#include "client/service/service_state.h"
#include "common/base/did_you_mean.h"
#include "common/cli/program.h"
#include "common/files/files.h"
#include "common/files/program_beside.h"
#include "common/frame/dataset_name.h"
#include "common/http/address.h"
#include "common/text/url.h"
#include "common/threads/stop_signals.h"
#include "common/transport/this_machine.h"
#include "data/catalogue/catalogue.h"
#include "data/layers/layer_files.h"
#include "data/open/cache_option.h"
#include "data/open/source_name.h"
#include "data/volume_io/read_options.h"

namespace slabstream {
namespace {

using std::chrono::seconds;

constexpr const char* kGatewayProgram = "slabstream-gateway";
constexpr Duration kHelperStartTimeout = seconds(60);
constexpr Duration kHelperPatience = seconds(15);  // for a service to end its processes

bool IsVolumeFile(const std::string& source) {
  const Result<SourceText> parsed = ParseSourceText(source);
  return parsed.ok() && MayBeThere(*parsed);
}

// The file of a source, or of a layer with what follows its name, with an absolute path.
std::string AbsoluteSource(const std::string& source) {
  if (!SchemeOf(source).empty()) return source;
  const std::size_t options = source.find('?');
  const std::string path = std::filesystem::absolute(source.substr(0, options)).string();
  return options == std::string::npos ? path : path + source.substr(options);
}

// NAME=PATH as --data takes it, with absolute paths.
std::string CatalogueEntry(const std::string& source, LayerFiles layers) {
  std::string entry = fmt::format("{}={}", NameOfSource(source), AbsoluteSource(source));
  if (!layers.labels.empty()) {
    layers.labels = AbsoluteSource(layers.labels);
    if (!layers.label_colors.empty()) layers.label_colors = AbsoluteSource(layers.label_colors);
    entry += ",labels=" + LabelText(layers);
  }
  if (!layers.overlay.empty()) entry += ",overlay=" + AbsoluteSource(layers.overlay);
  return entry;
}

// What the viewer shows first: of several times of a file the first one.
std::string ShownDataset(const std::string& source) {
  const std::string name = NameOfSource(source);
  const Result<SourceText> parsed = ParseSourceText(source);
  const bool several = parsed.ok() && parsed->options.time && parsed->options.time->count() > 1;
  return several ? NameAtTime(name, parsed->options.time->first) : name;
}

// A child that ends with this process or with this object.
class Helper {
 public:
  static Result<Helper> Start(std::vector<std::string> command) {
    Result<Child> child = Child::Start({.command = std::move(command), .log_path = "/dev/stderr"});
    if (!child.ok()) return child.status();
    return Helper(*std::move(child));
  }
  Helper(Helper&&) = default;
  Helper& operator=(Helper&&) = delete;
  ~Helper() {
    if (child_ != nullptr) child_->Terminate(kHelperPatience);
  }
  Child& child() { return *child_; }

 private:
  explicit Helper(Child child) : child_(std::make_unique<Child>(std::move(child))) {}
  std::unique_ptr<Child> child_;
};

// This program, to be started again.
Result<std::string> OwnPath() {
  std::error_code error;
  const std::filesystem::path path = std::filesystem::read_symlink("/proc/self/exe", error);
  if (error) return Status::Unavailable("cannot find this program: " + error.message());
  return path.string();
}

// The endpoint in "slabstream is up at ENDPOINT (...)".
Result<std::string> EndpointOfUp(Helper& up) {
  const Result<std::string> line = up.child().ReadLine(kHelperStartTimeout);
  if (!line.ok()) return Status(line.status().code(), fmt::format("the service did not start: {}", line.status().message()));
  constexpr std::string_view kBefore = " up at ";
  const std::size_t begin = line->find(kBefore);
  if (begin == std::string::npos) return Status::Internal(fmt::format("`slabstream up` said '{}' instead of its endpoint", *line));
  const std::size_t from = begin + kBefore.size();
  return line->substr(from, line->find(' ', from) - from);
}

bool IsSet(const char* variable) {
  const char* value = std::getenv(variable);
  return value != nullptr && *value != 0;
}

Status OpenBrowser(const std::string& url) {
  if (!IsSet("DISPLAY") && !IsSet("WAYLAND_DISPLAY")) return Status::Unavailable("there is no display here");
  const std::string opener = ProgramInPath("xdg-open");
  if (opener.empty()) return Status::NotFound("there is no xdg-open in $PATH (Debian package xdg-utils)");
  return Child::Start({.command = {opener, url}, .log_path = "/dev/null", .outlives_us = true}).status();
}

// Until Ctrl-C (Ok), or one of the children ends.
Status WatchHelpers(Helper& gateway, std::optional<Helper>& service) {
  while (true) {
    if (StopComesWithin(std::chrono::milliseconds(200))) return Status::Ok();
    if (const auto end = gateway.child().Ended()) return Status::Unavailable("the gateway " + end->description);
    if (!service) continue;
    if (const auto end = service->child().Ended()) return Status::Unavailable("the service " + end->description);
  }
}

// What `up` would refuse, before it is started.
Status CheckEntry(const std::string& source, const std::string& entry) {
  if (Status status = CheckInputVolume(source); !status.ok()) return status;
  FoundData found = FindData({entry}, "SOURCE ");
  CheckFiles(found);
  return found.errors.empty() ? Status::Ok() : found.errors.front();
}

// The token in the file, which is made if it does not exist.
Result<std::string> KeptToken(const std::string& path) {
  std::error_code error;
  if (!std::filesystem::exists(path, error)) {
    const Result<std::string> token = MakeToken();
    if (!token.ok()) return token;
    if (Status written = WritePrivateTextFile(path, *token + "\n"); !written.ok()) return written;
  }
  return ReadToken("--token-file", path);
}

// The dataset that the service has for the file. With keys it takes an admin's.
Status AddToService(const ServiceChoice& choice, const std::string& entry) {
  Result<ServiceConnection> connection = ServiceConnection::OpenService(choice);
  if (!connection.ok()) return connection.status();
  return connection->client().OrderData({.action = DataAction::kAdd, .items = {entry}}).status();
}

// NotFound: the service has no dataset of this name; Unavailable: there is no service.
Status FindDataset(const ServiceChoice& choice, const std::string& source) {
  if (Status status = CheckDataset(choice, source); !status.ok()) return status;
  Result<ServiceConnection> connection = ServiceConnection::OpenService(choice);
  if (!connection.ok()) {
    return Status(connection.status().code(), fmt::format("SOURCE '{}' is no file, and {}", source, connection.status().message()));
  }
  const Result<StatusReply> status = connection->client().QueryStatus();
  if (!status.ok()) return status.status();
  if (std::ranges::find(status->datasets, source, &DatasetStatus::name) != status->datasets.end()) return Status::Ok();
  return Status::NotFound(
      fmt::format("SOURCE '{}' is neither a file nor a dataset of the service{}", source, DidYouMean(source, status->datasets)));
}

}  // namespace

Status RunView(const ViewOptions& options) {
  const bool file = IsVolumeFile(options.source);
  if (!file && options.layers.any()) {
    return Status::InvalidArgument(fmt::format("SOURCE '{}' is no file, and --labels and --overlay are layers of a file", options.source));
  }
  const Result<ServiceChoice> named = NamedService(options.service);
  if (!named.ok()) return named.status();
  const Result<std::string> self = OwnPath(), program = ProgramBeside(kGatewayProgram);
  if (!self.ok()) return self.status();
  if (!program.ok()) return program.status();
  const Result<std::string> token = options.token_file.empty() ? Result<std::string>("") : KeptToken(options.token_file);
  if (!token.ok()) return token.status();
  BlockStopSignals();
  std::optional<Helper> service;
  ServiceChoice choice = *named;
  if (file && choice.text().empty()) {
    const std::string entry = CatalogueEntry(options.source, options.layers);
    if (Status status = CheckEntry(options.source, entry); !status.ok()) return status;
    std::vector<std::string> command = {
        *self,    "up", "--unlisted", "--listen", fmt::format("tcp://{}:*", OwnHost()), "--workers", std::to_string(WorkersForOneUser()),
        "--data", entry};
    AddCacheArgument(command, options.cache);
    Result<Helper> up = Helper::Start(std::move(command));
    if (!up.ok()) return up.status();
    service.emplace(*std::move(up));
    Result<std::string> endpoint = EndpointOfUp(*service);
    if (!endpoint.ok()) return endpoint.status();
    choice.endpoint = *std::move(endpoint);
  } else if (file) {
    if (Status status = AddToService(choice, CatalogueEntry(options.source, options.layers)); !status.ok()) return status;
  } else if (Status status = FindDataset(choice, options.source); !status.ok()) {
    return status;
  }
  std::vector<std::string> command = {*program, "--listen", options.listen};
  if (!choice.endpoint.empty()) command.insert(command.end(), {"--endpoint", choice.endpoint});
  if (!choice.file.empty()) command.insert(command.end(), {"--service", choice.file});
  if (!options.token_file.empty()) command.insert(command.end(), {"--token-file", options.token_file});
  Result<Helper> gateway = Helper::Start(std::move(command));
  if (!gateway.ok()) return gateway.status();
  const Result<std::string> line = gateway->child().ReadLine(kHelperStartTimeout);
  if (!line.ok()) return Status(line.status().code(), fmt::format("the gateway did not start: {}", line.status().message()));
  const std::string dataset = file ? ShownDataset(options.source) : options.source;
  const std::string address = line->substr(line->find(' ') + 1), with_token = token->empty() ? address : address + "#token=" + *token;
  const std::string url = fmt::format("{}&dataset={}{}{}", with_token, dataset, options.layers.labels.empty() ? "" : "&label-mode=tint",
                                      options.layers.overlay.empty() ? "" : "&overlay=1");
  std::cout << fmt::format("{} is at {}\n", dataset, url);
  if (options.browser) {
    const Status opened = OpenBrowser(url);
    if (!opened.ok()) std::cout << fmt::format("No browser was opened, because {}: open this address in one.\n", opened.message());
  }
  std::cout << "Ctrl-C ends it.\n";
  if (Status told = FlushOutput(); !told.ok()) return told;
  return WatchHelpers(*gateway, service);
}

}  // namespace slabstream
