// Options that say what a picture shows: those of `render` and `slice`, on the command line and in requests of the gateway.
//
// `files`: where options put the names of files that they take. Null: no option names a file, because the texts come from another host.
// Then --camera, --labels and --overlay are missing, and colour maps are taken as their JSON.
#pragma once

#include "client/pictures/picture_writer.h"
#include "client/request/request_options.h"
#include "client/request/slice_request.h"
#include "common/base/status.h"
#include "common/cli/command.h"
#include "common/frame/frame_request.h"
#include "data/layers/layer_files.h"

namespace slabstream {

// Options under this heading are not shown in help texts: old spellings that still work, and options that cannot be used yet.
inline constexpr char kHidden[] = "";

// --labels and --overlay: the files of a volume's layers. `shown`: the request that shows a layer whose file is given; may be null.
void AddLayerFiles(const Command& app, LayerFiles& files, FrameRequest* shown = nullptr);

// View, clipping, look, layers, annotations and policy. The view is the default one, as far as no option says something else.
void AddRenderPictureOptions(const Command& app, FrameRequest& request, PictureFormat& format, LayerFiles* files);

// Plane, look and layers.
void AddSlicePictureOptions(const Command& app, SliceRequest& slice, LayerFiles* files);

// An option for one field of the table.
Option AddRequestOption(const Command& app, const RequestOption& option, FrameRequest& request, ColorMaps maps = ColorMaps::kFilesToo);

// For what replaces the whole view.
void ExcludeViewOptions(const Command& app, Option option);

// After the parse: isosurfaces without --transfer are all that is shown.
void LetSurfacesStandAlone(const Command& app, TransferChoice& transfer);

}  // namespace slabstream
