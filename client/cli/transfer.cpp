// `transfer`: a preset as a file, to be changed and given to --transfer.
#include <iostream>

#include "client/cli/commands.h"
#include "client/cli/input_volume.h"
#include "common/mesh/lattice.h"
#include "common/planning/resolved_request.h"

namespace slabstream {

Status RunTransfer(const TransferOptions& options) {
  if (Status status = CheckInputVolume(options.path); !status.ok()) return status;
  const Result<LoadedVolume> loaded = ReadInputVolume(options.path);
  if (!loaded.ok()) return loaded.status();
  const Result<TransferFunction> transfer = ResolveTransfer(options.request.transfer, SummaryOf(*loaded->volume));
  if (!transfer.ok()) return transfer.status();
  std::cout << FormatParaViewColorMap(*transfer, std::get<std::string>(options.request.transfer.choice));
  return Status::Ok();
}

}  // namespace slabstream
