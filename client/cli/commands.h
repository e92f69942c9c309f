// The commands of `slabstream`; client_commands.cpp declares the options of the client's. A command prints its results on stdout. The
// caller reports the returned status in one line on stderr and derives the exit status from it (command_line.h).
#pragma once

#include <span>

#include "client/cli/command_line.h"
#include "client/cli/options.h"
#include "common/base/status.h"

namespace slabstream {

std::span<const DeclareCommand> ClientCommands();
// What `--help` of each command shows: the options that most users want, where a command has many, and examples, which manual pages show,
// too. The program and its commands are declared already.
void DeclareHelpPages(const CommandLine& line);

Status RunRender(const RenderOptions& options);
Status RunTurntable(const TurntableOptions& options);
Status RunSlice(const SliceOptions& options);
Status RunInfo(const InfoOptions& options);
Status RunShapeInfo(const InfoOptions& options);    // `info`, if the path is that of a mesh, lines or points (HoldsShape)
Status RunMeshInfo(const InfoOptions& options);     // `info`, if the path ends as an unstructured grid's does (LooksLikeMesh)
Status RunPictureInfo(const InfoOptions& options);  // `info`, if the path ends as a picture's does (IsPicturePath)
Status RunValue(const ValueOptions& options);
Status RunMeasure(const MeasureOptions& options);
Status RunTransfer(const TransferOptions& options);
Status RunConvert(const ConvertOptions& options);
Status RunIndex(const IndexingOptions& options);
Status RunIsosurface(const IsosurfaceCommandOptions& options);
Status RunSphere(const SphereOptions& options);
Status RunClusters(const ClustersOptions& options);
Status RunUp(const UpOptions& options);
Status RunView(const ViewOptions& options);
Status RunDown(const DownOptions& options);
Status RunStatus(const StatusOptions& options);
Status RunKeys(const KeysOptions& options);
Status RunData(const DataOptions& options);
Status RunSteer(const SteerOptions& options);
Status RunLogs(const LogsOptions& options);
Status RunSlurm(const SlurmOptions& options);
// Prints the token, and if the gateway runs here a link with it. InvalidArgument: the gateway's own token is too short to sign others, or
// there are too many datasets. Unavailable: no gateway of this user runs here, and no token file is named.
Status RunToken(const TokenOptions& options);

inline constexpr const char* kAnnotateCommand = "annotate";  // for the Python package; not shown in help texts
Status RunAnnotate();

}  // namespace slabstream
