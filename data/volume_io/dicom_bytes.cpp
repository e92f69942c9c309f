#include "data/volume_io/dicom_bytes.h"

#include <algorithm>
#include <span>

namespace slabstream {

constexpr std::size_t kWindow = std::size_t{1} << 15;  // bytes

DicomBytes::DicomBytes(const std::string& path) : file_(path, std::ios::binary | std::ios::ate) {
  if (file_) size_ = std::int64_t(file_.tellg());
}

DicomBytes::DicomBytes(const std::string& path, std::int64_t deflated_at) : file_(path, std::ios::binary) {
  if (!file_) return;
  size_ = 0;
  inflate_ = Decompressor::Make(Compression::kBareDeflate, file_, deflated_at);
  std::vector<std::byte> block(kWindow);
  for (std::size_t count = block.size(); count == block.size() && size_ < kMaxInflated; size_ += std::int64_t(count)) {
    count = inflate_->Read(block);
  }
  file_.clear();
  inflate_ = Decompressor::Make(Compression::kBareDeflate, file_, deflated_at);
}

const std::byte* DicomBytes::At(std::int64_t offset, std::int64_t bytes) {
  if (offset < 0 || bytes > size_ - offset) return nullptr;
  const bool held = offset >= begin_ && offset + bytes <= begin_ + std::int64_t(window_.size());
  if (!held && !Load(offset, std::size_t(std::min(std::max(bytes, std::int64_t(kWindow)), size_ - offset)))) return nullptr;
  return window_.data() + (offset - begin_);
}

bool DicomBytes::Load(std::int64_t offset, std::size_t bytes) {
  std::size_t kept = 0;
  if (inflate_) {
    // Forward alone: what is held of the new stretch stays, what lies between is skipped.
    const std::int64_t end = begin_ + std::int64_t(window_.size());
    if (offset < begin_) return false;
    window_.erase(window_.begin(), window_.begin() + std::min(offset, end) - begin_);
    kept = window_.size();
    begin_ = offset;
    std::vector<std::byte> skipped(kWindow);
    for (std::int64_t left = offset - end; left > 0;) {
      const std::size_t count = std::min(skipped.size(), std::size_t(left));
      if (inflate_->Read(std::span(skipped).first(count)) != count) return false;
      left -= std::int64_t(count);
    }
    window_.resize(bytes);
    return inflate_->Read(std::span(window_).subspan(kept)) == bytes - kept;
  }
  begin_ = offset;
  window_.resize(bytes);
  file_.clear();
  file_.seekg(offset);
  file_.read(reinterpret_cast<char*>(window_.data()), std::streamsize(bytes));
  if (std::size_t(file_.gcount()) == bytes) return true;
  window_.clear();
  return false;
}

}  // namespace slabstream
