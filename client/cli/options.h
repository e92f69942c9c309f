// The options of each subcommand: plain values, filled by client_commands.cpp, valid when a command sees them.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "client/cli/turntable_values.h"
#include "client/movie/time_steps.h"
#include "client/request/camera_file.h"
#include "client/request/slice_request.h"
#include "client/service/service_choice.h"
#include "common/base/time.h"
#include "common/frame/frame_request.h"
#include "common/http/address.h"
#include "common/volume/clusters.h"
#include "common/volume/sphere.h"
#include "common/wire/client_messages.h"
#include "data/isosurface/surface_share.h"
#include "data/layers/layer_files.h"
#include "data/volume_io/read_options.h"
#include "data/volume_io/sample_type.h"
#include "data/zarr_writer/ome_metadata.h"

namespace slabstream {

inline constexpr int kMaxLocalWorkers = 256;  // EmbeddedOptions takes no more
inline constexpr int kMaxJobNodes = 1000;     // Slurm's MaxArraySize is 1001 unless a site changes it
inline constexpr int kMaxWorkersPerNode = 256;
inline constexpr int kMaxNoticeSeconds = 65535;  // Slurm's limit

// Where the frames are rendered.
struct ConnectionOptions {
  static constexpr int kSuitableWorkers = -1;  // a value of local_workers, only while options are read
  int local_workers = 0;                       // 0: render at the service; else in this process, by this many workers
  int local_threads = 0;                       // threads of each local worker; 0: LocalThreads
  std::uint64_t local_memory = 0;              // bytes, limit of this process with local workers; 0: none
  std::uint64_t local_cache = 0;               // bytes on disk for local workers; 0: none
  bool unasked = false;                        // local workers that nobody asked for (RendersHere)
  ServiceChoice service;
};

// What `render` and `turntable` share.
struct FrameOptions {
  ConnectionOptions connection;
  std::string source;    // a name of the catalogue; a path with local_workers > 0
  LayerFiles layers;     // with local_workers > 0
  FrameRequest request;  // `dataset` is filled in when the connection is open
  PictureFormat format;
  bool record = true;                               // pictures hold how they were made
  std::string stats_path, trace_path, camera_path;  // files to be written; empty: not wanted
  std::optional<HttpUrl> collector;                 // OpenTelemetry's collector, which gets the spans; none: not wanted
  bool progress = false;
};

// A volume, and the transfer function that it is shown with.
struct SourceChoice {
  std::string source;
  TransferChoice transfer;
};

struct RenderOptions {
  FrameOptions frame;                 // the options of each picture; its source and transfer function are those of `sources`
  std::vector<SourceChoice> sources;  // at least one
  std::string output;                 // with several sources: PictureOrders
};

inline constexpr int kMaxInFlight = 64;

struct TurntableOptions {
  FrameOptions frame;
  TurntableOutput output;
  std::optional<double> frames_per_second;  // for a movie, [kMinFramesPerSecond, kMaxFramesPerSecond]; none: MovieShape's own
  std::optional<TimeSteps> times;           // of SOURCE; none: one, which the request says
  // [1, kMaxTurntableFrames], spread evenly over turns, path and times; none: one for each time, or as many as the path's seconds need.
  std::optional<int> frames;
  int turns = 1;                      // [0, kMaxTurns], which begin at the request's azimuth
  std::optional<PathText> path = {};  // instead of turns
  int in_flight = 2;                  // [1, kMaxInFlight] frames requested and not yet complete
};

struct SliceOptions {
  ConnectionOptions connection;
  std::string source, output;
  LayerFiles layers;   // with local_workers > 0
  SliceRequest slice;  // `frame.dataset` is filled in when the connection is open
};

struct InfoOptions {
  std::string path;
  std::uint64_t cache = 0;  // bytes on disk, for what web servers send; 0: none
  LayerFiles layers;
  FrameRequest request;  // its transfer function alone
  bool json = false;
};

// A volume that is asked about.
struct AskedVolume {
  ConnectionOptions connection;
  std::string source;       // a name of the catalogue; a path with local_workers > 0
  std::string field, time;  // as in SampleQuery
};

struct ValueOptions {
  AskedVolume volume;
  LayerFiles layers;                // with local_workers > 0
  std::vector<std::string> points;  // as ParsePoint takes them; 1 ... kMaxSamplePoints
  bool json = false;
};

// Texts as measure.cpp parses them; points are X,Y,Z of the world, separated by ':'.
struct MeasureOptions {
  AskedVolume volume;
  std::vector<std::string> distances;  // two points
  std::vector<std::string> angles;     // three points; the angle is at the second one
  std::vector<std::string> profiles;   // two points
  std::vector<std::string> boxes;      // as ParseClipBox takes them
  bool labels = false;                 // the voxels of each label
  LayerFiles layers;                   // the labels, with local_workers > 0
  int samples = 0;                     // samples of each profile, [2, kMaxSamplePoints]; 0: one for each voxel that the line passes
  bool json = false;
  bool csv = false;  // for labels, and for nothing else
};

struct TransferOptions {
  FrameRequest request;  // its transfer function alone, a preset
  std::string path;      // the volume that it is made for; "": none was given
  bool list = false;     // all presets, instead of one
  std::string preview;   // with `list`: a picture of the colour maps; "": none
};

struct ConvertOptions {
  std::string source;  // a path, with options for reading it or without
  std::string output;
  std::optional<SampleType> type;  // the type of the samples in `output`
  int level = 0;                   // the level of `source`
  Box box = {};                    // in voxels of that level; an end of 0: to the last one
  std::uint64_t memory = 0;        // bytes, limit of this process; 0: none
  std::uint64_t cache = 0;         // bytes on disk, for what web servers send; 0: none
  OmeZarrVersion zarr_version = OmeZarrVersion::k05;
  bool progress = false;

  bool converts_part() const { return level != 0 || box != Box{}; }
};

struct IndexingOptions {
  std::string source;        // a path, with options for reading it or without
  std::uint64_t memory = 0;  // bytes, limit of this process; 0: the usual one
  std::uint64_t cache = 0;   // bytes on disk, for what web servers send; 0: none
  bool progress = false;
};

struct IsosurfaceCommandOptions {
  std::string source;                  // a path, with options for reading it or without
  std::string output;                  // the mesh
  std::optional<double> isovalue;      // this or the label
  std::optional<std::uint64_t> label;  // at least 1
  int level = 0;                       // the level of `source`
  bool caps = false;
  SurfaceShare share;       // what this process makes of it
  std::uint64_t cache = 0;  // bytes on disk, for what web servers send; 0: none
  bool progress = false;
};

struct SphereOptions {
  SphereRequest request;
  std::string output;
};

struct ClustersOptions {
  ClusterRequest request;
  std::string output;
};

inline constexpr int kMaxUpWorkers = 256;

struct UpOptions {
  int workers = 0;                // processes, [1, kMaxUpWorkers]; 0, only while options are read: as many as suit machine and memory
  int threads = 0;                // threads of each worker; 0: CoreShare
  std::vector<std::string> data;  // NAME=PATH or DIR, as slabstream-coordinator takes them
  std::string listen;             // endpoint for clients; a wildcard port is fine
  std::string keys;               // folder of keys; empty: one beside the logs if `listen` leaves this machine, else none
  std::string compress = "auto";  // compression of images on their way: auto, on or off, as slabstream-worker takes it
  std::uint64_t memory = 0;       // bytes, of all processes together
  std::uint64_t cache = 0;        // bytes on disk, as slabstream-worker takes it; 0: none
  int metrics = 0;                // port of the coordinator's metrics, those of workers at the next ones; 0: none
  bool detach = false;
  bool unlisted = false;  // ServiceState::unlisted
  std::string log_level;  // the log level of the processes that it starts; empty: info
};

struct ViewOptions {
  ServiceChoice service;
  std::string source;       // a volume file, or a dataset's name at the service
  LayerFiles layers;        // the layers of a file
  std::uint64_t cache = 0;  // UpOptions::cache of the service that it starts
  std::string listen;       // as slabstream-gateway takes it
  std::string token_file;   // as slabstream-gateway takes it; empty: a new token. A file that does not exist is made
  bool browser = true;      // open it, if there is a display
};

struct DownOptions {
  ServiceChoice service;
  bool all = false;  // every service that `up` started here
};

struct StatusOptions {
  ServiceChoice service;
  bool json = false;
};

struct KeysOptions {
  ServiceChoice service;
  KeysOrder order;
  std::string output;  // the service file of kIssue; empty: NAME.json
};

struct DataOptions {
  ServiceChoice service;
  DataOrder order;
  bool json = false;
};

struct SteerOptions {
  ServiceChoice service;
  SteerDataset order;
  std::vector<std::string> values;  // NAME=VALUE
  bool json = false;
};

struct LogsOptions {
  ServiceChoice service;
  bool follow = false;
  Duration since{};  // how long ago the first line may have been written; 0: any time
};

struct TokenOptions {
  Duration lasts{};                   // at least a second
  std::vector<std::string> datasets;  // empty: all
  bool view_only = false;
  std::string token_file;  // the gateway's; empty: the token of the gateway of this user that was started here last
};

struct SlurmOptions {
  int nodes = 1;                        // [1, kMaxJobNodes]
  int workers_per_node = 1;             // [1, kMaxWorkersPerNode]
  int threads = 0;                      // threads of each worker; 0: the cores of a node divided by its workers
  std::string time;                     // the time limit of the job, as Slurm takes it; empty: none
  int notice_seconds = 60;              // [1, kMaxNoticeSeconds]
  std::vector<std::string> data;        // NAME=PATH or DIR, as slabstream-coordinator takes them
  std::string folder;                   // a folder that all nodes share; empty: the one from which the job is submitted
  std::vector<std::string> directives;  // as ParseDirective (job_script.h) takes them
};

}  // namespace slabstream
