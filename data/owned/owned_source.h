// A volume whose voxels stay with the processes that own them (owners), at one time. Those of owners on this host are read in their memory
// (owner_memory.h); those of others by a function of whoever can ask them: the coordinator. It also asks owners for boxes that they make
// on demand. Level n of it is every 2^n-th voxel along each axis (voxel_lattice.h). There are so many levels that the coarsest one takes at
// most kCoarsestBytes; a rectilinear grid has one, and so has what is made on demand.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "common/base/status.h"
#include "common/memory/bytes.h"
#include "common/volume/volume.h"
#include "data/owned/owner_memory.h"
#include "data/sources/read_context.h"
#include "data/sources/volume_source.h"

namespace slabstream {

inline constexpr std::uint32_t kMostAskedBytes = 1U << 20;  // of samples that an owner is asked for at a time
inline constexpr std::int64_t kCoarsestBytes = 8 << 20;     // what the survey of such a source reads (kFarSurvey)

// All owners of a volume at a time. Its text is StoredAt::source.
struct OwnedField {
  std::string dataset;
  std::uint64_t time = 0;
  std::vector<OwnerPlace> owners;
  Index3 block = Uniform(kBrick);  // SourceLevel::block: of boxes that are made on demand the first one's size

  std::string Text() const;
  // InvalidArgument: not a text of owners.
  static Result<OwnedField> Parse(const std::string& text);
  friend bool operator==(const OwnedField&, const OwnedField&) = default;
};

struct AskedVoxels {
  Box box;
  int level = 0;          // every 2^level-th voxel of the box along each axis, from its first one on
  bool in_place = false;  // the box is to be made, and its samples need not come
};
// Asks an owner for samples as it holds them, x fastest, at most kMostAskedBytes; none: in place. Calls `done` once, on any thread, which
// it must not hold up.
using AskOwner = std::function<void(std::uint32_t owner, const AskedVoxels& voxels, std::function<void(Result<Bytes>)> done)>;

// What the coordinator knows of a field.
struct OwnedVolume {
  // All fields of the dataset at this time; null: not known, and At gives none.
  std::shared_ptr<const std::vector<OwnedVolume>> fields = {};
  std::vector<FieldInfo> channels = {};  // of `fields`, in their order; empty: there is one, which has no name
  int channel = 0;
  OwnedField field;
  VolumeDescription description = {};        // of kept samples (KeptTypeOf)
  ExactType exact = {};                      // as they are held
  std::vector<std::vector<Box>> boxes = {};  // of each owner
  bool on_demand = false;                    // all owners make their boxes on demand
  std::vector<Box> of_nobody = {};           // voxels of owners that are gone, which read as 0; together they tile the volume
  std::string missing = {};                  // VolumeSummary::missing, a note of the source
  AskOwner ask = {};
  std::shared_ptr<const FileStamp> growth = {};  // tells when there is another time
  std::shared_ptr<const void> use = {};          // kept as long as the source
};
std::shared_ptr<VolumeSource> MakeOwnedSource(OwnedVolume volume, const SourceContext& context);

// The same in any other process, which reaches what owners on its host hold. It knows no place in the world and no mapping. Waits for
// nothing. Unavailable: none of them is here. Errors of OwnedField::Parse.
Result<std::shared_ptr<VolumeSource>> OpenOwned(const std::string& text, const SourceContext& context);

}  // namespace slabstream
