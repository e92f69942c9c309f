#include <string_view>
#include <utility>
#include <vector>

#include "client/cli/commands.h"
#include "common/cli/help_formatter.h"

namespace slabstream {
namespace {

struct CommandPage {
  std::string_view command;
  HelpPage page;
};

std::vector<CommandPage> CommandPages() {
  return {
      {"render",
       {.options = {"output", "size", "view", "azimuth", "elevation", "zoom", "renderer", "transfer", "scalar-range", "isovalue",
                    "clip-box", "background", "color-bar", "channel", "channel-color", "channel-range", "time"},
        .examples = {{"slabstream render head.nii.gz -o head.png", "A picture of a file, on all cores of this machine"},
                     {"slabstream render head.nii.gz -o left.png --view left --size 1200x900", "The same head from its left side"},
                     {"slabstream render ct.nrrd:ct-bone -o bones.png --renderer raycast --background white", "The bones of a CT"},
                     {"slabstream render t1.nii.gz -o atlas.png --labels atlas.nii.gz --legend", "A brain with the structures of an atlas"},
                     {"slabstream render brain -o brain.png", "A dataset of the service that `slabstream up` started"}}}},
      {"turntable",
       {.options = {"output", "frames", "turns", "fps", "time", "size", "view", "elevation", "zoom", "renderer", "transfer", "scalar-range",
                    "clip-box", "background", "color-bar", "channel"},
        .examples = {{"slabstream turntable head.nii.gz -o head.mp4 --frames 100", "A movie of a turn, which the program ffmpeg encodes"},
                     {"slabstream turntable head.nii.gz -o 'head_%02d.png' --frames 36", "The same turn as numbered pictures"},
                     {"slabstream turntable heart.nii.gz -o beat.mp4 --time 0:19 --turns 0", "The first 20 times of a file, from one side"},
                     {"slabstream turntable ct.nrrd:ct-bone -o bones.webm --frames 100 --size 1280x720", "The bones of a CT, in HD"},
                     {"slabstream turntable brain -o brain.gif --frames 50", "A dataset of the service that `slabstream up` started"}}}},
      {"slice",
       {.options = {"output", "plane", "at", "index", "thickness", "size", "window", "level", "transfer", "scalar-range", "background",
                    "color-bar", "orientation-marker", "channel", "channel-color", "channel-range", "time"},
        .examples = {{"slabstream slice head.nii.gz -o planes.png --plane anatomical", "An axial, a coronal and a sagittal plane"},
                     {"slabstream slice ct.nrrd -o lung.png --plane coronal --window lung", "A CT in the window of lungs"},
                     {"slabstream slice head.nii.gz -o z40.png --plane z --index 40", "Slice 40 along z"},
                     {"slabstream slice ct.nrrd -o mip.png --plane axial --thickness 20", "The largest values of 20 mm"},
                     {"slabstream slice t1.nii.gz -o map.png --overlay zstat.nii.gz --color-bar", "A statistical map over a brain"}}}},
      {"info",
       {.options = {"json", "transfer", "labels", "overlay", "time", "channel", "series", "array", "dataset"},
        .examples = {{"slabstream info head.nii.gz", "Size, spacing, orientation, times, channels and values"},
                     {"slabstream info study/ --series 2", "The second series of a folder of DICOM files"},
                     {"slabstream info brain.png", "How Slabstream made this picture"}}}},
      {"value",
       {.options = {"at", "labels", "overlay", "json", "time", "channel", "endpoint", "service"},
        .examples = {{"slabstream value head.nii.gz --at 10,-22,35", "Voxel and value at a point of the world"},
                     {"slabstream value t1.nii.gz --labels atlas.nii.gz --at 10,-22,35 --json", "The structure there, too, as JSON"}}}},
      {"convert",
       {.options = {"type", "level", "box", "memory", "zarr-version", "progress", "time", "channel", "series", "array", "dataset"},
        .examples = {{"slabstream convert study/ head.nii.gz", "A folder of DICOM files as one NIfTI file"},
                     {"slabstream convert brain.tif brain.ome.zarr --memory 2G --progress",
                      "A large volume with levels, for fast pictures"},
                     {"slabstream convert head.nrrd part.nrrd --box 10:60,:,:", "A part of a volume"}}}},
      {"isosurface",
       {.options = {"output", "isovalue", "label", "level", "caps", "progress", "time", "channel", "series", "array", "dataset"},
        .examples = {{"slabstream isosurface ct.nrrd --isovalue 300 -o bone.ply", "The surface of bones, for a mesh viewer"},
                     {"slabstream isosurface seg.nrrd --label 3 -o organ.stl --caps", "A closed solid of a segment, to be printed"},
                     {"slabstream isosurface large.ome.zarr --isovalue 90 --level 2 -o coarse.ply", "From a coarse level"}}}},
      {"transfer",
       {.options = {"list", "preview", "scalar-range"},
        .examples = {{"slabstream transfer --list", "The names of all presets"},
                     {"slabstream transfer ct-bone ct.nrrd > bone.json", "A preset as a file to change, for --transfer bone.json"}}}},
      {"up",
       {.examples = {{"slabstream up --data head=head.nii.gz", "A service of one volume, until Ctrl-C"},
                     {"slabstream up --detach --data scans/", "A service of all volumes in a folder, in the background"},
                     {"slabstream up --listen tcp://192.168.1.7:7420 --data scans/", "A service for other hosts, with keys"}}}},
      {"view",
       {.options = {"no-browser", "listen", "labels", "overlay", "endpoint", "service", "cache", "time", "channel", "series", "array",
                    "dataset"},
        .examples = {{"slabstream view head.nii.gz", "A file in the browser, by a service of its own"},
                     {"slabstream view t1.nii.gz --labels atlas.nii.gz", "A brain with the structures of an atlas"},
                     {"slabstream view head --service client.json", "A dataset of another host's service"}}}},
      {"token",
       {.examples = {{"slabstream token --for 1h --dataset head --view-only", "A link to one dataset, for an hour, that changes nothing"},
                     {"slabstream token --for 720h --token-file ~/.slabstream-token", "A token of a gateway that another process runs"}}}},
      {"data",
       {.examples = {{"slabstream data list", "The datasets of the service"},
                     {"slabstream data add foot=/scans/foot.nrrd", "One more dataset, until the service ends"}}}},
      {"steer",
       {.examples = {{"slabstream steer rho", "How far the simulation is, and its parameters"},
                     {"slabstream steer rho feed=0.03 kill=0.06", "Other values, from its next step on"}}}},
  };
}

HelpPage ProgramPage() {
  return {.examples = {{"slabstream view head.nii.gz", "Turn a volume in the browser"},
                       {"slabstream render head.nii.gz -o head.png", "A picture of it"},
                       {"slabstream turntable head.nii.gz -o head.mp4 --frames 100", "A movie of it"},
                       {"slabstream up --detach --data scans/", "A service of all volumes in a folder"},
                       {"slabstream render --help", "The options of a command"}}};
}

}  // namespace

void DeclareHelpPages(const CommandLine& line) {
  SetHelpPage(line.app, ProgramPage());
  for (CommandPage& each : CommandPages()) SetHelpPage(line.app.FindCommand(each.command), std::move(each.page));
}

}  // namespace slabstream
