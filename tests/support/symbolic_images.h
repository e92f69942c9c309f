// SymbolicImages: what an executor's images would hold, with symbols for pixels: each pixel is the list of box numbers that were combined
// into it, nearest first. So a test sees what was combined, in which order, and how often. Wrong use of a handle fails the running test.
#pragma once

#include <gtest/gtest.h>

#include <cstring>
#include <map>
#include <set>
#include <utility>
#include <vector>

#include "worker/machine/worker_machine.h"

namespace slabstream {

using SymbolicPixel = std::vector<BoxId>;                      // nearest first
using SymbolicImage = std::map<std::uint64_t, SymbolicPixel>;  // by linear index; pixels that are not there are empty

inline Bytes PackSymbols(const SymbolicImage& image) {
  std::vector<std::uint32_t> words;
  for (const auto& [index, pixel] : image) {
    words.push_back(std::uint32_t(index));
    words.push_back(std::uint32_t(pixel.size()));
    words.insert(words.end(), pixel.begin(), pixel.end());
  }
  std::vector<std::byte> bytes(words.size() * sizeof(std::uint32_t));
  if (!words.empty()) std::memcpy(bytes.data(), words.data(), bytes.size());
  return Bytes(std::move(bytes));
}

inline SymbolicImage UnpackSymbols(const Bytes& payload) {
  std::vector<std::uint32_t> words(payload.size() / sizeof(std::uint32_t));
  if (!words.empty()) std::memcpy(words.data(), payload.span().data(), payload.size());
  SymbolicImage image;
  for (std::size_t i = 0; i < words.size();) {
    const std::uint32_t index = words[i], count = words[i + 1];
    image[index] = SymbolicPixel(words.begin() + std::ptrdiff_t(i + 2), words.begin() + std::ptrdiff_t(i + 2 + count));
    i += 2 + count;
  }
  return image;
}

class SymbolicImages {
 public:
  // StartRender, done: all `pixel_count` pixels show the box, but for those that `hidden(i)` says are left out.
  template <class Hidden>
  void Render(ImageHandle image, BoxId box, std::uint64_t pixel_count, Hidden&& hidden) {
    EXPECT_TRUE(NameIsNew(image)) << "image " << image << " is named twice";
    SymbolicImage& pixels = images_[image];
    for (std::uint64_t i = 0; i < pixel_count; ++i) {
      if (!hidden(i)) pixels.emplace_hint(pixels.end(), i, SymbolicPixel{box});
    }
  }
  void Render(ImageHandle image, BoxId box, std::uint64_t pixel_count) {
    Render(image, box, pixel_count, [](std::uint64_t) { return false; });
  }
  // StartRender, failed or cancelled: the name is used up all the same.
  void FailRender(ImageHandle image) {
    EXPECT_TRUE(NameIsNew(image)) << "image " << image << " is named twice";
    images_[image];
  }

  void Combine(const StartCombine& combine) {
    SymbolicImage source = combine.other == 0 ? UnpackSymbols(combine.incoming ? combine.incoming->payload : Bytes()) : Get(combine.other);
    if (combine.pixels.begin < combine.pixels.end) source = Within(source, combine.pixels);
    EXPECT_EQ(released_.count(combine.image), 0U) << "image " << combine.image << " is combined into after its release";
    SymbolicImage& image = images_[combine.image];
    if (combine.replace) image.erase(image.lower_bound(combine.pixels.begin), image.lower_bound(combine.pixels.end));
    for (const auto& [index, pixel] : source) {
      SymbolicPixel& here = image[index];
      here.insert(combine.side == Side::kFront ? here.begin() : here.end(), pixel.begin(), pixel.end());
    }
  }

  Bytes Encode(ImageHandle image, const PixelRange& pixels) const { return PackSymbols(Within(Get(image), pixels)); }

  const SymbolicImage& Get(ImageHandle image) const {
    const auto found = images_.find(image);
    EXPECT_TRUE(found != images_.end()) << "image " << image << " is read but does not exist";
    static const SymbolicImage nothing;
    return found == images_.end() ? nothing : found->second;
  }

  void Release(ImageHandle image) {
    EXPECT_EQ(images_.erase(image), 1U) << "image " << image << " is released but does not exist";
    released_.insert(image);
  }

  std::size_t size() const { return images_.size(); }

 private:
  static SymbolicImage Within(const SymbolicImage& image, const PixelRange& pixels) {
    return SymbolicImage(image.lower_bound(pixels.begin), image.lower_bound(pixels.end));
  }
  bool Exists(ImageHandle image) const { return images_.count(image) > 0; }
  bool NameIsNew(ImageHandle image) const { return !Exists(image) && released_.count(image) == 0; }

  std::map<ImageHandle, SymbolicImage> images_;
  std::set<ImageHandle> released_;
};

}  // namespace slabstream
