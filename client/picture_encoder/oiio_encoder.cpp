#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include <memory>

#include "client/picture_encoder/picture_encoder.h"

namespace slabstream {
namespace {

// Takes the library's bytes, which may come in any order. After a failure it drops them: libpng ends a picture that it could not write with
// a line of its own on stderr.
class Sink : public OIIO::Filesystem::IOProxy {
 public:
  explicit Sink(const PictureEncoder::WriteBytes& write) : IOProxy("", Write), write_(write) {}

  const char* proxytype() const override { return "slabstream"; }
  std::size_t write(const void* bytes, std::size_t size) override {
    const std::size_t written = pwrite(bytes, size, m_pos);
    m_pos += std::int64_t(written);
    return written;
  }
  std::size_t pwrite(const void* bytes, std::size_t size, std::int64_t offset) override {
    ok_ = ok_ && write_(offset, {static_cast<const std::byte*>(bytes), size});
    return size;
  }
  bool ok() const { return ok_; }

 private:
  const PictureEncoder::WriteBytes& write_;
  bool ok_ = true;
};

OIIO::ImageSpec SpecOf(const EncodedFormat& format) {
  const OIIO::TypeDesc sample = !format.png ? OIIO::TypeDesc::FLOAT : format.bits == 16 ? OIIO::TypeDesc::UINT16 : OIIO::TypeDesc::UINT8;
  OIIO::ImageSpec spec(format.width, format.height, format.with_depth ? 5 : 4, sample);
  spec.channelnames = {"R", "G", "B", "A"};
  if (format.with_depth) spec.channelnames.push_back("Z");
  spec.alpha_channel = 3;
  spec.z_channel = format.with_depth ? 4 : -1;
  if (format.png) {
    // Samples are passed in their final form: no division by alpha and no transfer curve on the way.
    spec.attribute("oiio:UnassociatedAlpha", 1);
    spec.attribute("oiio:ColorSpace", "sRGB");
    spec.attribute("png:compressionLevel", 1);  // the default, 6, takes 1.7 times as long to render 60 pictures of a head, 8 % smaller
  } else {
    spec.attribute("oiio:ColorSpace", "Linear");
    spec.attribute("compression", "zip");
    spec.attribute("DateTime", "");  // else the library puts the time there, and no two files are the same
  }
  if (format.density) {
    spec.attribute("ResolutionUnit", format.png ? "m" : "in");
    spec.attribute("XResolution", float(*format.density));
    spec.attribute("YResolution", float(*format.density));
  }
  if (!format.record.empty()) {
    spec.attribute("Software", format.software);
    spec.attribute(format.record_name, format.record);
  }
  return spec;
}

class OiioEncoder final : public PictureEncoder {
 public:
  std::optional<std::string> Encode(const EncodedFormat& format, const std::function<bool(const WriteRow&)>& rows,
                                    const WriteBytes& write) const override {
    Sink sink(write);
    OIIO::ImageSpec spec = SpecOf(format);
    OIIO::Filesystem::IOProxy* proxy = &sink;
    spec.attribute("oiio:ioproxy", OIIO::TypeDesc::PTR, &proxy);
    const std::unique_ptr<OIIO::ImageOutput> out = OIIO::ImageOutput::create(format.png ? "png" : "openexr");
    if (!out) return OIIO::geterror();
    if (!out->open(format.png ? "picture.png" : "picture.exr", spec)) return out->geterror();
    const bool written = rows([&](int y, const void* row) { return out->write_scanline(y, 0, spec.format, row); });
    const bool closed = out->close();
    if (!written || !closed) return out->geterror();
    if (!sink.ok()) return "the bytes were not taken";
    return std::nullopt;
  }
};

}  // namespace

// The entry of the module, by its name alone (kPictureEncoderEntry).
extern "C" __attribute__((visibility("default"))) const PictureEncoder* SlabstreamPictureEncoder() {
  static const OiioEncoder encoder;
  return &encoder;
}

}  // namespace slabstream
