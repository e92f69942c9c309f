// Readers of single formats. Each tells `builder` what the file holds, or its failure. Messages do not name the file.
#pragma once

#include <string>
#include <string_view>

#include "data/shapes/shape_builder.h"

namespace slabstream {

// `bytes`: of the whole file.
void ReadPly(std::string_view bytes, ShapeBuilder& builder);
void ReadStl(std::string_view bytes, ShapeBuilder& builder);
void ReadObj(std::string_view bytes, ShapeBuilder& builder);
void ReadGlb(std::string_view bytes, ShapeBuilder& builder);
void ReadFreeSurfer(std::string_view bytes, ShapeBuilder& builder);
void ReadGifti(std::string_view bytes, ShapeBuilder& builder);
void ReadTrk(std::string_view bytes, ShapeBuilder& builder);
void ReadTck(std::string_view bytes, ShapeBuilder& builder);
void ReadTable(std::string_view bytes, ShapeBuilder& builder);

// Whether the beginning of a file, whatever its ending, is that of a surface of FreeSurfer; of an array with a point in each row.
bool IsFreeSurfer(const std::string& path);
bool IsNpyOfPoints(const std::string& path);

void ReadNpyOfPoints(const std::string& path, ShapeBuilder& builder);
void ReadVtkPolydata(const std::string& path, ShapeBuilder& builder);

// Whether a text at the file's beginning says that x is to a patient's left and y to posterior, as 3D Slicer writes it.
inline bool SaysLps(std::string_view text) { return text.find("SPACE=LPS") != std::string_view::npos; }

}  // namespace slabstream
