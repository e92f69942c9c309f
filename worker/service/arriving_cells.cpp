#include "worker/service/arriving_cells.h"

#include <fmt/format.h>

#include <utility>

#include "common/mesh/mesh_part.h"
#include "common/volume/memory_budget.h"
#include "common/wire/payload.h"

namespace slabstream {

Status ArrivingCells::Store(const Chunk& chunk, std::span<const std::byte> payload) {
  if (cells_ != nullptr) return Status::Ok();
  if (stored_.empty()) {
    if (Status status = CheckFitsMemory(std::int64_t(chunk.cell_bytes), "cells of a padded box"); !status.ok()) return status;
    bytes_.resize(chunk.cell_bytes);
    missing_ = CellChunkCount(chunk.cell_bytes);
    stored_.resize(missing_);
  }
  if (chunk.cell_bytes != bytes_.size()) {
    return Status::DataLoss(fmt::format("a chunk of {} bytes of cells among those of {}", chunk.cell_bytes, bytes_.size()));
  }
  const std::span<std::byte> part = std::span(bytes_).subspan(BeginOfCellChunk(chunk.chunk), chunk.raw_bytes);
  if (stored_[chunk.chunk - kFirstCellChunk]) return Status::Ok();
  if (Status status = UnpackChunk(chunk, payload, part); !status.ok()) return status;
  stored_[chunk.chunk - kFirstCellChunk] = true;
  if (--missing_ > 0) return Status::Ok();
  Result<Mesh> mesh = DecodeMesh(bytes_);
  *this = {};
  if (!mesh.ok()) return mesh.status();
  cells_ = std::make_shared<const Mesh>(*std::move(mesh));
  return Status::Ok();
}

}  // namespace slabstream
