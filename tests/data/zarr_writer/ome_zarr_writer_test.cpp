// What is written is compared with the definition of each level, read back by the reader of Zarr, which shares no code with the writer.
#include "data/zarr_writer/ome_zarr_writer.h"
#include "common/json/json.h"
#include "common/parallel/task_arena.h"
#include "data/open/open_source.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <map>
#include <span>
#include <sstream>

#include "common/files/files.h"
#include "tests/data/sources/memory_source.h"
#include "tests/support/full_disk.h"
#include "tests/support/json_at.h"
#include "tests/support/random.h"
#include "tests/support/temporary_directory.h"

namespace slabstream {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

struct Case {
  std::shared_ptr<Volume> volume = std::make_shared<Volume>();
  SourceInfo info;
  OmeZarrOptions options;

  std::shared_ptr<ExactSamples> exact = nullptr;

  std::shared_ptr<VolumeSource> source() const { return MakeMemorySource(volume, info, exact); }
};

Case RandomCase(Random& random, const Index3& size) {
  Case made;
  VolumeDescription& description = made.volume->description;
  description.geometry.size = size;
  description.geometry.spacing = {1, random.Chance(0.5) ? 1.0 : 3.0, random.Chance(0.5) ? 1.0 : 2.0};
  description.type = ScalarType(random.Integer(1, 3));
  made.info.labels = random.Chance(0.4);
  const bool is_signed = random.Chance(0.5);
  made.info.format = "NRRD";
  if (description.type == ScalarType::kUint8) {
    made.info.file_type = is_signed ? "int8" : "uint8";
    if (is_signed) description.mapping.offset = -128;
  } else if (description.type == ScalarType::kUint16) {
    made.info.file_type = is_signed ? "int16" : "uint16";
    if (is_signed) description.mapping.offset = -32768;
  } else {
    made.info.file_type = !made.info.labels ? "float32" : is_signed ? "int32" : "uint32";  // labels of many bits are kept as floats
  }
  made.volume->block = MakeVoxelBlock(description.geometry.bounds(), description.type);
  const int most = made.info.labels ? 3 : 255;  // labels repeat
  const Box zeros = {{0, 0, 0}, {random.Integer(0, size.x), random.Integer(0, size.y), random.Integer(0, size.z)}};
  VisitScalarType(description.type, [&]<class T>(const T*) {
    for (std::int64_t i = 0; i < description.geometry.bounds().voxel_count(); ++i) {
      T& sample = made.volume->block.samples<T>()[i];
      sample = T(random.Integer(0, most));
      if (std::is_same_v<T, float> && made.info.labels) sample *= 1 << 20;
      if (std::is_same_v<T, float> && !made.info.labels && random.Chance(0.2)) sample = T(NAN);
      const Index3 v = {int(i % size.x), int(i / size.x % size.y), int(i / size.x / size.y)};
      if (zeros.Contains(v)) sample = T(-description.mapping.offset);
    }
  });
  if (description.type == ScalarType::kFloat32 && made.info.labels) {
    const SampleType type = is_signed ? SampleType::kInt32 : SampleType::kUint32;
    made.exact = std::make_shared<ExactSamples>(ExactSamples{{type}, AlignedVector<std::byte>(made.volume->block.bytes.size())});
    std::ranges::transform(std::span(made.volume->block.samples<float>(), CountIn(size)),
                           reinterpret_cast<std::uint32_t*>(made.exact->bytes.data()), [](float id) { return std::uint32_t(id); });
  }
  made.options.chunk_side = 8;
  made.options.shard_side = 8 * random.Integer(1, 3);
  made.options.version = random.Chance(0.5) ? OmeZarrVersion::k04 : OmeZarrVersion::k05;
  made.options.source = "scan.nrrd";
  if (random.Chance(0.4)) made.options.slices = SliceOrder{kAxes[std::size_t(random.Integer(0, 2))], random.Chance(0.5)};
  if (random.Chance(0.4)) made.options.coarsest_side = 16;
  return made;
}

// ---- the definition

struct Values {
  Index3 size;
  std::vector<double> values;
};

Values ValuesOf(const VolumeDescription& description, std::span<const std::byte> samples) {
  Values values{description.geometry.size, {}};
  VisitScalarType(description.type, [&]<class T>(const T*) {
    for (std::size_t i = 0; i < samples.size(); i += sizeof(T)) {
      T sample;
      std::memcpy(&sample, samples.data() + i, sizeof(T));
      values.values.push_back(description.mapping.FromStored(double(sample)));
    }
  });
  return values;
}

double DefinedMean(const std::vector<double>& values, bool whole) {
  double sum = 0, count = 0;
  for (const double value : values) {
    if (std::isnan(value)) continue;
    sum += value;
    ++count;
  }
  return whole ? std::round(sum / count) : double(float(sum / count));
}

double DefinedMode(const std::vector<double>& values) {
  std::map<double, int> counts;
  for (const double value : values) ++counts[value];
  return std::ranges::max_element(counts, {}, [](const auto& each) { return each.second; })->first;  // the first one of several
}

Values Coarser(const Values& fine, const Index3& step, bool labels, bool whole) {
  Values coarse{(fine.size + step - Uniform(1)) / step, {}};
  for (int z = 0; z < coarse.size.z; ++z) {
    for (int y = 0; y < coarse.size.y; ++y) {
      for (int x = 0; x < coarse.size.x; ++x) {
        std::vector<double> inside;
        const Box box = Intersection({step * Index3{x, y, z}, step * Index3{x + 1, y + 1, z + 1}}, {{0, 0, 0}, fine.size});
        for (Index3 v = box.begin; v.z < box.end.z; ++v.z) {
          for (v.y = box.begin.y; v.y < box.end.y; ++v.y) {
            for (v.x = box.begin.x; v.x < box.end.x; ++v.x) inside.push_back(fine.values[NumberIn(fine.size, v)]);
          }
        }
        coarse.values.push_back(labels ? DefinedMode(inside) : DefinedMean(inside, whole));
      }
    }
  }
  return coarse;
}

void ExpectLevels(const Case& made, const std::string& folder) {
  const auto read = OpenSource(folder, {}, std::make_shared<ReadContext>(ReadContext::Limits{.decode_threads = 2}));
  ASSERT_TRUE(read.ok()) << read.status().message();
  const VolumeDescription& description = made.volume->description;
  const std::vector<WrittenLevel> plan = PlanLevels(description.geometry, made.options.coarsest_side > 0 ? made.options.coarsest_side : 8);
  const SourceInfo& info = (*read)->info();
  ASSERT_EQ(info.levels.size(), plan.size());
  EXPECT_EQ(info.file_type, made.info.file_type);
  EXPECT_EQ(info.labels, made.info.labels);
  Values expected = ValuesOf(description, made.volume->block.bytes);
  for (std::size_t l = 0; l < plan.size(); ++l) {
    SCOPED_TRACE(l);
    if (l > 0) expected = Coarser(expected, plan[l].step, made.info.labels, description.type != ScalarType::kFloat32);
    const VolumeDescription& level = info.levels[l].description;
    ASSERT_EQ(level.geometry.size, expected.size);
    EXPECT_EQ(level.geometry.spacing, plan[l].spacing);
    EXPECT_EQ(level.geometry.orientation.origin, plan[l].first);
    std::vector<std::byte> samples(std::size_t(level.voxel_bytes()));
    const Status status = (*read)->ReadNow(int(l), level.geometry.bounds(), samples);
    ASSERT_TRUE(status.ok()) << status.message();
    const Values found = ValuesOf(level, samples);
    for (std::size_t i = 0; i < found.values.size(); ++i) {
      const double is = found.values[i], should_be = expected.values[i];
      ASSERT_TRUE(is == should_be || (std::isnan(is) && std::isnan(should_be))) << i << ": " << is << ", expected " << should_be;
    }
  }
}

std::map<std::string, std::string> FilesIn(const std::string& folder) {
  std::map<std::string, std::string> files;
  for (const auto& each : fs::recursive_directory_iterator(folder)) {
    if (!each.is_regular_file()) continue;
    std::ostringstream text;
    text << std::ifstream(each.path(), std::ios::binary).rdbuf();
    files[fs::relative(each.path(), folder).string()] = text.str();
  }
  return files;
}

TEST(OmeZarrWriterTest, EveryLevelIsItsDefinition) {
  const TemporaryDirectory directory;
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    Random random(seed);
    SCOPED_TRACE(random.trace());
    const Case made = RandomCase(random, {random.Integer(1, 60), random.Integer(1, 40), random.Integer(1, 30)});
    const std::string folder = directory / (std::to_string(seed) + ".ome.zarr");
    const Status status = WriteOmeZarr(*made.source(), folder, made.options);
    ASSERT_TRUE(status.ok()) << status.message();
    ExpectLevels(made, folder);
    if (HasFatalFailure()) return;
  }
}

TEST(OmeZarrWriterTest, KeepsTheWorldAndTheMapping) {
  const TemporaryDirectory directory;
  for (const bool turned : {false, true}) {
    for (const OmeZarrVersion version : {OmeZarrVersion::k04, OmeZarrVersion::k05}) {
      Case made;
      VolumeDescription& description = made.volume->description;
      description = {
          .geometry = {.size = {20, 9, 9}, .spacing = {0.1, 0.7, 1.25}}, .type = ScalarType::kUint16, .mapping = {0.5, -16384 + 3}};
      description.geometry.orientation = {
          .world = turned ? World::kPatient : World::kScene, .origin = {-120.3, 7, 1e-3}, .unit = LengthUnit::kMillimetre};
      if (turned) description.geometry.orientation.axes = {Vec3{0.8, 0.6, 0}, Vec3{-0.6, 0.8, 0}, Vec3{0, 0, 1}};
      made.volume->block = MakeVoxelBlock(description.geometry.bounds(), description.type);
      made.info.file_type = "int16";
      made.options = {.version = version, .chunk_side = 8, .shard_side = 16};
      const std::string folder = directory / (std::string(ToString(version)) + (turned ? "turned" : "straight"));
      ASSERT_TRUE(WriteOmeZarr(*made.source(), folder, made.options).ok());
      const auto read = OpenSource(folder, {}, std::make_shared<ReadContext>(ReadContext::Limits{.decode_threads = 1}));
      ASSERT_TRUE(read.ok()) << read.status().message();
      const SourceInfo& info = (*read)->info();
      EXPECT_EQ(info.levels[0].description, description);
      EXPECT_EQ(info.levels[1].description.mapping, description.mapping);
      const VolumeGeometry &fine = description.geometry, &coarse = info.levels[1].description.geometry;
      const Vec3 centre = fine.ToWorld({0.5, 0, 0}), found = coarse.ToWorld({0, 0, 0});  // only x is halved
      for (int axis = 0; axis < 3; ++axis) EXPECT_DOUBLE_EQ(found[axis], centre[axis]);
    }
  }
}

// Ids that float32 rounds to one, and ones above 2^32.
TEST(OmeZarrWriterTest, LabelsOf64BitsAreExactAtEveryLevel) {
  const TemporaryDirectory directory;
  Random random(8);
  SCOPED_TRACE(random.trace());
  const Index3 size = {21, 18, 17};
  const std::vector<std::uint64_t> ids = {0, 12857642016, 12857642017, 13046505472, std::uint64_t{1} << 63 | 1};
  Case made;
  made.volume->description = {.geometry = {.size = size}, .type = ScalarType::kFloat32};
  made.volume->block = MakeVoxelBlock({{0, 0, 0}, size}, ScalarType::kFloat32);
  made.info = {.file_type = "uint64", .labels = true};
  made.exact = std::make_shared<ExactSamples>(ExactSamples{{SampleType::kUint64}, AlignedVector<std::byte>(CountIn(size) * 8)});
  const std::span samples(reinterpret_cast<std::uint64_t*>(made.exact->bytes.data()), CountIn(size));
  for (std::uint64_t& sample : samples) sample = ids[random.Integer<std::size_t>(0, ids.size() - 1)];
  for (const OmeZarrVersion version : {OmeZarrVersion::k04, OmeZarrVersion::k05}) {
    made.options = {.version = version, .chunk_side = 8, .shard_side = 16};
    const std::string folder = directory / std::string(ToString(version));
    const Status status = WriteOmeZarr(*made.source(), folder, made.options);
    ASSERT_TRUE(status.ok()) << status.message();
    const auto read = OpenSource(folder, {}, std::make_shared<ReadContext>(ReadContext::Limits{.decode_threads = 1})).value();
    EXPECT_EQ(read->info().exact.type, SampleType::kUint64);
    EXPECT_TRUE(read->info().labels);
    const auto level = [&](int number) {
      const Box box = read->info().levels[std::size_t(number)].description.geometry.bounds();
      std::vector<std::uint64_t> found(std::size_t(box.voxel_count()));
      EXPECT_TRUE(read->ReadNow(number, box, BoxRoom::Dense(box, reinterpret_cast<std::byte*>(found.data()), true)).ok());
      return found;
    };
    EXPECT_TRUE(std::ranges::equal(level(0), samples));
    ASSERT_GT(read->info().levels.size(), 1U);
    for (const std::uint64_t id : level(1)) EXPECT_TRUE(std::ranges::count(ids, id) == 1) << id;
  }
}

TEST(OmeZarrWriterTest, WrongAttributesAreNamed) {
  const TemporaryDirectory directory;
  const std::string folder = directory / "x.ome.zarr", file = folder + "/zarr.json";
  Random random(4);
  Case made = RandomCase(random, {9, 9, 9});
  made.options.version = OmeZarrVersion::k05;
  ASSERT_TRUE(WriteOmeZarr(*made.source(), folder, made.options).ok());
  const Json right = Json::Parse(ReadTextFile(file, std::size_t{1} << 20).value()).value();
  const auto refusal = [&](const std::string& field, const Json& value) {
    Json wrong = right;
    JsonAt(wrong, "/attributes/slabstream" + field) = value;
    std::ofstream(file) << wrong;
    return OpenSource(folder, {}, std::make_shared<ReadContext>(ReadContext::Limits{.decode_threads = 1})).status();
  };
  EXPECT_THAT(refusal("/orientation/world", "moon").message(),
              HasSubstr("slabstream.orientation.world is \"moon\", must be voxels, scene or patient"));
  EXPECT_THAT(refusal("/orientation/axes/0", {1, 0, 1}).message(), HasSubstr("must be 3 unit vectors at right angles, right-handed"));
  EXPECT_THAT(refusal("/orientation/axes/0", {-1, 0, 0}).message(), HasSubstr("right-handed"));
  EXPECT_THAT(refusal("/orientation/origin", {1, 2}).message(), HasSubstr("slabstream.orientation.origin"));
  EXPECT_THAT(refusal("/values/scale", 0).message(), HasSubstr("slabstream.values.scale is 0, must be a number other than 0"));
  EXPECT_EQ(refusal("/values/offset", "x").code(), StatusCode::kInvalidArgument);
}

TEST(OmeZarrWriterTest, TheBytesDoNotDependOnThreadsOrMemory) {
  const TemporaryDirectory directory;
  for (std::uint64_t seed = 0; seed < 3; ++seed) {
    Random random(seed);
    SCOPED_TRACE(random.trace());
    Case made = RandomCase(random, {50, 30, 20});
    const std::string one = directory / (std::to_string(seed) + "a.ome.zarr"), other = directory / (std::to_string(seed) + "b.ome.zarr");
    ASSERT_TRUE(WriteOmeZarr(*made.source(), one, made.options).ok());
    const ThreadLimit threads(1);
    // As little memory as it takes.
    made.options.memory = 1;
    const Status refused = WriteOmeZarr(*made.source(), other, made.options);
    EXPECT_EQ(refused.code(), StatusCode::kResourceExhausted);
    EXPECT_THAT(refused.message(), HasSubstr("of memory, but only 1 MiB are given"));
    made.options.memory = 64 << 20;
    ASSERT_TRUE(WriteOmeZarr(*made.source(), other, made.options).ok());
    std::map<std::string, std::string> expected = FilesIn(one), found = FilesIn(other);
    const std::string root = made.options.version == OmeZarrVersion::k05 ? "zarr.json" : ".zattrs";
    expected.erase(root);  // has the name of the folder
    found.erase(root);
    EXPECT_EQ(found, expected);
  }
}

TEST(OmeZarrWriterTest, GoesOnAfterEveryStop) {
  const TemporaryDirectory directory;
  for (std::uint64_t seed = 0; seed < 4; ++seed) {
    Random random(seed);
    SCOPED_TRACE(random.trace());
    Case made = RandomCase(random, {40, 20, 20});
    made.options.shard_side = 16;
    const std::string folder = directory / std::to_string(seed) + "/whole/x.ome.zarr";
    ASSERT_TRUE(WriteOmeZarr(*made.source(), folder, made.options).ok());
    const std::map<std::string, std::string> expected = FilesIn(folder);
    for (const int at_a_time : {1, 2, 5}) {
      const std::string parts = directory / std::to_string(seed) + "/" + std::to_string(at_a_time) + "/x.ome.zarr";
      int runs = 0;
      for (bool ended = false; !ended; ++runs) {
        ASSERT_LT(runs, 1000);
        std::stop_source stop;
        int regions = -1;  // the first call tells what is there
        std::uint64_t before = 0;
        made.options.stop = stop.get_token();
        made.options.progress = [&](const OmeZarrProgress& progress) {
          EXPECT_GE(progress.done_bytes, before);
          EXPECT_LE(progress.done_bytes, progress.all_bytes);
          before = progress.done_bytes;
          if (++regions == at_a_time) stop.request_stop();
        };
        const Status status = WriteOmeZarr(*made.source(), parts, made.options);
        ended = status.ok();
        EXPECT_TRUE(ended || status.code() == StatusCode::kCancelled) << status.message();
        // Nobody takes what is not finished for an image.
        EXPECT_EQ(ended, fs::exists(parts + (made.options.version == OmeZarrVersion::k05 ? "/zarr.json" : "/.zgroup")));
        std::ofstream(parts + "/0/left.1-2.tmp") << "of a process that was killed";
        if (ended) fs::remove(parts + "/0/left.1-2.tmp");
      }
      EXPECT_GT(runs, 1);
      EXPECT_EQ(FilesIn(parts), expected);
    }
  }
}

// Counts the reads of a source, which are as many regions of level 0 in memory.
class CountedSource : public VolumeSource {
 public:
  explicit CountedSource(std::shared_ptr<VolumeSource> source) : source_(std::move(source)) {}
  const SourceInfo& info() const override { return source_->info(); }
  void Read(int level, const Box& box, const BoxRoom& out, std::stop_token stop, ReadDone done) override {
    ++reads;
    largest = std::max(largest, std::size_t(box.voxel_count()) * BytesPerSample(info().levels[0].description.type));
    source_->Read(level, box, out, std::move(stop), std::move(done));
  }
  Counts counts() const override { return source_->counts(); }

  int reads = 0;
  std::size_t largest = 0;  // bytes

 private:
  const std::shared_ptr<VolumeSource> source_;
};

TEST(OmeZarrWriterTest, ReadsAheadOnlyIfThereIsMemoryForIt) {
  const TemporaryDirectory directory;
  Random random(3);
  Case made = RandomCase(random, {50, 30, 30});
  made.options.shard_side = 16;
  made.options.slices.reset();
  made.options.coarsest_side = 0;
  // The least memory that is enough.
  std::uint64_t least = 1 << 30;
  const auto folder = [&] { return directory / std::to_string(made.options.memory); };
  std::stop_source stopped;
  stopped.request_stop();
  for (std::uint64_t too_little = 0; least - too_little > 1;) {
    made.options.memory = (least + too_little) / 2;
    made.options.stop = stopped.get_token();
    const Status status = WriteOmeZarr(*made.source(), folder(), made.options);
    (status.code() == StatusCode::kResourceExhausted ? too_little : least) = made.options.memory;
  }
  made.options.stop = {};
  const std::uint64_t region = 16 * 16 * 16 * BytesPerSample(made.volume->description.type);
  for (const bool ahead : {false, true}) {
    CountedSource source(made.source());
    made.options.memory = least + (ahead ? region : region - 1);
    int finished = 0, most_ahead = 0;
    made.options.progress = [&](const OmeZarrProgress& progress) {
      if (progress.done_bytes > 0 && progress.level == 0) most_ahead = std::max(most_ahead, source.reads - ++finished);
    };
    EXPECT_TRUE(WriteOmeZarr(source, folder(), made.options).ok());
    EXPECT_EQ(most_ahead, ahead ? 1 : 0);
    EXPECT_EQ(source.largest, region);
    EXPECT_EQ(source.reads, 4 * 2 * 2);  // each voxel once
  }
}

// Boxes that are read of level 0, in their order.
class RecordedSource : public VolumeSource {
 public:
  explicit RecordedSource(std::shared_ptr<VolumeSource> source) : source_(std::move(source)) {}
  const SourceInfo& info() const override { return source_->info(); }
  void Read(int level, const Box& box, const BoxRoom& out, std::stop_token stop, ReadDone done) override {
    boxes.push_back(box);
    source_->Read(level, box, out, std::move(stop), std::move(done));
  }
  Counts counts() const override { return source_->counts(); }

  std::vector<Box> boxes;

 private:
  const std::shared_ptr<VolumeSource> source_;
};

TEST(OmeZarrWriterTest, ReadsSlicesInTheirOrderAndOnce) {
  const TemporaryDirectory directory;
  for (const Axis along : kAxes) {
    for (const bool from_end : {false, true}) {
      SCOPED_TRACE(testing::Message() << Letter(along) << from_end);
      Random random(6);
      Case made = RandomCase(random, {37, 30, 45});
      made.options.slices = SliceOrder{along, from_end};
      made.options.version = OmeZarrVersion::k05;
      const Index3& size = made.volume->description.geometry.size;
      EXPECT_LT(LeastMemoryFor(made.source()->info(), made.options), made.options.memory);
      const std::string folder = directory / (std::string(1, Letter(along)) + (from_end ? "1" : "0"));
      std::stop_source stop;
      made.options.stop = stop.get_token();
      int regions = -1;
      made.options.progress = [&](const OmeZarrProgress&) {
        if (++regions == 4) stop.request_stop();
      };
      EXPECT_EQ(WriteOmeZarr(*made.source(), folder, made.options).code(), StatusCode::kCancelled);
      made.options.stop = {};
      // What it goes on with comes in order, too.
      RecordedSource source(made.source());
      ASSERT_TRUE(WriteOmeZarr(source, folder, made.options).ok());
      ExpectLevels(made, folder);
      ASSERT_GT(source.boxes.size(), 1U);
      std::ranges::reverse(source.boxes);
      if (!from_end) std::ranges::reverse(source.boxes);
      for (std::size_t i = 0; i < source.boxes.size(); ++i) {
        Index3 whole = size;
        whole[along] = source.boxes[i].size()[along];
        EXPECT_EQ(source.boxes[i].size(), whole) << "all of each slice";
        EXPECT_EQ(source.boxes[i].begin[along] % 8, 0);
        if (i > 0) {
          EXPECT_EQ(source.boxes[i].begin[along], source.boxes[i - 1].end[along]);
        }
      }
    }
  }
}

Case SmallCase() {
  Random random(5);
  return RandomCase(random, {30, 20, 20});
}

TEST(OmeZarrWriterTest, LeavesOtherFoldersAlone) {
  const TemporaryDirectory directory;
  const Case made = SmallCase();
  const std::string folder = directory / "x.ome.zarr";
  ASSERT_TRUE(WriteOmeZarr(*made.source(), folder + "/", made.options).ok());
  const Status again = WriteOmeZarr(*made.source(), folder, made.options);
  EXPECT_EQ(again, Status::InvalidArgument("'" + folder + "' exists: remove it, or name another folder"));
  std::ofstream(directory / "file") << "text";
  EXPECT_EQ(WriteOmeZarr(*made.source(), directory / "file", made.options).code(), StatusCode::kInvalidArgument);
  fs::create_directory(directory / "empty");
  EXPECT_TRUE(WriteOmeZarr(*made.source(), directory / "empty", made.options).ok());
}

TEST(OmeZarrWriterTest, DoesNotGoOnWithAnotherConversion) {
  const TemporaryDirectory directory;
  Case made = SmallCase();
  std::stop_source stop;
  made.options.stop = stop.get_token();
  made.options.progress = [&](const OmeZarrProgress&) { stop.request_stop(); };
  const std::string folder = directory / "x.ome.zarr";
  EXPECT_EQ(WriteOmeZarr(*made.source(), folder, made.options).code(), StatusCode::kCancelled);
  Case other = made;
  other.options.stop = {};
  other.options.source = "other.nrrd";
  EXPECT_EQ(WriteOmeZarr(*made.source(), folder, other.options),
            Status::InvalidArgument("'" + folder +
                                    "' holds an unfinished conversion of another source, or with other options: remove it, or name "
                                    "another folder"));
  made.options.stop = {};
  EXPECT_TRUE(WriteOmeZarr(*made.source(), folder, made.options).ok());
}

TEST(OmeZarrWriterTest, AFullDiskEndsInOneLineAndItGoesOnLater) {
  const TemporaryDirectory directory;
  for (const OmeZarrVersion version : {OmeZarrVersion::k04, OmeZarrVersion::k05}) {
    Random random(8);
    Case made = RandomCase(random, {50, 30, 30});
    made.options.version = version;
    const std::string folder = directory / (std::string(ToString(version)) + ".ome.zarr");
    const Status full = OnFullDisk(3000, [&] { return WriteOmeZarr(*made.source(), folder, made.options); });
    EXPECT_EQ(full.code(), StatusCode::kUnavailable);
    EXPECT_THAT(full.message(), HasSubstr("File too large"));
    const Status later = WriteOmeZarr(*made.source(), folder, made.options);
    EXPECT_TRUE(later.ok()) << later.message();
    ExpectLevels(made, folder);
  }
}

TEST(OmeZarrWriterTest, NoticesThatTheSourceChanges) {
  const TemporaryDirectory directory;
  Case made = SmallCase();
  const std::string file = directory / "scan.nrrd", folder = directory / "x.ome.zarr";
  std::ofstream(file) << "1";
  made.info.files = {file};
  made.options.progress = [&](const OmeZarrProgress&) { std::ofstream(file, std::ios::app) << "2"; };
  EXPECT_EQ(WriteOmeZarr(*made.source(), folder, made.options),
            Status::Unavailable("'scan.nrrd' changed while it was read: remove '" + folder + "', and begin again"));
  EXPECT_EQ(WriteOmeZarr(*made.source(), folder, made.options).code(), StatusCode::kInvalidArgument);
}

TEST(OmeZarrWriterTest, NamesAFinishedFileThatIsDamaged) {
  const TemporaryDirectory directory;
  Random random(8);
  Case made = RandomCase(random, {50, 30, 30});
  made.options.version = OmeZarrVersion::k05;
  made.options.slices.reset();
  made.options.coarsest_side = 0;
  std::stop_source stop;
  made.options.stop = stop.get_token();
  int calls = 0;
  made.options.progress = [&](const OmeZarrProgress&) {
    if (++calls == 3) stop.request_stop();
  };
  const std::string folder = directory / "x.ome.zarr", shard = folder + "/0/c/0/0/0";
  EXPECT_EQ(WriteOmeZarr(*made.source(), folder, made.options).code(), StatusCode::kCancelled);
  fs::resize_file(shard, fs::file_size(shard) - 1);
  made.options.stop = {};
  EXPECT_EQ(WriteOmeZarr(*made.source(), folder, made.options), Status::DataLoss("'" + shard + "' is damaged: remove it, and go on"));
  fs::remove(shard);
  EXPECT_TRUE(WriteOmeZarr(*made.source(), folder, made.options).ok());
  ExpectLevels(made, folder);
}

TEST(OmeZarrWriterTest, RefusesOptionsThatAreOutOfRange) {
  const TemporaryDirectory directory;
  const auto refusal = [&](OmeZarrOptions options) { return WriteOmeZarr(*SmallCase().source(), directory / "x", options).message(); };
  EXPECT_EQ(refusal({.chunk_side = 7}), "chunk side: 7 is out of [8, 512]");
  EXPECT_EQ(refusal({.shard_side = 5000}), "shard side: 5000 is out of [64, 4096]");
  EXPECT_EQ(refusal({.shard_side = 100}), "shard side: 100 is not an even multiple of the chunk side 64");
  EXPECT_EQ(refusal({.codec_level = 20}), "codec level: 20 is out of [1, 19]");
}

}  // namespace
}  // namespace slabstream
