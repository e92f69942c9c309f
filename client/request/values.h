// Parses texts of the command line into values of pictures and frames. Pure. Errors as in common/cli/parse.h.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "client/pictures/picture_writer.h"
#include "common/base/status.h"
#include "common/frame/frame_request.h"
#include "common/math/vec.h"
#include "common/view/camera.h"
#include "common/view/clip.h"
#include "common/wire/client_structs.h"

namespace slabstream {

// "640x480" or "512" (a square), each side in [1, kMaxImageSide], at most kMaxImagePixels in all.
Result<ImageSize> ParseImageSize(std::string_view option, std::string_view text);

// "X,Y,Z", each in [-kMaxCoordinate, kMaxCoordinate].
Result<Vec3> ParsePoint(std::string_view option, std::string_view text);
// The same, and not all zero.
Result<Vec3> ParseDirection(std::string_view option, std::string_view text);

// "LOW:HIGH", which rise, in [-kMaxScalar, kMaxScalar]; or "LOW%:HIGH%", percentiles.
Result<ScalarRange> ParseScalarRange(std::string_view option, std::string_view text);

// "X0:X1,Y0:Y1,Z0:Z1"; with "v" behind any bound all are in voxels, with "%" in percent of the volume's sides. A bound may be left out: it
// does not clip.
Result<ClipBox> ParseClipBox(std::string_view option, std::string_view text);
// "NX,NY,NZ,D".
Result<ClipPlane> ParseClipPlane(std::string_view option, std::string_view text);

// "R,G,B" (opaque) or "R,G,B,A", each in [0, 1]; "#rgb", "#rrggbb" or "#rrggbbaa"; or one of the names of CSS, such as "white" or
// "steelblue" (named_colors.h). Codes and names become codes of an 8-bit PNG as they are, without a transfer curve.
Result<StraightColor> ParseColor(std::string_view option, std::string_view text);

// "V[:COLOUR[:OPACITY]],...", such as "120:red:0.3,300": 1 to kMaxIsosurfaces different values in any order, here returned in ascending
// order. COLOUR is as for ParseColor, but R,G,B has three numbers; OPACITY in [0, 1] is that of the colour if it is left out. Surfaces
// without a colour have one of their own.
Result<std::vector<Isosurface>> ParseIsosurfaces(std::string_view option, std::string_view text);

// The same, and opaque.
Result<Rgb> ParseOpaqueColor(std::string_view option, std::string_view text);

// "G:O,G:O,...", with slopes G that ascend in [0, kMaxScalar] and opacities O in [0, 1].
Result<std::vector<GradientOpacityPoint>> ParseGradientOpacities(std::string_view option, std::string_view text);

// "3=0.5,7=0": labels and their opacities in [0, 1].
Result<std::vector<LabelOpacity>> ParseLabelOpacities(std::string_view option, std::string_view text);
// "1,5-9,Precentral_L,Temporal_*": what is neither a number nor a range is a name.
Result<std::vector<LabelRange>> ParseLabelRanges(std::string_view option, std::string_view text);

// "NAME[,color=COLOUR][,opacity=O][,width=W|Wpx][,map=MAP][,range=LOW:HIGH][,time=N]". In NAME a backslash stands before a comma or
// another backslash.
Result<ShapeChoice> ParseShape(std::string_view option, std::string_view text);

// "PLANE[:WHERE][,opacity=O][,map=MAP][,range=LOW:HIGH]". PLANE is a name of kSlicePlanes, or a normal "X/Y/Z" of the world. WHERE is
// "x=N", "y=N" or "z=N" where the normal lies along that axis, "index=N" (ClipSlab::index), or a point "at=X/Y/Z".
Result<PlaneChoice> ParsePlane(std::string_view option, std::string_view text);

// Takes the name at the beginning of a text, up to one of `ends`. In it a backslash stands before one of them, or another backslash.
std::string TakeName(std::string_view& text, std::string_view ends);
// InvalidArgument: the name is empty or too long. `text`: that it is from.
Status CheckName(std::string_view option, std::string_view text, const std::string& name);
// Names that are separated by commas. In names a backslash stands before a comma, a '=' or another backslash.
Result<std::vector<std::string>> ParseNames(std::string_view option, std::string_view text);
// "NAME=VALUE,NAME=VALUE,...", none named twice. What has no '=' belongs to the value before it, as in "0=1,0.5,0,Actin=red"; a value in
// JSON ends where its brackets close.
struct NamedText {
  std::string name, text;
};
Result<std::vector<NamedText>> ParseNamedTexts(std::string_view option, std::string_view text);

// The same, of numbers.
Result<std::vector<SteeredValue>> ParseSteeredValues(std::string_view option, std::string_view text);

// The other way round: the text that is parsed as the value.
std::string TextOf(const ImageSize& size);
std::string TextOf(const Vec3& point);
std::string TextOf(const ScalarRange& range);
std::string TextOf(const Rgb& color);
std::string TextOfName(const std::string& name);
std::string TextOf(const std::vector<std::string>& names);
std::string TextOf(const ClipBox& box);
std::string TextOf(const ClipPlane& plane);
std::string TextOf(const ShapeChoice& shape);
std::string TextOf(const PlaneChoice& plane);
std::string TextOf(const std::vector<Isosurface>& surfaces);
std::string TextOf(const std::vector<GradientOpacityPoint>& points);
std::string TextOf(const std::vector<LabelOpacity>& opacities);
std::string TextOf(const std::vector<LabelRange>& ranges);

}  // namespace slabstream
