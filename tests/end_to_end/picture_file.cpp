#include "tests/end_to_end/picture_file.h"

#include <OpenImageIO/imageio.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace slabstream {

PictureFile ReadPicture(const std::string& path) {
  OIIO::ImageSpec as_stored;
  as_stored.attribute("oiio:UnassociatedAlpha", 1);  // or straight alpha would be multiplied in
  const auto in = OIIO::ImageInput::open(path, &as_stored);
  if (!in) throw std::runtime_error(path + ": " + OIIO::geterror());
  const OIIO::ImageSpec& spec = in->spec();
  PictureFile picture{spec.width, spec.height, {spec.channelnames.begin(), spec.channelnames.end()}, {}};
  picture.samples.resize(spec.image_pixels() * picture.channels.size());
  if (!in->read_image(0, 0, 0, spec.nchannels, OIIO::TypeDesc::FLOAT, picture.samples.data())) {
    throw std::runtime_error(path + ": " + in->geterror());
  }
  return picture;
}

double LargestDifference(const PictureFile& a, const PictureFile& b) {
  if (a.width != b.width || a.height != b.height || a.channels != b.channels) return std::numeric_limits<double>::infinity();
  double largest = 0;
  for (std::size_t i = 0; i < a.samples.size(); ++i) {
    if (a.samples[i] != b.samples[i]) largest = std::max(largest, std::abs(double(a.samples[i]) - double(b.samples[i])));
  }
  return largest;
}

}  // namespace slabstream
