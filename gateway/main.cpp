// slabstream-gateway: pictures of a service over HTTP and WebSockets (docs/http.md). It ends on SIGINT or SIGTERM.
#include <fmt/format.h>
#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <string>

#include "client/service/gateway_state.h"
#include "client/service/service_choice.h"
#include "client/service/service_state.h"
#include "common/base/log.h"
#include "common/base/notify_ready.h"
#include "common/base/version.h"
#include "common/cli/add_option.h"
#include "common/cli/program.h"
#include "common/http/address.h"
#include "common/kernels/simd_target.h"
#include "common/otlp/trace_sender.h"
#include "common/threads/stop_signals.h"
#include "common/transport/context.h"
#include "common/volume/memory_budget.h"
#include "gateway/gateway.h"

namespace slabstream {
namespace {

struct Options {
  GatewayOptions gateway;
  ServiceChoice service;
  TlsFiles tls;
  std::string token_file;
};

Result<std::uint64_t> ParseUploadLimit(const std::string& option, const std::string& text) {
  return text == "0" ? Result<std::uint64_t>(0) : ParseMemoryLimit(option, text);
}

Status Serve(Options options) {
  if (Status simd = LimitSimdTargetByEnvironment(); !simd.ok()) return simd;
  const Result<ServiceAddress> service = ResolveService(options.service);
  if (!service.ok()) return service.status();
  Result<std::string> token = options.token_file.empty() ? MakeToken() : ReadToken("--token-file", options.token_file);
  if (!token.ok()) return token.status();
  options.gateway.token = *std::move(token);
  if (!options.gateway.collector) {
    Result<std::optional<HttpUrl>> collector = CollectorOfProcess();
    if (!collector.ok()) return collector.status();
    options.gateway.collector = *std::move(collector);
  }
  if (!options.tls.certificate.empty()) options.gateway.tls = options.tls;
  BlockStopSignals();
  Context context;
  const Result<std::unique_ptr<Gateway>> gateway = Gateway::Start(context, *service, options.gateway);
  if (!gateway.ok()) return gateway.status();
  const Status recorded =
      SaveGateway({.address = (*gateway)->url(false),
                   .token = options.gateway.token,
                   .pid = ::getpid(),
                   .started_unix = std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count()});
  if (!recorded.ok()) LogInfo(fmt::format("`slabstream token` needs --token-file for this gateway: {}", recorded.message()));
  // Whoever started this process reads the address from this line. A token that lasts is not in it: logs would keep it.
  (void)std::printf("ready %s\n", (*gateway)->url(options.token_file.empty()).c_str());
  const Status told = FlushOutput();
  if (told.ok()) {
    NotifyReady();
    const std::jthread idle = ReleaseWhileIdle();
    const sigset_t signals = StopSignals();
    int signal = 0;
    (void)::sigwait(&signals, &signal);
  }
  ForgetGateway(::getpid());
  return told;
}

int Run(int argc, char** argv) {
  Options options;
  const Program app("Slabstream gateway: serves pictures to browsers and scripts, over HTTP and WebSockets.", "slabstream-gateway",
                    std::string(Version()));
  AddService(app, options.service);
  AddParsed(app, "--listen", options.gateway.listen, ParseListenAddress,
            "Address of this machine to listen at; port 0 takes any free port. Addresses that are not loopback need TLS or a proxy")
      .TypeName("HOST:PORT")
      .Default("127.0.0.1:0");
  const Option certificate =
      app.AddText("--tls-cert", options.tls.certificate, "Certificate for TLS, with its chain (PEM)").TypeName("FILE");
  const Option key = app.AddText("--tls-key", options.tls.key, "Private key of the certificate (PEM)").TypeName("FILE");
  certificate.Needs(key);
  key.Needs(certificate);
  AddParsed(app, "--behind-proxy", options.gateway.proxy, ParseProxyAddress,
            "Public address of a proxy in front, with its path: https://viewer.example.org or https://example.org/render/. The proxy may "
            "take the path away or leave it")
      .TypeName("ADDRESS");
  AddParsedList(app, "--origin", options.gateway.pages, ParsePageSource,
                "Let pages of this origin show the viewer in a frame, and ask the gateway with a token: https://notebooks.example.org; or "
                "all pages of a scheme, such as vscode-webview: for notebooks of VS Code")
      .TypeName("ORIGIN")
      .Default("http://localhost:* and http://127.0.0.1:*, which always may");
  AddParsed(app, "--max-upload", options.gateway.max_upload_bytes, ParseUploadLimit,
            "Largest file that a page may send to the service as a dataset; 0: none may")
      .TypeName("SIZE")
      .Default(MemoryText(kUploadBytes));
  app.AddText("--token-file", options.token_file, "Use the token in this file: 16 to 128 letters, digits, - and _")
      .TypeName("FILE")
      .Default("a new random one at each start");
  AddParsed(
      app, "--otlp", options.gateway.collector, ParseCollector,
      "Send a trace of each picture and question to an OpenTelemetry collector, by OTLP over HTTP without TLS; the path is /v1/traces "
      "unless given")
      .TypeName("URL")
      .Default("$OTEL_EXPORTER_OTLP_ENDPOINT, or no traces");
  return RunService(app, argc, argv, "gateway", [&] { return Serve(std::move(options)); });
}

}  // namespace
}  // namespace slabstream

int main(int argc, char** argv) {
  slabstream::HandleStopSignals([](int) { std::_Exit(0); });
  return slabstream::RunMain("slabstream-gateway", [&] { return slabstream::Run(argc, argv); });
}
