// Makes a mesh of the contents of an unstructured grid's file of any format, and says what is wrong with it. The calls come in the
// order of their declarations; after an error there are no more. Errors name the path.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "common/base/aligned_buffer.h"
#include "common/base/status.h"
#include "data/volume_io/mesh_reader.h"
#include "data/volume_io/sample_type.h"

namespace slabstream {

class MeshBuilder {
 public:
  // `format`: for the user.
  MeshBuilder(std::string path, std::string format);

  // An array of the file. `active`: the file says that it is the one to show.
  void AddArray(const MeshArray& array, bool active);
  // The one that is read, by its number: InvalidArgument: there is none, or it is not clear which.
  Result<std::size_t> ChooseArray(const MeshOptions& options);
  // x, y and z of each point, in the world. InvalidArgument: a place that is not finite, an extent that is too small or too large.
  Status SetPoints(const AlignedVector<double>& places);
  // The cells' kinds by VTK's numbers, and for each cell where its points end among those of all cells, which follow each other. How many
  // points that are. InvalidArgument: a kind that is not supported. DataLoss: ends that do not fit the kinds. ResourceExhausted: too many.
  Result<std::int64_t> SetCells(const AlignedVector<std::int64_t>& kinds, const AlignedVector<std::int64_t>& ends);
  // The points of all cells. DataLoss: numbers of points that there are not. InvalidArgument: no cell has a volume.
  Status SetCorners(const AlignedVector<std::int64_t>& corners);
  // The values of the chosen array, one for each point or cell of the file.
  void SetValues(AlignedVector<float> values);
  LoadedMesh Take() { return std::move(result_); }

 private:
  Status Wrong(const std::string& why) const { return Status::InvalidArgument(path_ + ": " + why); }
  Status Damaged(const std::string& why) const { return Status::DataLoss(path_ + ": " + why); }
  // Takes memory for what the cells of info.kinds make.
  Status ReserveTetrahedra();

  std::string path_;
  LoadedMesh result_;
  std::vector<bool> active_;            // by array
  std::vector<const CellKind*> kinds_;  // by cell
  std::vector<std::uint32_t> cells_;    // by tetrahedron: the cell that it is a part of
};

// Samples as numbers of another type.
template <class T>
AlignedVector<T> Converted(SampleType type, const AlignedVector<std::byte>& bytes) {
  AlignedVector<T> out(bytes.size() / BytesPerSample(type));
  VisitSampleType(type, [&]<class S>(const S*) {
    const std::span samples(reinterpret_cast<const S*>(bytes.data()), out.size());
    std::ranges::transform(samples, out.begin(), [](S sample) { return static_cast<T>(sample); });
  });
  return out;
}

}  // namespace slabstream
