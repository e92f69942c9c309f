// DICOM files that are cut off, altered or made to do harm: every one ends in a Status of one line that names its path.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <string_view>

#include "data/open/open_source.h"
#include "data/open/read_volume.h"
#include "tests/data/volume_io/dicom_files.h"
#include "tests/support/random.h"

namespace slabstream {
namespace {

using testing::AllOf;
using testing::HasSubstr;

void ExpectRefusal(const Status& status, const std::string& path, const std::string& why = "") {
  ASSERT_FALSE(status.ok());
  EXPECT_THAT(status.message(), AllOf(HasSubstr(path), HasSubstr(why), testing::Not(HasSubstr("\n"))));
  EXPECT_THAT(status.code(), testing::AnyOf(StatusCode::kDataLoss, StatusCode::kInvalidArgument, StatusCode::kResourceExhausted))
      << status.message();
}

// Two slices of noise; the first is the one to be damaged. Returns its bytes.
FileBytes WriteTwoSlices(const TemporaryDirectory& directory, DicomSyntax syntax) {
  std::vector<double> values;
  for (int i = 0; i < 16 * 16; ++i) values.push_back((i * 7919 % 4001) - 2000);
  for (int z = 0; z < 2; ++z) {
    DicomSpec spec{.pixels = EncodeSamples(SampleType::kInt16, values), .syntax = syntax};
    spec.values[kTagRows] = spec.values[kTagColumns] = "16";
    spec.values[kTagPosition] = fmt::format("0\\0\\{}", z);
    WriteDicom(directory / std::to_string(z), spec);
  }
  return ReadFile(directory / "0");
}

constexpr DicomSyntax kSyntaxes[] = {DicomSyntax::kImplicit, DicomSyntax::kExplicit, DicomSyntax::kBigEndian, DicomSyntax::kJpegLossless,
                                     DicomSyntax::kJpegLs,   DicomSyntax::kJpeg2000, DicomSyntax::kRle};

// Writes two slices of each transfer syntax and, `times` times, replaces the first one by damage(its bytes, random). Calls check(what is
// read then, the folder).
template <class Damaged, class Check>
void ReadDamagedSlices(std::uint64_t seed, int times, Damaged&& damage, Check&& check) {
  Random random(seed);
  SCOPED_TRACE(random.trace());
  for (const DicomSyntax syntax : kSyntaxes) {
    const TemporaryDirectory directory;
    const FileBytes good = WriteTwoSlices(directory, syntax);
    ASSERT_TRUE(ReadVolume(directory.path()).ok()) << ReadVolume(directory.path()).status().message();
    for (int i = 0; i < times; ++i) {
      const FileBytes bytes = damage(good, random);
      SCOPED_TRACE(fmt::format("syntax {}, {} of {} bytes", int(syntax), bytes.size(), good.size()));
      WriteFile(directory / "0", bytes);
      check(ReadVolume(directory.path()), directory.path());
    }
  }
}

TEST(DicomMalformed, FilesThatAreCutOffAnywhereFail) {
  // Of the last bytes some may be missing without harm: padding, and what ends a sequence.
  const auto cut = [](const FileBytes& good, Random& random) { return good.substr(0, random.Integer<std::size_t>(132, good.size() - 20)); };
  ReadDamagedSlices(31, 80, cut,
                    [](const Result<LoadedVolume>& loaded, const std::string& folder) { ExpectRefusal(loaded.status(), folder); });
}

TEST(DicomMalformed, AlteredBytesNeverDoHarm) {
  const auto alter = [](FileBytes bytes, Random& random) {
    for (int flips = random.Integer(1, 4); flips > 0; --flips) {
      Damage(bytes[random.Integer<std::size_t>(132, bytes.size() - 1)], random);
    }
    return bytes;
  };
  ReadDamagedSlices(32, 120, alter, [](const Result<LoadedVolume>& loaded, const std::string& folder) {
    if (loaded.ok()) {
      EXPECT_EQ(std::int64_t(loaded->volume->block.bytes.size()), loaded->info.finest().voxel_bytes());
    } else {
      ExpectRefusal(loaded.status(), folder);
    }
  });
}

FileBytes Beginning(const std::string& transfer_syntax = "1.2.840.10008.1.2.1") {
  FileBytes uid = transfer_syntax;
  if (uid.size() % 2 == 1) uid += '\0';
  return FileBytes(128, '\0') + "DICM" + DicomElement(0x00020010, "UI", std::uint32_t(uid.size()), uid);
}

TEST(DicomMalformed, LengthsAndDepthsAreNotBelieved) {
  constexpr std::uint32_t kOpen = 0xffffffff;
  FileBytes deep = Beginning(), items = Beginning() + DicomElement(0x52009230, "SQ", kOpen);
  for (int i = 0; i < 100000; ++i) deep += DicomElement(0x52009230, "SQ", kOpen) + DicomElement(0xfffee000, "", kOpen);
  for (int i = 0; i < 5000000; ++i) items += FileBytes("\xfe\xff\x00\xe0\x00\x00\x00\x00", 8);
  const struct {
    const char* name;
    FileBytes bytes;
    std::string why;
  } cases[] = {
      {"a value of 4 GiB", Beginning() + DicomElement(0x00080060, "OB", 0xfffffff0, "abc"),
       "(0008,0060) claims 4294967280 bytes, there are 3"},
      {"a wanted text that is too long", Beginning() + DicomElement(0x0020000e, "UI", 60000, "1.2"), "(0020,000e) claims 60000 bytes"},
      {"a sequence that is too long", Beginning() + DicomElement(0x52009230, "SQ", 1000, "abc"), "(5200,9230) claims 1000 bytes"},
      {"an item that is too long", Beginning() + DicomElement(0x52009230, "SQ", kOpen) + DicomElement(0xfffee000, "", 1000),
       "(fffe,e000) claims 1000"},
      {"no item", Beginning() + DicomElement(0x52009230, "SQ", kOpen) + DicomElement(0x00080060, "CS", 2, "CT"),
       "must begin there, found (0008,0060)"},
      {"half an element", Beginning() + "\x08", "1 bytes are left"},
      {"sequences without an end", deep, "nest more than 16 deep"},
      {"millions of items", items, "more than 4194304 elements"},
      {"no transfer syntax for compressed pixels", FileBytes(128, '\0') + "DICM" + DicomElement(0x7fe00010, "OB", kOpen),
       "has compressed pixels, and no transfer syntax is stated"},
      {"deflated nothing", Beginning("1.2.840.10008.1.2.1.99"), "no images"},
      {"nothing", FileBytes(128, '\0') + "DICM", "no images"},
      {"no image", Beginning() + DicomElement(0x00080060, "CS", 2, "SR"), "no images: its modality is 'SR'"},
  };
  for (const auto& each : cases) {
    SCOPED_TRACE(each.name);
    const TemporaryDirectory directory;
    WriteFile(directory / "file", each.bytes);
    ExpectRefusal(ReadVolume(directory / "file").status(), directory / "file", each.why);
  }
}

TEST(DicomMalformed, ClaimsOfPixelsAreChecked) {
  const struct {
    const char* name;
    DicomSyntax syntax;
    DicomValues changed;
    std::string why;
  } cases[] = {
      {"more rows", DicomSyntax::kExplicit, {{kTagRows, "65535"}, {kTagColumns, "65535"}}, "truncated"},
      {"more frames", DicomSyntax::kExplicit, {{kTagFrames, "65535"}}, "the header speaks of 65535 frames"},
      {"more frames than a volume has", DicomSyntax::kExplicit, {{kTagFrames, "1e9"}}, "NumberOfFrames is 1e+09"},
      {"more bits", DicomSyntax::kExplicit, {{kTagBitsAllocated, "32"}}, "truncated"},
      {"more compressed rows", DicomSyntax::kJpegLs, {{kTagRows, "65535"}, {kTagColumns, "65535"}}, "compressed pixels, limit 67108864"},
      {"other rows", DicomSyntax::kJpegLs, {{kTagRows, "8"}}, "compressed pixels cannot be read"},
      {"other rows in JPEG", DicomSyntax::kJpegLossless, {{kTagRows, "8"}}, "compressed pixels cannot be read"},
      {"other rows in JPEG 2000", DicomSyntax::kJpeg2000, {{kTagRows, "8000"}}, "compressed pixels cannot be read"},
      {"fewer bits in RLE", DicomSyntax::kRle, {{kTagBitsAllocated, "8"}, {kTagBitsStored, "8"}, {kTagHighBit, "7"}}, "cannot be read"},
      {"more compressed frames", DicomSyntax::kRle, {{kTagFrames, "999"}}, "the header speaks of 999 frames"},
  };
  for (const auto& each : cases) {
    SCOPED_TRACE(each.name);
    const TemporaryDirectory directory;
    (void)WriteTwoSlices(directory, each.syntax);
    for (const char* file : {"0", "1"}) {
      // GDCM writes no file that is wrong: change the values in the bytes.
      FileBytes bytes = ReadFile(directory / file);
      for (const auto& [tag, text] : each.changed) {
        if (tag == kTagFrames) {
          FileBytes value = text;
          if (value.size() % 2 == 1) value += ' ';
          const FileBytes rows = DicomElement(kTagRows, "US", 2);
          bytes.insert(bytes.find(rows), DicomElement(kTagFrames, "IS", std::uint32_t(value.size()), value));
        } else {
          const FileBytes header = DicomElement(tag, "US", 2);
          const int number = std::stoi(text);
          bytes.replace(bytes.find(header) + header.size(), 2, {char(number & 0xff), char(number >> 8)});
        }
      }
      WriteFile(directory / file, bytes);
    }
    ExpectRefusal(ReadVolume(directory.path()).status(), directory.path(), each.why);
  }
}

TEST(DicomMalformed, NamesThatAreNoDicomFail) {
  const TemporaryDirectory directory;
  WriteFile(directory / "slice.dcm", FileBytes(2000, 'x'));
  EXPECT_FALSE(LooksLikeVolume(directory / "slice.dcm"));
  EXPECT_FALSE(LooksLikeVolume(directory.path()));
  ExpectRefusal(ReadVolume(directory / "slice.dcm").status(), directory / "slice.dcm");
}

}  // namespace
}  // namespace slabstream
