#include "tests/data/volume_io/dicom_files.h"

#include <fmt/format.h>
#include <gdcmDataElement.h>
#include <gdcmDict.h>
#include <gdcmDicts.h>
#include <gdcmGlobal.h>
#include <gdcmImageChangeTransferSyntax.h>
#include <gdcmImageReader.h>
#include <gdcmSequenceOfFragments.h>
#include <gdcmSequenceOfItems.h>
#include <gdcmTrace.h>
#include <gdcmUIDGenerator.h>
#include <gdcmWriter.h>

#include <cstring>
#include <filesystem>
#include <sstream>

#include "common/base/check.h"

namespace slabstream {
namespace {

gdcm::Tag TagOf(DicomTag tag) { return {std::uint16_t(tag >> 16), std::uint16_t(tag & 0xffff)}; }

template <class T>
std::string Binary(const std::string& text) {
  std::istringstream words(text);
  double number = 0;
  std::string bytes;
  while (words >> number) {
    const auto value = T(number);
    bytes.append(reinterpret_cast<const char*>(&value), sizeof(T));
  }
  return bytes;
}

gdcm::DataElement ElementOf(DicomTag tag, const std::string& text) {
  const gdcm::VR type = gdcm::Global::GetInstance().GetDicts().GetPublicDict().GetDictEntry(TagOf(tag)).GetVR();
  CHECK(type != gdcm::VR::INVALID) << tag;
  gdcm::DataElement element(TagOf(tag), 0, type);
  std::string value = type == gdcm::VR::US   ? Binary<std::uint16_t>(text)
                      : type == gdcm::VR::UL ? Binary<std::uint32_t>(text)
                      : type == gdcm::VR::FD ? Binary<double>(text)
                                             : text;
  if (value.size() % 2 == 1) value += type == gdcm::VR::UI ? '\0' : ' ';
  element.SetByteValue(value.data(), gdcm::VL(std::uint32_t(value.size())));
  return element;
}

void Put(gdcm::DataSet& data, const DicomValues& values) {
  for (const auto& [tag, text] : values) data.Replace(ElementOf(tag, text));
}

void PutSequence(gdcm::DataSet& data, DicomTag tag, const std::vector<gdcm::DataSet>& items) {
  const gdcm::SmartPointer<gdcm::SequenceOfItems> sequence = new gdcm::SequenceOfItems;
  sequence->SetLengthToUndefined();
  for (const gdcm::DataSet& nested : items) {
    gdcm::Item item;
    item.SetVLToUndefined();
    item.SetNestedDataSet(nested);
    sequence->AddItem(item);
  }
  gdcm::DataElement element(TagOf(tag), 0, gdcm::VR::SQ);
  element.SetValue(*sequence);
  element.SetVLToUndefined();
  data.Replace(element);
}

gdcm::DataSet GroupItem(const std::vector<DicomGroups>& groups) {
  gdcm::DataSet item;
  for (const auto& [sequence, values] : groups) {
    gdcm::DataSet nested;
    Put(nested, values);
    PutSequence(item, sequence, {nested});
  }
  return item;
}

gdcm::TransferSyntax SyntaxOf(DicomSyntax syntax) {
  switch (syntax) {
    case DicomSyntax::kImplicit: return gdcm::TransferSyntax::ImplicitVRLittleEndian;
    case DicomSyntax::kExplicit: break;
    case DicomSyntax::kBigEndian: return gdcm::TransferSyntax::ExplicitVRBigEndian;
    case DicomSyntax::kJpegLossless: return gdcm::TransferSyntax::JPEGLosslessProcess14_1;
    case DicomSyntax::kJpegLs: return gdcm::TransferSyntax::JPEGLSLossless;
    case DicomSyntax::kJpeg2000: return gdcm::TransferSyntax::JPEG2000Lossless;
    case DicomSyntax::kRle: return gdcm::TransferSyntax::RLELossless;
  }
  return gdcm::TransferSyntax::ExplicitVRLittleEndian;
}

// The pixels of the file at `path`, compressed.
gdcm::DataElement CompressedPixels(const std::string& path, DicomSyntax syntax) {
  gdcm::ImageReader reader;
  reader.SetFileName(path.c_str());
  CHECK(reader.Read()) << path;
  gdcm::ImageChangeTransferSyntax change;
  change.SetTransferSyntax(SyntaxOf(syntax));
  change.SetInput(reader.GetImage());
  CHECK(change.Change()) << path;
  return change.GetOutput().GetDataElement();
}

void Write(const std::string& path, const gdcm::DataSet& data, const gdcm::TransferSyntax& syntax) {
  std::filesystem::remove(path);
  gdcm::Writer writer;
  writer.SetFileName(path.c_str());
  writer.GetFile().SetDataSet(data);
  writer.GetFile().GetHeader().SetDataSetTransferSyntax(syntax);
  CHECK(writer.Write()) << path;
}

}  // namespace

DicomValues PixelValues(SampleType type) {
  const std::size_t bits = 8 * BytesPerSample(type);
  const bool is_signed = type == SampleType::kInt8 || type == SampleType::kInt16 || type == SampleType::kInt32;
  return {{kTagBitsAllocated, std::to_string(bits)},
          {kTagBitsStored, std::to_string(bits)},
          {kTagHighBit, std::to_string(bits - 1)},
          {kTagPixelRepresentation, is_signed ? "1" : "0"}};
}

DicomValues SliceValues() {
  DicomValues values = PixelValues(SampleType::kInt16);
  values.merge(DicomValues{{0x00080016, "1.2.840.10008.5.1.4.1.1.2"},
                           {kTagImageType, "ORIGINAL\\PRIMARY\\AXIAL"},
                           {kTagModality, "CT"},
                           {kTagSeriesDescription, "HEAD"},
                           {kTagSeriesUid, "1.2.3"},
                           {kTagSeriesNumber, "1"},
                           {kTagInstanceNumber, "1"},
                           {kTagPosition, "0\\0\\0"},
                           {kTagOrientation, "1\\0\\0\\0\\1\\0"},
                           {kTagSamplesPerPixel, "1"},
                           {kTagPhotometric, "MONOCHROME2"},
                           {kTagRows, "3"},
                           {kTagColumns, "4"},
                           {kTagPixelSpacing, "1\\1"}});
  return values;
}

std::string Lps(const std::vector<Vec3>& ras) {
  std::string text;
  for (const Vec3& v : ras) text += fmt::format("{}{:.9g}\\{:.9g}\\{:.9g}", text.empty() ? "" : "\\", -v.x, -v.y, v.z);
  return text;
}

void WriteDicom(const std::string& path, const DicomSpec& spec) {
  gdcm::Trace::WarningOff();  // of images that are not usual
  gdcm::Trace::ErrorOff();
  gdcm::DataSet data;
  Put(data, spec.values);
  if (!spec.values.contains(0x00080018)) {
    gdcm::UIDGenerator uids;
    data.Replace(ElementOf(0x00080018, uids.Generate()));
  }
  if (!spec.shared.empty()) PutSequence(data, 0x52009229, {GroupItem(spec.shared)});
  if (!spec.per_frame.empty()) {
    std::vector<gdcm::DataSet> items;
    for (const std::vector<DicomGroups>& frame : spec.per_frame) items.push_back(GroupItem(frame));
    PutSequence(data, 0x52009230, items);
  }
  for (const auto& [tag, items] : spec.sequences) {
    std::vector<gdcm::DataSet> sets(items.size());
    for (std::size_t i = 0; i < items.size(); ++i) Put(sets[i], items[i]);
    PutSequence(data, tag, sets);
  }
  if (!spec.frames.empty()) {
    const gdcm::SmartPointer<gdcm::SequenceOfFragments> fragments = new gdcm::SequenceOfFragments;
    for (FileBytes frame : spec.frames) {
      if (frame.size() % 2 == 1) frame += '\0';
      gdcm::Fragment fragment;
      fragment.SetByteValue(frame.data(), gdcm::VL(std::uint32_t(frame.size())));
      fragments->AddFragment(fragment);
    }
    gdcm::DataElement element(gdcm::Tag(0x7fe0, 0x0010), 0, gdcm::VR::OB);
    element.SetValue(*fragments);
    data.Replace(element);
    return Write(path, data, gdcm::TransferSyntax::GetTSType(spec.frames_syntax.c_str()));
  }
  if (!spec.pixels.empty()) {
    const bool words = spec.values.at(kTagBitsAllocated) != "8";
    FileBytes pixels = spec.pixels;
    if (pixels.size() % 2 == 1) pixels += '\0';
    gdcm::DataElement element(gdcm::Tag(0x7fe0, 0x0010), 0, words ? gdcm::VR::OW : gdcm::VR::OB);
    element.SetByteValue(pixels.data(), gdcm::VL(std::uint32_t(pixels.size())));
    data.Replace(element);
  }
  const bool compressed = spec.syntax > DicomSyntax::kBigEndian;
  Write(path, data, SyntaxOf(compressed ? DicomSyntax::kExplicit : spec.syntax));
  if (!compressed) return;
  // Not by GDCM's writer of images, which changes what it does not know.
  data.Replace(CompressedPixels(path, spec.syntax));
  Write(path, data, SyntaxOf(spec.syntax));
}

FileBytes DicomElement(DicomTag tag, std::string_view type, std::uint32_t length, const FileBytes& value) {
  const auto put = [](std::uint32_t number, int bytes) {
    FileBytes out;
    for (int i = 0; i < bytes; ++i) out += char(number >> (8 * i) & 0xff);
    return out;
  };
  FileBytes bytes = put(tag >> 16, 2) + put(tag & 0xffff, 2) + FileBytes(type);
  if (type.empty()) return bytes + put(length, 4) + value;
  const bool is_long = type == "OB" || type == "OW" || type == "SQ" || type == "UN" || type == "OF" || type == "OD";
  return bytes + (is_long ? put(0, 2) + put(length, 4) : put(length, 2)) + value;
}

std::size_t BeginOfDataSet(const FileBytes& file) {
  constexpr std::size_t kMeta = 132, kLength = 8, kFirst = 12;  // its first element is the length of the others
  std::uint32_t length = 0;
  std::memcpy(&length, file.data() + kMeta + kLength, sizeof(length));
  return kMeta + kFirst + length;
}

void WriteSeries(const std::string& directory, const Stored& stored, SampleType type, const DicomValues& changed, DicomSyntax syntax) {
  const std::size_t slice_bytes = std::size_t(stored.size.x) * std::size_t(stored.size.y) * BytesPerSample(type);
  for (int z = 0; z < stored.size.z; ++z) {
    const int number = z % 2 == 0 ? stored.size.z - 1 - z / 2 : z / 2;  // some order that is not that of positions
    DicomSpec spec{.pixels = stored.samples.substr(std::size_t(z) * slice_bytes, slice_bytes), .syntax = syntax};
    for (const auto& [tag, value] : PixelValues(type)) spec.values[tag] = value;
    spec.values[kTagInstanceNumber] = std::to_string(number);
    spec.values[kTagColumns] = std::to_string(stored.size.x);
    spec.values[kTagRows] = std::to_string(stored.size.y);
    spec.values[kTagPixelSpacing] = fmt::format("{:.9g}\\{:.9g}", Length(stored.steps[1]), Length(stored.steps[0]));
    spec.values[kTagOrientation] = Lps({Normalized(stored.steps[0]), Normalized(stored.steps[1])});
    spec.values[kTagPosition] = Lps({stored.origin + double(z) * stored.steps[2]});
    for (const auto& [tag, value] : changed) spec.values[tag] = value;
    WriteDicom(fmt::format("{}/{:02}_{}", directory, number, z), spec);
  }
}

}  // namespace slabstream
