// JpegPicture: a JPEG picture that libjpeg decodes, in a file or in memory.
#pragma once

#include <cstdio>
// jpeglib.h needs the types of stdio.h before it.
#include <jpeglib.h>

#include <array>
#include <csetjmp>
#include <cstddef>
#include <span>

namespace slabstream {

// libjpeg leaves by longjmp, so no function that calls it behind setjmp has objects with destructors.
class JpegPicture {
 public:
  JpegPicture() {
    jpeg_.err = jpeg_std_error(&errors_);
    jpeg_.client_data = this;
    errors_.error_exit = OnError;
    errors_.output_message = [](j_common_ptr) {};
  }
  ~JpegPicture() { jpeg_destroy_decompress(&jpeg_); }
  JpegPicture(const JpegPicture&) = delete;
  JpegPicture& operator=(const JpegPicture&) = delete;

  // First: whether it is a JPEG picture. `file`, or else `bytes`, has it, and must outlive this.
  bool Begin(std::FILE* file, std::span<const std::byte> bytes = {}) {
    if (setjmp(jump_) != 0) return false;
    jpeg_create_decompress(&jpeg_);
    jpeg_.progress = &progress_;
    if (file != nullptr) {
      jpeg_stdio_src(&jpeg_, file);
    } else {
      jpeg_mem_src(&jpeg_, reinterpret_cast<const unsigned char*>(bytes.data()), static_cast<unsigned long>(bytes.size()));
    }
    (void)jpeg_read_header(&jpeg_, TRUE);
    return true;
  }

  std::size_t width() const { return jpeg_.image_width; }
  std::size_t height() const { return jpeg_.image_height; }
  int components() const { return jpeg_.num_components; }
  bool has_multiple_scans() { return jpeg_has_multiple_scans(&jpeg_) != 0; }

  // Fills `out` with rows of pixels, 1 or 3 components of each, as many as there are. False: truncated or damaged. libjpeg fills up what is
  // missing, and only warns.
  bool ReadRows(JSAMPLE* out) {
    if (setjmp(jump_) != 0) return false;
    jpeg_.out_color_space = jpeg_.num_components == 1 ? JCS_GRAYSCALE : JCS_RGB;
    (void)jpeg_start_decompress(&jpeg_);
    while (jpeg_.output_scanline < jpeg_.output_height) {
      JSAMPROW row = out + jpeg_.output_scanline * width() * std::size_t(jpeg_.num_components);
      (void)jpeg_read_scanlines(&jpeg_, &row, 1);
    }
    (void)jpeg_finish_decompress(&jpeg_);
    return errors_.num_warnings == 0;
  }

  // Why one of them failed, as far as libjpeg has told: "".
  const char* complaint() const { return complaint_.data(); }

 private:
  static void OnError(j_common_ptr jpeg) {
    auto& picture = *static_cast<JpegPicture*>(jpeg->client_data);
    (*jpeg->err->format_message)(jpeg, picture.complaint_.data());
    std::longjmp(picture.jump_, 1);
  }
  // A picture with thousands of scans would take hours.
  static void OnProgress(j_common_ptr jpeg) {
    constexpr int kMostScans = 200;
    if (reinterpret_cast<j_decompress_ptr>(jpeg)->input_scan_number <= kMostScans) return;
    auto& picture = *static_cast<JpegPicture*>(jpeg->client_data);
    std::snprintf(picture.complaint_.data(), picture.complaint_.size(), "more than %d scans", kMostScans);
    std::longjmp(picture.jump_, 1);
  }

  jpeg_decompress_struct jpeg_{};
  jpeg_error_mgr errors_{};
  jpeg_progress_mgr progress_{.progress_monitor = OnProgress};
  std::jmp_buf jump_{};
  std::array<char, JMSG_LENGTH_MAX> complaint_{};
};

}  // namespace slabstream
