// Options for reading a file, as they stand behind its path.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "data/volume_io/read_options.h"
#include "tests/data/volume_io/volume_files.h"

namespace slabstream {
namespace {

using testing::HasSubstr;

TEST(SourceText, IsAPathWithOptionsBehindIt) {
  const Result<SourceText> source = ParseSourceText("ct.raw?dims=512,256,300,type=int16,spacing=0.7,0.7,1.25,endian=big,offset=128");
  ASSERT_TRUE(source.ok()) << source.status().message();
  EXPECT_EQ(source->path, "ct.raw");
  EXPECT_EQ(source->options.dims, (Index3{512, 256, 300}));
  EXPECT_EQ(source->options.type, SampleType::kInt16);
  EXPECT_EQ(source->options.spacing, (Vec3{0.7, 0.7, 1.25}));
  EXPECT_EQ(source->options.big_endian, true);
  EXPECT_EQ(source->options.offset, 128);
  EXPECT_FALSE(source->options.time);
  EXPECT_EQ(ParseSourceText("head.nii.gz?time=3")->options.time, (TimeRange{3, 3}));
  EXPECT_EQ(ParseSourceText("head.nii.gz?channel=luminance")->options.channel, kLuminance);
  EXPECT_EQ(ParseSourceText("scan.h5?dataset=/exchange/data,time=2")->options.dataset, "/exchange/data");
  EXPECT_TRUE(ParseSourceText("atlas.zarr?follow-links=yes,time=2")->options.follow_links);
  EXPECT_FALSE(ParseSourceText("atlas.zarr?follow-links=no")->options.follow_links);
  EXPECT_EQ(ParseSourceText("head.nii.gz")->path, "head.nii.gz");
  EXPECT_EQ(ParseSourceText("what?")->path, "what?") << "no option stands behind the question mark";
}

TEST(SourceText, MayBeABucketOfAServer) {
  const std::string bucket = "s3://bucket/em?endpoint=http://127.0.0.1:9000";
  EXPECT_EQ(ParseSourceText(bucket)->path, bucket);
  const Result<SourceText> timed = ParseSourceText(WithReadOption(bucket, "time", "3"));
  ASSERT_TRUE(timed.ok()) << timed.status().message();
  EXPECT_EQ(timed->path, bucket);
  EXPECT_EQ(timed->options.time, (TimeRange{3, 3}));
  EXPECT_EQ(AtTime(bucket + ",time=3", 4), bucket + ",time=4");
  EXPECT_EQ(ParseSourceText("s3://bucket/em?time=3")->path, "s3://bucket/em");
}

TEST(SourceText, OptionsStandBehindTheQueryOfAnAddress) {
  const std::string place = "https://host/a.zarr", signed_place = place + "?sv=2022-11&sig=a%2Bb";
  struct Case {
    std::string text, query, options;
    int time;  // -1: none
  };
  const Case cases[] = {{place, "", "", -1},
                        {place + "?time=1", "", "?time=1", 1},
                        {place + "?time=1,array=a?b", "", "?time=1,array=a?b", 1},
                        {signed_place, "sv=2022-11&sig=a%2Bb", "", -1},
                        {signed_place + ",c=d,time=1,channel=2", "sv=2022-11&sig=a%2Bb,c=d", "?time=1,channel=2", 1},
                        {signed_place + "?time=1", "sv=2022-11&sig=a%2Bb", "?time=1", 1},
                        {place + "?token=x y", "token=x%20y", "", -1}};
  for (const auto& [text, query, options, time] : cases) {
    const Result<SourceText> source = ParseSourceText(text);
    ASSERT_TRUE(source.ok()) << text << source.status().message();
    EXPECT_EQ(source->path, place) << text;
    EXPECT_EQ(source->options.query, query) << text;
    EXPECT_EQ(source->options_text, options) << text;
    EXPECT_EQ(source->options.time ? source->options.time->first : -1, time) << text;
    const Result<SourceText> later = ParseSourceText(AtTime(text, 7));
    ASSERT_TRUE(later.ok()) << text << later.status().message();
    EXPECT_EQ(later->options.time, (TimeRange{7, 7})) << text;
    EXPECT_EQ(later->options.query, query) << text;
  }
  EXPECT_EQ(ParseSourceText("  https://host/my scan.zarr/ \n")->path, "https://host/my%20scan.zarr");
  EXPECT_EQ(ParseSourceText("s3://b/x?time=1,endpoint=http://h:9000,channel=2")->path, "s3://b/x?endpoint=http://h:9000");
  EXPECT_EQ(ParseSourceText("s3://b/x?time=1,endpoint=http://h:9000,channel=2")->options_text, "?time=1,channel=2");
}

TEST(SourceText, HeadersAreOptionsOfAddresses) {
  const std::string text =
      WithReadOption(WithReadOption("https://host/x?sig=secret", "header", "Authorization:@/run/token"), "header", "X-Id:key");
  const Result<SourceText> source = ParseSourceText(text + ",time=1");
  ASSERT_TRUE(source.ok()) << source.status().message();
  EXPECT_EQ(source->options.headers, (std::vector<std::string>{"Authorization:@/run/token", "X-Id:key"}));
  EXPECT_EQ(source->options_text, "?time=1") << "which volume it is, they do not say";
  EXPECT_EQ(ShownSource(text + ",time=1"), "https://host/x?...?header=Authorization:@/run/token,header=X-Id:...,time=1");
  for (const char* wrong :
       {"header=", "header=secret", "header=:secret", "header=A b:secret", "header=A:", "header=Range:secret", "header=A:se\ncret"}) {
    const Status status = ParseSourceText(std::string("https://host/x?") + wrong).status();
    EXPECT_EQ(status.code(), StatusCode::kInvalidArgument) << wrong;
    EXPECT_THAT(status.message(), testing::Not(HasSubstr("secret"))) << wrong;
  }
}

TEST(SourceText, MayBeSpelledAsOtherProgramsSpellIt) {
  const std::pair<const char*, const char*> cases[] = {
      {"zarr://https://host/a.zarr", "https://host/a.zarr"},
      {"zarr2://s3://bucket/a", "s3://bucket/a"},
      {"precomputed://gs://bucket/em/my image", "https://storage.googleapis.com/bucket/em/my%20image"},
      {"n5://https://host/a.n5/", "https://host/a.n5"},
      {"https://host/a.zarr/|zarr3:", "https://host/a.zarr"},
      {"https://host/a.zarr|zarr2:labels/cells/|", "https://host/a.zarr/labels/cells"},
      {"https://host/p|neuroglancer-precomputed://", "https://host/p"},
      {"s3+https://host:9000/bucket/a", "s3://bucket/a?endpoint=https://host:9000"},
      {"HTTPS://host/a", "https://host/a"},
      {"http://[::1]:8080/a", "http://[::1]:8080/a"},
      {"file:///data/a%20b.zarr", "/data/a b.zarr"},
      {"file://localhost/data/a", "/data/a"},
      {"zarr://file:///data/a", "/data/a"},
      {"zarr:///data/a", "/data/a"},
      {"precomputed://data/a", "data/a"},
  };
  for (const auto& [text, path] : cases) {
    const Result<SourceText> source = ParseSourceText(text);
    ASSERT_TRUE(source.ok()) << text << ": " << source.status().message();
    EXPECT_EQ(source->path, path);
    EXPECT_EQ(ParseSourceText(std::string(text) + "?time=3")->path, path);
    EXPECT_EQ(ParseSourceText(std::string(text) + "?time=3")->options.time, (TimeRange{3, 3}));
  }
  const Result<SourceText> piped = ParseSourceText("https://host/a.zarr?sig=x|zarr3:,time=1");
  EXPECT_EQ(piped->path, "https://host/a.zarr");
  EXPECT_EQ(piped->options.query, "sig=x");
  const std::pair<const char*, const char*> wrong[] = {
      {"az://container/a", "write https://ACCOUNT.blob.core.windows.net/container/a"},
      {"abfss://container@account.dfs.core.windows.net/a", "write https://account.blob.core.windows.net/container/a"},
      {"ftp://host/a", "'ftp' is none of the schemes http, https, s3, gs and file"},
      {"file://data/a", "an absolute path"},
      {"https://host/a.zip|zip:", "'zip' is no format that is read from an address"},
      {"https://host/viewer?source=https://host/a.zarr", "the page of a viewer"},
      {"https://host/a.zarr?tine=3", "'tine' is no option"},
  };
  for (const auto& [text, why] : wrong) {
    const Status status = ParseSourceText(text).status();
    EXPECT_EQ(status.code(), StatusCode::kInvalidArgument) << text;
    EXPECT_THAT(status.message(), HasSubstr(why));
  }
}

TEST(SourceText, MayBeAFileWithAQuestionMark) {
  const TemporaryDirectory directory;
  const std::string odd = directory / "a?time=1";
  WriteFile(odd, "x");
  EXPECT_EQ(ParseSourceText(odd)->path, odd);
  const Result<SourceText> with_option = ParseSourceText(odd + "?time=2");
  EXPECT_EQ(with_option->path, odd);
  EXPECT_EQ(with_option->options.time, (TimeRange{2, 2}));
}

TEST(SourceText, SaysWhatIsWrong) {
  const std::pair<const char*, const char*> cases[] = {
      {"v?tine=3", "'tine' is no option for reading a file, which are time, channel"},
      {"v?time=", "'v?time=': time '' must be a whole number"},
      {"v?time=-1", "time '-1' must be a whole number in [0,"},
      {"v?time=1.5", "time '1.5' must be"},
      {"v?time=1,time=2", "time is given twice"},
      {"v?dims=1,2", "dims '1,2' must be three whole numbers"},
      {"v?dims=1,2,0", "dims '1,2,0' must be three whole numbers in [1, 65535]"},
      {"v?dims=1,2,3,4", "dims '1,2,3,4' must be"},
      {"v?dims=1,2,99999999999", "dims '1,2,99999999999' must be"},
      {"v?spacing=1,nan,1", "spacing '1,nan,1' must be three numbers above 0"},
      {"v?spacing=1,0,1", "must be three numbers above 0"},
      {"v?spacing=1,inf,1", "must be three numbers above 0"},
      {"v?type=int12", "type 'int12' must be one of int8, uint8, int16"},
      {"v?endian=middle", "endian 'middle' must be little or big"},
      {"v?offset=-1", "offset '-1' must be a whole number of bytes"},
      {"v?dataset=", "dataset '' must be the path of a dataset"},
      {"v?follow-links=perhaps", "follow-links 'perhaps' must be yes or no"},
      {"v?channel=red", "channel 'red' must be luminance, magnitude or a whole number"},
  };
  for (const auto& [text, why] : cases) {
    const Result<SourceText> source = ParseSourceText(text);
    ASSERT_FALSE(source.ok()) << text;
    EXPECT_EQ(source.status().code(), StatusCode::kInvalidArgument);
    EXPECT_THAT(source.status().message(), HasSubstr(why));
  }
}

TEST(SourceText, TimesAreOneOrARangeWithBothEnds) {
  EXPECT_EQ(ParseTimeRange("--time", "3")->count(), 1);
  EXPECT_EQ(ParseTimeRange("--time", "3")->last, 3);
  const TimeRange range = ParseTimeRange("--time", "0:19").value();
  EXPECT_EQ(range.first, 0);
  EXPECT_EQ(range.last, 19);
  EXPECT_EQ(range.count(), 20);
  for (const char* text : {"", ":", "1:", ":1", "2:1", "-1", "0:1:2", "0-3", "1048576", "0:1048576", "a:b"}) {
    EXPECT_THAT(ParseTimeRange("--time", text).status().message(), HasSubstr("--time")) << text;
  }
}

TEST(SourceText, IsNamedAtAnotherTime) {
  EXPECT_EQ(AtTime("v.nii", 3), "v.nii?time=3");
  EXPECT_EQ(AtTime("v.nii?time=0:9", 3), "v.nii?time=3");
  EXPECT_EQ(AtTime("v.npy?spacing=1,1,2,time=0:9", 3), "v.npy?spacing=1,1,2,time=3");
  EXPECT_EQ(AtTime("v.raw?time=0,dims=2,2,2", 3), "v.raw?dims=2,2,2,time=3");
}

TEST(SourceText, TakesOptionsOneByOne) {
  std::string source = "v.raw";
  source = WithReadOption(source, "dims", "1,2,3");
  source = WithReadOption(source, "type", "uint8");
  EXPECT_EQ(source, "v.raw?dims=1,2,3,type=uint8");
  EXPECT_EQ(ParseSourceText(source)->options.dims, (Index3{1, 2, 3}));
}

}  // namespace
}  // namespace slabstream
