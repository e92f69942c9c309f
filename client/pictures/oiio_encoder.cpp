#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include <algorithm>
#include <memory>

#include "client/pictures/picture_encoder.h"

namespace slabstream {
namespace {

// Takes the library's bytes, which may come in any order. After a failure it drops them: libtiff ends a picture that it could not write
// with a line of its own on stderr.
class Sink : public OIIO::Filesystem::IOProxy {
 public:
  explicit Sink(const WriteBytes& write) : IOProxy("", Write), write_(write) {}

  const char* proxytype() const override { return "slabstream"; }
  std::size_t write(const void* bytes, std::size_t size) override {
    const std::size_t written = pwrite(bytes, size, m_pos);
    m_pos += std::int64_t(written);
    return written;
  }
  std::size_t pwrite(const void* bytes, std::size_t size, std::int64_t offset) override {
    ok_ = ok_ && write_(offset, {static_cast<const std::byte*>(bytes), size});
    end_ = std::max(end_, std::size_t(offset) + size);
    return size;
  }
  std::size_t size() const override { return end_; }
  bool ok() const { return ok_; }

 private:
  const WriteBytes& write_;
  std::size_t end_ = 0;
  bool ok_ = true;
};

OIIO::ImageSpec SpecOf(const EncodedFormat& format) {
  const bool exr = format.type == PictureFileType::kExr;
  const OIIO::TypeDesc sample = exr ? OIIO::TypeDesc::FLOAT : format.bits == 16 ? OIIO::TypeDesc::UINT16 : OIIO::TypeDesc::UINT8;
  OIIO::ImageSpec spec(format.width, format.height, format.with_depth ? 5 : 4, sample);
  spec.channelnames = {"R", "G", "B", "A"};
  if (format.with_depth) spec.channelnames.push_back("Z");
  spec.alpha_channel = 3;
  spec.z_channel = format.with_depth ? 4 : -1;
  spec.attribute("compression", "zip");
  // Samples are passed in their final form. A TIFF that names its colour space would get a directory of Exif, for which the library reads
  // what it has written: we only take bytes.
  if (exr) {
    spec.attribute("oiio:ColorSpace", "Linear");
  } else {
    spec.attribute("oiio:UnassociatedAlpha", 1);
  }
  spec.attribute("DateTime", "");  // else the library puts the time there, and no two files are the same
  if (format.density) {
    const auto per_inch = float(*format.density * kMetresAnInch);
    spec.attribute("ResolutionUnit", "in");
    spec.attribute("XResolution", per_inch);
    spec.attribute("YResolution", per_inch);
  }
  if (!format.record.empty()) {
    spec.attribute("Software", format.software);
    spec.attribute(exr ? format.record_name : "ImageDescription", format.record);
  }
  return spec;
}

}  // namespace

std::optional<std::string> EncodeByOiio(const EncodedFormat& format, const PictureRows& rows, const WriteBytes& write) {
  Sink sink(write);
  OIIO::ImageSpec spec = SpecOf(format);
  OIIO::Filesystem::IOProxy* proxy = &sink;
  spec.attribute("oiio:ioproxy", OIIO::TypeDesc::PTR, &proxy);
  const bool exr = format.type == PictureFileType::kExr;
  const std::unique_ptr<OIIO::ImageOutput> out = OIIO::ImageOutput::create(exr ? "openexr" : "tiff");
  if (!out) return OIIO::geterror();
  if (!out->open(exr ? "picture.exr" : "picture.tif", spec)) return out->geterror();
  const bool written = rows(0, format.height, [&](int y, const void* row) { return out->write_scanline(y, 0, spec.format, row); });
  const bool closed = out->close();
  if (!written || !closed) return out->geterror();
  if (!sink.ok()) return kBytesNotTaken;
  return std::nullopt;
}

}  // namespace slabstream
