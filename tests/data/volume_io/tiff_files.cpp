#include "tests/data/volume_io/tiff_files.h"

#include <tiffio.h>

#include <algorithm>
#include <bit>
#include <utility>
#include <vector>

#include "common/base/check.h"

namespace slabstream {
namespace {

// Rows begin with a byte.
class Packer {
 public:
  explicit Packer(int bits) : bits_(bits) {}

  void Add(std::uint64_t sample) {
    if (bits_ % 8 == 0) {
      for (int byte = 0; byte < bits_ / 8; ++byte) bytes_ += char(sample >> (8 * byte));
      return;
    }
    for (int bit = bits_; bit-- > 0;) {
      if (used_ == 0) bytes_ += '\0';
      bytes_.back() = char(bytes_.back() | ((sample >> bit & 1) << (7 - used_)));
      used_ = (used_ + 1) % 8;
    }
  }
  void EndRow() { used_ = 0; }
  FileBytes Take() { return std::move(bytes_); }

 private:
  const int bits_;
  FileBytes bytes_;
  int used_ = 0;  // bits of the last byte
};

std::string Number(std::uint64_t number, int bytes, bool big_endian) {
  std::string text;
  for (int i = 0; i < bytes; ++i) text += char(number >> (8 * i));
  if (big_endian) std::ranges::reverse(text);
  return text;
}

}  // namespace

void WriteTiffKind(const std::string& path, const Index3& size, const TiffKind& kind, const TiffSample& sample) {
  TIFF* tiff = TIFFOpen(path.c_str(), kind.big_endian ? "wb" : "wl");
  CHECK(tiff != nullptr) << path;
  const bool separate = kind.planar == PLANARCONFIG_SEPARATE;
  for (int z = 0; z < size.z; ++z) {
    const std::pair<ttag_t, int> fields[] = {{TIFFTAG_IMAGEWIDTH, size.x},           {TIFFTAG_IMAGELENGTH, size.y},
                                             {TIFFTAG_BITSPERSAMPLE, kind.bits},     {TIFFTAG_SAMPLESPERPIXEL, kind.components},
                                             {TIFFTAG_SAMPLEFORMAT, kind.format},    {TIFFTAG_PHOTOMETRIC, kind.photometric},
                                             {TIFFTAG_PLANARCONFIG, kind.planar},    {TIFFTAG_ORIENTATION, kind.orientation},
                                             {TIFFTAG_COMPRESSION, kind.compression}};
    for (const auto& [tag, value] : fields) TIFFSetField(tiff, tag, value);
    if (kind.predictor != 1) TIFFSetField(tiff, TIFFTAG_PREDICTOR, kind.predictor);
    if (kind.photometric == PHOTOMETRIC_PALETTE) {
      std::vector<std::uint16_t> map(std::size_t{1} << kind.bits, 40000);
      TIFFSetField(tiff, TIFFTAG_COLORMAP, map.data(), map.data(), map.data());
    }
    const int width = kind.tile > 0 ? kind.tile : size.x, height = kind.tile > 0 ? kind.tile : 2;
    if (kind.tile > 0) {
      TIFFSetField(tiff, TIFFTAG_TILEWIDTH, width);
      TIFFSetField(tiff, TIFFTAG_TILELENGTH, height);
    } else {
      TIFFSetField(tiff, TIFFTAG_ROWSPERSTRIP, height);
    }
    std::uint32_t part = 0;
    for (int plane = 0; plane < (separate ? kind.components : 1); ++plane) {
      for (int y0 = 0; y0 < size.y; y0 += height) {
        for (int x0 = 0; x0 < size.x; x0 += width, ++part) {
          Packer packer(kind.bits);
          for (int y = y0; y < (kind.tile > 0 ? y0 + height : std::min(y0 + height, size.y)); ++y) {
            for (int x = x0; x < x0 + width; ++x) {
              for (int c = 0; c < (separate ? 1 : kind.components); ++c) packer.Add(sample(x, y, z, separate ? plane : c));
            }
            packer.EndRow();
          }
          FileBytes bytes = packer.Take();
          const auto length = tmsize_t(bytes.size());
          const tmsize_t written = kind.tile > 0 ? TIFFWriteEncodedTile(tiff, part, bytes.data(), length)
                                                 : TIFFWriteEncodedStrip(tiff, part, bytes.data(), length);
          CHECK_EQ(written, length);
        }
      }
    }
    CHECK_EQ(TIFFWriteDirectory(tiff), 1);
  }
  TIFFClose(tiff);
}

FileBytes OneDirectoryTiff(const Index3& size, int bits, bool big_endian, const std::string& description, const FileBytes& samples,
                           const ImageJEntries& of_imagej) {
  const auto number = [&](std::uint64_t value, int bytes) { return Number(value, bytes, big_endian); };
  const std::uint64_t directory = 8, count = 11, text = directory + 2 + 12 * count + 4;
  // ImageJ has at least two entries, so that sizes do not lie in the directory.
  const std::uint64_t sizes = text + description.size() + 1, beside = sizes + 4 * of_imagej.sizes.size(),
                      first = beside + of_imagej.bytes.size();
  const unsigned sizes_tag = of_imagej.sizes.empty() ? 60001 : 50838, bytes_tag = of_imagej.sizes.empty() ? 60002 : 50839;
  struct Entry {
    unsigned tag, type;  // 1: bytes, 2: text, 4: a number
    std::uint64_t count, value;
  };
  const auto side = [](std::int32_t voxels) { return std::uint64_t(voxels); };
  const Entry entries[count] = {{256, 4, 1, side(size.x)},
                                {257, 4, 1, side(size.y)},
                                {258, 4, 1, std::uint64_t(bits)},
                                {259, 4, 1, 1},
                                {262, 4, 1, 1},
                                {270, 2, description.size() + 1, text},
                                {273, 4, 1, first},
                                {278, 4, 1, side(size.y)},
                                {279, 4, 1, (side(size.x) * std::uint64_t(bits) + 7) / 8 * side(size.y)},
                                {sizes_tag, 4, std::max<std::uint64_t>(of_imagej.sizes.size(), 1), sizes},
                                {bytes_tag, 1, std::max<std::uint64_t>(of_imagej.bytes.size(), 1), beside}};
  FileBytes bytes = (big_endian ? "MM" : "II") + number(42, 2) + number(directory, 4) + number(count, 2);
  for (const auto& [tag, type, length, value] : entries) bytes += number(tag, 2) + number(type, 2) + number(length, 4) + number(value, 4);
  bytes += number(0, 4) + description + '\0';
  for (const std::uint32_t entry : of_imagej.sizes) bytes += number(entry, 4);
  return bytes + of_imagej.bytes + samples;
}

ImageJEntries LooksOfImageJ(bool big_endian, const std::vector<double>& windows, const std::vector<std::array<int, 3>>& tables) {
  const auto number = [&](std::uint64_t value, int bytes) { return Number(value, bytes, big_endian); };
  ImageJEntries entries{{28}, number(0x494a494a, 4)};     // "IJIJ"
  entries.bytes += number(0x696e666f, 4) + number(1, 4);  // "info"
  entries.bytes += number(0x72616e67, 4) + number(1, 4);  // "rang"
  entries.bytes += number(0x6c757473, 4) + number(tables.size(), 4);
  entries.bytes += "about";
  entries.sizes.push_back(5);
  for (const double limit : windows) entries.bytes += number(std::bit_cast<std::uint64_t>(limit), 8);
  entries.sizes.push_back(std::uint32_t(8 * windows.size()));
  for (const std::array<int, 3>& table : tables) {
    for (const int component : table) entries.bytes += FileBytes(255, '\0') + char(component);
    entries.sizes.push_back(768);
  }
  return entries;
}

std::string OmeXml(const std::string& pixels, const std::string& inside, const std::string& uuid) {
  return "<?xml version=\"1.0\" encoding=\"UTF-8\"?><OME xmlns=\"http://www.openmicroscopy.org/Schemas/OME/2016-06\"" +
         (uuid.empty() ? "" : " UUID=\"" + uuid + "\"") +
         "><Image ID=\"Image:0\"><Pixels ID=\"Pixels:0\" Type=\"uint8\" SizeX=\"4\" SizeY=\"3\" " + pixels + ">" + inside +
         "</Pixels></Image></OME>";
}

}  // namespace slabstream
