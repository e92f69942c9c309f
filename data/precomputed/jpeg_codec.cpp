#include "data/precomputed/jpeg_codec.h"

#include <fmt/format.h>

#include <utility>

#include "common/memory/pooled_vector.h"
#include "data/volume_io/jpeg_picture.h"

namespace slabstream::precomputed {

SharedCodec JpegCodec(std::uint64_t voxels, int of_voxel) {
  return std::make_shared<ChunkCodec>([voxels, of_voxel](const Bytes& packed, std::uint64_t most) -> Result<Bytes> {
    JpegPicture picture;
    if (!picture.Begin(nullptr, packed.span())) return Status::DataLoss("damaged: not a JPEG picture");
    const std::uint64_t pixels_there = picture.width() * picture.height();
    if (pixels_there != voxels || picture.components() != of_voxel) {
      return Status::DataLoss(fmt::format("is a JPEG picture of {} pixels of {} components, must be of {} of {}", pixels_there,
                                          picture.components(), voxels, of_voxel));
    }
    const auto channels = std::size_t(of_voxel);
    const std::uint64_t bytes = voxels * channels;
    if (bytes > most) return Status::ResourceExhausted(fmt::format("is a JPEG picture of {} bytes, at most {} are expected", bytes, most));
    UnwrittenVector<std::byte> pixels(bytes);
    if (!picture.ReadRows(reinterpret_cast<JSAMPLE*>(pixels.data()))) return Status::DataLoss("truncated or damaged: a JPEG picture");
    if (channels == 1) return Bytes(std::move(pixels));
    UnwrittenVector<std::byte> planes(bytes);
    for (std::size_t channel = 0; channel < channels; ++channel) {
      for (std::size_t i = 0; i < voxels; ++i) planes[channel * voxels + i] = pixels[i * channels + channel];
    }
    return Bytes(std::move(planes));
  });
}

}  // namespace slabstream::precomputed
