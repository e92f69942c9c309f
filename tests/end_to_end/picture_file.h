// Pictures that the program wrote, read back as they are stored.
#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <vector>

namespace slabstream {

struct PictureFile {
  int width = 0, height = 0;
  std::vector<std::string> channels;  // "R", "G", "B", "A" and perhaps "Z"
  std::vector<float> samples;         // interleaved, top row first; integers scaled to [0, 1]

  float At(int x, int y, std::size_t channel) const {
    return samples[(std::size_t(y) * std::size_t(width) + std::size_t(x)) * channels.size() + channel];
  }
};

// Throws std::runtime_error if the file is no picture.
PictureFile ReadPicture(const std::string& path);

// Largest difference of a sample; infinite if the shapes differ. Equal infinities do not differ.
double LargestDifference(const PictureFile& a, const PictureFile& b);

}  // namespace slabstream
