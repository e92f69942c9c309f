#include "data/volume_io/tiff_stack.h"

#include <utility>

namespace slabstream {

Result<TiffStack> OpenTiffStack(const std::string& path, const ReadOptions& options) {
  Result<std::unique_ptr<TiffFile>> file = TiffFile::Open(path);
  if (!file.ok()) return file.status();
  Result<RawHeader> first = (*file)->ReadHeader();
  if (!first.ok()) return first.status();
  Result<std::vector<TiffPage>> pages = (*file)->ReadPages();
  if (!pages.ok()) return pages.status();
  Result<std::unique_ptr<TiffFile>> at_first = (*file)->At(pages->front().offset);
  if (!at_first.ok()) return at_first.status();
  Result<PageOrder> order = (*at_first)->ReadPageOrder(std::int64_t(pages->size()), options);
  if (!order.ok()) return order.status();
  if (order->spacing) {
    first->steps = StepsOf(*order->spacing);
    first->unit = LengthUnit::kMicrometre;
  }
  if (order->count == 1) return Status::InvalidArgument(path + ": has 2 dimensions, must have 3 (a page for each slice)");
  ReadOptions of_pages = options;
  if (order->of_channel) of_pages.channel.reset();
  Result<RawHeader> header = HeaderOfSlices(path, *first, order->count, BytesOfFile(path), options);
  if (!header.ok()) return header.status();
  if (order->of_channel) {
    header->channels = order->channels;
    header->channel = order->channel;
  }
  return TiffStack{*std::move(at_first), *std::move(pages), *std::move(order), *std::move(header), std::move(of_pages)};
}

}  // namespace slabstream
