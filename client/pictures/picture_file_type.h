// Types of pictures' files. The type of a file follows from the ending of its name, in any case.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "client/pictures/picture_encoder.h"
#include "common/base/status.h"
#include "common/view/camera.h"

namespace slabstream {

struct PictureFileTypeNames {
  PictureFileType type;
  std::string_view ending;  // ".jpg"
  std::string_view other;   // ".jpeg"; empty: there is one ending
  std::string_view media;   // "image/jpeg"
};

// The only list.
std::span<const PictureFileTypeNames> PictureFileTypes();

std::string PictureEndings();  // ".png, .jpg, ... or .svg"

std::optional<PictureFileType> PictureFileTypeOf(const std::string& path);

// InvalidArgument, naming the path and the known endings: it has none of them.
Status CheckPicturePath(const std::string& path);
// The same, and InvalidArgument if such a file holds no picture of this size.
Status CheckPictureFile(const std::string& path, ImageSize size);
Status CheckPictureSize(PictureFileType type, ImageSize size);

}  // namespace slabstream
