#include "data/volume_io/tiff_stack.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <utility>

#include "common/base/log.h"
#include "data/volume_io/chosen_channel.h"
#include "data/volume_io/ome_header.h"
#include "data/volume_io/page_layout.h"
#include "data/volume_io/stated_field.h"

namespace slabstream {
namespace {

// The pages of the files of a set, which are read when they are first asked for.
class Pages {
 public:
  explicit Pages(std::vector<std::string> files) : files_(std::move(files)), pages_(files_.size()) {}

  Result<const std::vector<TiffPage>*> Of(std::size_t file) {
    std::optional<std::vector<TiffPage>>& pages = pages_[file];
    if (pages) return &*pages;
    const std::string& path = files_[file];
    std::error_code error;
    if (!std::filesystem::is_regular_file(path, error)) {
      return Status::NotFound(fmt::format("{}: has planes in {}, which is not there", files_.front(), path));
    }
    Result<std::unique_ptr<TiffFile>> opened = TiffFile::Open(path);
    if (!opened.ok()) return opened.status();
    Result<std::vector<TiffPage>> read = (*opened)->ReadPages();
    if (!read.ok()) return read.status();
    pages = *std::move(read);
    return &*pages;
  }

  // The page with this number among all directories of the file. InvalidArgument: there is none.
  Result<const TiffPage*> Numbered(std::size_t file, std::int64_t number) {
    const Result<const std::vector<TiffPage>*> pages = Of(file);
    if (!pages.ok()) return pages.status();
    const auto found = std::ranges::lower_bound(**pages, number, {}, &TiffPage::number);
    if (found != (*pages)->end() && found->number == number) return &*found;
    return Status::InvalidArgument(
        fmt::format("{}: its description names page {} of {}, which has {} pages", files_.front(), number, files_[file], (*pages)->size()));
  }

  const std::vector<std::string>& files() const { return files_; }

 private:
  const std::vector<std::string> files_;
  std::vector<std::optional<std::vector<TiffPage>>> pages_;
};

TiffSlice SliceAt(std::size_t file, const TiffPage& page) { return {file, page.offset, page.number, 0, page.smaller}; }

Result<std::unique_ptr<TiffFile>> OpenAt(const Pages& pages, const TiffSlice& slice) {
  return TiffFile::Open(pages.files()[slice.file], slice.directory);
}

// What the file says of its pages.
Result<PageLayout> ReadLayout(const std::string& path, const ReadOptions& options) {
  const Result<std::string> description = DescriptionIn(path);
  if (!description.ok()) return description.status();
  if (IsOmeHeader(*description)) return ReadOmeLayout(path, *description, options);
  const Result<std::unique_ptr<TiffFile>> first = TiffFile::Open(path);
  if (!first.ok()) return first.status();
  if (!options.series.empty()) return (*first)->Refused("series is for OME-TIFF files that hold several images");
  const Result<RawHeader> header = (*first)->ReadHeader();
  if (!header.ok()) return header.status();
  if (IsImageJHeader(*description)) return ReadImageJHeader(**first, *header, *description);
  const Result<std::optional<PageLayout>> shape = ReadTifffileHeader(path, *description, *header, options);
  if (!shape.ok()) return shape.status();
  return shape->value_or(PageLayout{});
}

// Pages that follow each other in one file. Components of a page may be counted as channels. Pages that do not fit a header which says
// nothing of channels and times are slices, as they are without it.
Status FitPages(const std::string& path, const RawHeader& page, std::int64_t pages, PageLayout& layout) {
  const auto fits = [&] { return layout.planes() == pages || pages == 1; };
  if (layout.source.empty()) layout.slices = pages;
  if (!fits() && layout.channels % page.components == 0 && layout.planes() / page.components == pages) layout.channels /= page.components;
  if (fits()) return Status::Ok();
  if (layout.source == "tifffile" && layout.times == 1 && pages % layout.planes() == 0) {
    layout.times = pages / layout.planes();
    layout.order = layout.order.substr(0, layout.order.find('T')) + layout.order.substr(layout.order.find('T') + 1) + 'T';
    layout.notes.emplace_back("each of several arrays in the file is a time");
    return Status::Ok();
  }
  if (layout.source != "OME" && layout.channels == 1 && layout.times == 1) {
    layout.notes.push_back(
        fmt::format("its {} header speaks of {} slices: each of its {} pages is one", layout.source, layout.slices, pages));
    layout.slices = pages;
    return Status::Ok();
  }
  return Status::InvalidArgument(
      fmt::format("{}: its {} description speaks of {}, the file has {} pages", path, layout.source, layout.Text(), pages));
}

struct Chosen {
  std::int64_t channel = 0, time = 0;    // of pages
  int number = 0;                        // among the channels of the image, which counts the components of its pages
  std::vector<FieldInfo> channels = {};  // those; empty: there is one, of which nothing is said
};

Result<Chosen> Choose(const std::string& path, const PageLayout& layout, int components, const ReadOptions& options) {
  const Result<std::int64_t> time = ChosenVolume(path, layout.times, options);
  if (!time.ok()) return time.status();
  Chosen chosen{.time = *time};
  const bool one_described = components == 1 && !layout.described.empty() && layout.described.front() != FieldInfo{};
  if (layout.channels == 1 && !one_described) return chosen;
  if (layout.channels > std::int64_t(kMostChannels) / components) {
    return Status::InvalidArgument(
        fmt::format("{}: {} channels of {} components, must be at most {}", path, layout.channels, components, kMostChannels));
  }
  for (std::int64_t i = 0; i < layout.channels * components; ++i) {
    const auto channel = std::size_t(i / components);
    chosen.channels.push_back(channel < layout.described.size() ? layout.described[channel] : FieldInfo{});
    if (components > 1) chosen.channels.back().color.reset();  // it is that of all components together
  }
  const Result<int> number = ChosenChannel(path, chosen.channels, options);
  if (!number.ok()) return number.status();
  chosen.number = *number;
  chosen.channel = *number / components;
  return chosen;
}

Result<std::vector<TiffSlice>> SlicesOfFile(Pages& pages, const PageLayout& layout, const Chosen& chosen, const RawHeader& page) {
  const Result<const std::vector<TiffPage>*> all = pages.Of(0);
  if (!all.ok()) return all.status();
  const bool in_one = (*all)->size() == 1 && layout.planes() > 1;
  if (in_one) {
    const auto file = OpenAt(pages, SliceAt(0, (*all)->front()));
    if (!file.ok()) return file.status();
    if (Status status = (*file)->CheckPlanes(page, layout.planes()); !status.ok()) return status;
  }
  std::vector<TiffSlice> slices;
  for (std::int64_t z = 0; z < layout.slices; ++z) {
    const std::int64_t number = layout.NumberOf(z, chosen.channel, chosen.time);
    slices.push_back(SliceAt(0, (**all)[in_one ? 0 : std::size_t(number)]));
    if (in_one) slices.back().plane = number;
  }
  return slices;
}

Result<std::vector<TiffSlice>> SlicesOfRuns(Pages& pages, const PageLayout& layout, const Chosen& chosen) {
  struct Numbered {
    std::int64_t first;
    const PageRun* run;
  };
  std::vector<Numbered> runs;
  for (const PageRun& run : layout.runs) {
    // tifffile and Bio-Formats leave out places beyond the image, which cropping leaves behind.
    const bool inside = run.slice < layout.slices && run.channel < layout.channels && run.time < layout.times;
    if (inside) runs.push_back({layout.NumberOf(run.slice, run.channel, run.time), &run});
  }
  std::ranges::stable_sort(runs, {}, &Numbered::first);
  std::vector<TiffSlice> slices;
  for (std::int64_t z = 0; z < layout.slices; ++z) {
    const std::int64_t number = layout.NumberOf(z, chosen.channel, chosen.time);
    const auto behind = std::ranges::upper_bound(runs, number, {}, &Numbered::first);
    const Numbered* const last = behind == runs.begin() ? nullptr : &*std::prev(behind);
    if (last == nullptr || (last->run->count > 0 && number >= last->first + last->run->count)) {
      return Status::InvalidArgument(fmt::format("{}: its OME description names no page for slice {} of channel {} at time {}",
                                                 pages.files().front(), z, chosen.channel, chosen.time));
    }
    const Result<const TiffPage*> page = pages.Numbered(last->run->file, last->run->page + number - last->first);
    if (!page.ok()) return page.status();
    slices.push_back(SliceAt(last->run->file, **page));
  }
  return slices;
}

// Some writers count the planes of a TiffData along another axis first than DimensionOrder says, so that runs overlap and planes are
// missing. The order in which they do not is meant.
void TakeOrderThatFits(PageLayout& layout) {
  if (layout.RunsFit()) return;
  const std::string stated = layout.order;
  for (const char* order : {"ZCT", "ZTC", "CZT", "CTZ", "TZC", "TCZ"}) {
    layout.order = order;
    if (!layout.RunsFit()) continue;
    layout.notes.push_back(fmt::format("TiffData do not fit the order XY{} of DimensionOrder, but XY{}, which is taken", stated, order));
    return;
  }
  layout.order = stated;
}

// The only slice of each of several times. A stack whose slices are called times is far more common than a film of pictures.
void TakeTimesAsSlices(const std::string& path, PageLayout& layout) {
  LogWarning(fmt::format("{}: its {} description speaks of {}: the times are taken for slices", path, layout.source, layout.Text()));
  std::swap(layout.slices, layout.times);
  for (char& axis : layout.order) axis = axis == 'Z' ? 'T' : axis == 'T' ? 'Z' : axis;
  for (PageRun& run : layout.runs) std::swap(run.slice, run.time);
}

std::string OrderNote(const PageLayout& layout) {
  if (!layout.runs.empty()) {
    return fmt::format("OME: {}; TiffData names the page of each{}", layout.Text(),
                       layout.files.size() > 1 ? fmt::format(", in {} files", layout.files.size()) : "");
  }
  return fmt::format("{}: {}; from page to page {} runs fastest, then {}, then {}", layout.source, layout.Text(), layout.order[0],
                     layout.order[1], layout.order[2]);
}

std::int64_t BytesOfFiles(const TiffStack& stack) {
  std::int64_t bytes = 0;
  for (const std::string& file : stack.files) bytes += BytesOfFile(file);
  return bytes;
}

}  // namespace

std::size_t FilesOf(const std::string& path) {
  const Result<PageLayout> layout = ReadLayout(path, {});
  return layout.ok() ? std::max<std::size_t>(layout->files.size(), 1) : 1;
}

std::string TiffStack::NameOf(const TiffSlice& slice) const {
  return fmt::format("{}: page {}", files[slice.file], slice.page + slice.plane + 1);
}

Result<TiffStack> OpenTiffStack(const std::string& path, const ReadOptions& options) {
  Result<PageLayout> read = ReadLayout(path, options);
  if (!read.ok()) return read.status();
  PageLayout layout = *std::move(read);
  if (layout.files.empty()) layout.files = {path};
  Pages pages(layout.files);

  // A page tells how many components there are, which OME counts as channels.
  const auto own = std::ranges::find(layout.runs, std::size_t{0}, &PageRun::file);
  const PageRun run = layout.runs.empty() ? PageRun{} : own != layout.runs.end() ? *own : layout.runs.front();
  const Result<const TiffPage*> some_page = pages.Numbered(run.file, run.page);
  if (!some_page.ok()) return some_page.status();
  const auto file = OpenAt(pages, SliceAt(run.file, **some_page));
  if (!file.ok()) return file.status();
  const Result<RawHeader> page = (*file)->ReadHeader();
  if (!page.ok()) return page.status();
  if (!layout.runs.empty()) {
    if (layout.channels % page->components == 0) layout.channels /= page->components;
    TakeOrderThatFits(layout);
  } else {
    const Result<const std::vector<TiffPage>*> all = pages.Of(0);
    if (!all.ok()) return all.status();
    if (Status status = FitPages(path, *page, std::int64_t((*all)->size()), layout); !status.ok()) return status;
  }

  if (layout.slices == 1 && layout.times > 1 && !options.time) TakeTimesAsSlices(path, layout);
  // One page may be what is left of several.
  if (layout.slices == 1 && !(*file)->HoldsDirectory((*some_page)->offset)) return Status::DataLoss(path + ": truncated after page 1");
  Result<Chosen> chosen = Choose(path, layout, page->components, options);
  if (!chosen.ok()) return chosen.status();
  TiffStack stack{.files = layout.files, .of_pages = options};
  if (!chosen->channels.empty()) stack.of_pages.channel = chosen->number % page->components;
  Result<std::vector<TiffSlice>> slices =
      layout.runs.empty() ? SlicesOfFile(pages, layout, *chosen, *page) : SlicesOfRuns(pages, layout, *chosen);
  if (!slices.ok()) return slices.status();
  stack.slices = *std::move(slices);

  const auto slice = OpenAt(pages, stack.slices.front());
  if (!slice.ok()) return slice.status();
  Result<RawHeader> header = (*slice)->ReadHeader();
  if (!header.ok()) return header.status();
  if (layout.spacing) {
    header->steps = StepsOf(*layout.spacing);
    header->unit = layout.unit;
  }
  header->rescale = layout.rescale;
  if (!layout.source.empty()) header->notes.push_back(OrderNote(layout));
  header->notes.insert(header->notes.end(), layout.notes.begin(), layout.notes.end());
  header = HeaderOfSlices(path, *header, layout.slices, BytesOfFiles(stack), options);
  if (!header.ok()) return header.status();
  header->times = StatedTimes(layout.times, layout.time_step, layout.time_unit);
  header->number = chosen->time;
  header->channels = std::move(chosen->channels);
  header->channel = chosen->number;
  stack.header = *std::move(header);
  return stack;
}

}  // namespace slabstream
